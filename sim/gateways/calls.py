"""Remote procedure calls as VXI-11 uses them: records of a stream, call and reply (RFC 5531).

Owns framing and headers of ONC RPC and the basic types of XDR (RFC 4506). It knows no procedure.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

__all__ = ["Arguments", "Call", "Records", "accepted", "opaque", "parse_call", "refused"]

PROGRAM_UNAVAILABLE, PROCEDURE_UNAVAILABLE, GARBAGE_ARGUMENTS = 1, 3, 4
_LAST = 0x80000000
_LONGEST = 1 << 20
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
            If one is longer than any call of VXI-11.
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
    words = Arguments(record)
    number, kind, version = words.whole(), words.whole(), words.whole()
    if (kind, version) != (_CALL, _RPC_VERSION):
        raise ValueError("no call of RPC version 2")
    program, _version, procedure = words.whole(), words.whole(), words.whole()
    for _ in ("credential", "verifier"):
        words.whole()
        words.bytes()
    return Call(number, program, procedure, words)


def accepted(call: Call, result: bytes) -> bytes:
    """The record that answers a call with a result."""
    return _record(struct.pack(">6I", call.number, _REPLY, 0, 0, 0, 0) + result)


def refused(call: Call, why: int) -> bytes:
    """The record that answers a call that cannot be made."""
    return _record(struct.pack(">6I", call.number, _REPLY, 0, 0, 0, why))


def opaque(data: bytes) -> bytes:
    """Bytes with their number before them, filled up to fours."""
    return struct.pack(">I", len(data)) + data + b"\0" * (-len(data) % 4)


def _record(content: bytes) -> bytes:
    return struct.pack(">I", _LAST | len(content)) + content
