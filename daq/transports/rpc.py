"""Remote procedure calls as VXI-11 uses them: records of a stream, call and reply (RFC 5531).

Owns framing and headers of ONC RPC and the basic types of XDR (RFC 4506), for both ends. It knows
no procedure and no connection.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

__all__ = [
    "GARBAGE_ARGUMENTS",
    "PORT_MAPPER",
    "PROCEDURE_UNAVAILABLE",
    "PROGRAM_UNAVAILABLE",
    "Arguments",
    "Call",
    "Records",
    "accepted",
    "opaque",
    "packed_call",
    "parse_call",
    "parse_reply",
    "refused",
    "words",
]

PROGRAM_UNAVAILABLE, PROCEDURE_UNAVAILABLE, GARBAGE_ARGUMENTS = 1, 3, 4
PORT_MAPPER = 100000
_LAST = 0x80000000
_LONGEST = 64 << 20
_CALL, _REPLY, _RPC_VERSION = 0, 1, 2


class Records:
    """Cuts a stream into records, each of one or several fragments."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._record = bytearray()

    def feed(self, data: bytes) -> None:
        """Take bytes as they come."""
        self._bytes += data

    def take(self) -> bytes | None:
        """The next whole record, None if there is none yet.

        Raises
        ------
        ValueError
            If one is longer than any of VXI-11.
        """
        while len(self._bytes) >= 4:
            head = int.from_bytes(self._bytes[:4], "big")
            length = head & ~_LAST
            if length + len(self._record) > _LONGEST:
                raise ValueError(f"a record of {length} bytes")
            if len(self._bytes) < 4 + length:
                return None
            self._record += self._bytes[4 : 4 + length]
            del self._bytes[: 4 + length]
            if head & _LAST:
                record = bytes(self._record)
                self._record.clear()
                return record
        return None


class Arguments:
    """Reads the arguments of a call one by one; ValueError where they end early."""

    def __init__(self, data: bytes) -> None:
        self._data = data

    def whole(self) -> int:
        """An unsigned integer of four bytes."""
        if len(self._data) < 4:
            raise ValueError("arguments end early")
        value = int.from_bytes(self._data[:4], "big")
        self._data = self._data[4:]
        return value

    def bytes(self) -> bytes:
        """Bytes with their number before them, filled up to fours."""
        length = self.whole()
        if length > len(self._data):
            raise ValueError("arguments end early")
        value = self._data[:length]
        self._data = self._data[length + -length % 4 :]
        return value


@dataclass(frozen=True, slots=True)
class Call:
    """One call."""

    number: int
    program: int
    procedure: int
    arguments: Arguments


def parse_call(record: bytes) -> Call:
    """Read the head of a call; ValueError if it is none."""
    head = Arguments(record)
    number, kind, version = head.whole(), head.whole(), head.whole()
    if (kind, version) != (_CALL, _RPC_VERSION):
        raise ValueError("no call of RPC version 2")
    program, _version, procedure = head.whole(), head.whole(), head.whole()
    for _ in ("credential", "verifier"):
        head.whole()
        head.bytes()
    return Call(number, program, procedure, head)


def packed_call(number: int, program: int, procedure: int, arguments: bytes) -> bytes:
    """The record of a call: version 1 of a program, 2 of the port mapper; no credentials."""
    version = 2 if program == PORT_MAPPER else 1
    head = words(number, _CALL, _RPC_VERSION, program, version, procedure, 0, 0, 0, 0)
    return _record(head + arguments)


def parse_reply(record: bytes) -> tuple[int, Arguments]:
    """Number of the call that is answered, and its result; ValueError if it was not made."""
    found = Arguments(record)
    number, kind, denied = found.whole(), found.whole(), found.whole()
    if (kind, denied) != (_REPLY, 0):
        raise ValueError("the call was denied")
    found.whole()
    found.bytes()
    if status := found.whole():
        raise ValueError(f"the call was not made, status {status}")
    return number, found


def accepted(call: Call, result: bytes) -> bytes:
    """The record that answers a call with a result."""
    return _record(words(call.number, _REPLY, 0, 0, 0, 0) + result)


def refused(call: Call, why: int) -> bytes:
    """The record that answers a call that cannot be made."""
    return _record(words(call.number, _REPLY, 0, 0, 0, why))


def words(*values: int) -> bytes:
    """Unsigned integers of four bytes each."""
    return struct.pack(f">{len(values)}I", *values)


def opaque(data: bytes) -> bytes:
    """Bytes with their number before them, filled up to fours."""
    return words(len(data)) + data + b"\0" * (-len(data) % 4)


def _record(content: bytes) -> bytes:
    return words(_LAST | len(content)) + content
