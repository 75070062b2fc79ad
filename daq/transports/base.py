"""What every way to an instrument can do, and the bound that every wait carries.

Owns `Transport`, the protocol that drivers are written against, `Deadline`,
and the reading of definite-length blocks. It opens nothing and knows no
command of any instrument.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from daq.errors import ProtocolError

__all__ = [
    "BLOCK_LIMIT_BYTES",
    "KEPT_LIMIT_BYTES",
    "LINE_LIMIT_BYTES",
    "Deadline",
    "Transport",
    "ask",
    "ask_block",
    "block_of",
    "checked_line",
    "take_block",
]

LINE_LIMIT_BYTES = 119
"""Longest message sent. The analyser's input queue holds 128 bytes, and an AR488 adapter cuts
a line of 128 bytes into two messages; both are left some room."""

BLOCK_LIMIT_BYTES = 1 << 20
"""Largest block accepted; a longer claim is taken for a damaged header, not waited for."""

KEPT_LIMIT_BYTES = 2 * BLOCK_LIMIT_BYTES
"""Most that is kept of what came and was not read; who sends more talks without end."""


@dataclass(frozen=True, slots=True)
class Deadline:
    """A moment on the monotonic clock at which a wait gives up.

    Clock changes do not move it, and it is handed down unchanged, so that a
    wait made of several reads still ends when the caller said.
    """

    at_s: float
    span_s: float
    """How long the wait was meant to be at most, for messages."""

    @classmethod
    def after(cls, seconds: float) -> Deadline:
        """The moment `seconds` from now."""
        return cls(time.monotonic() + seconds, seconds)

    @property
    def remaining_s(self) -> float:
        """Seconds left, never negative."""
        return max(0.0, self.at_s - time.monotonic())

    @property
    def expired(self) -> bool:
        """Whether nothing is left."""
        return time.monotonic() >= self.at_s

    def within(self, seconds: float) -> Deadline:
        """The earlier of this deadline and `seconds` from now."""
        sooner = Deadline.after(seconds)
        return sooner if sooner.at_s < self.at_s else self


class Transport(Protocol):
    """A wire to one instrument.

    Every method may raise `LinkError` when the connection is gone. A message
    is one line of text without terminator; a reply comes back without its
    line feed. A transport is used by one thread at a time; the driver sees
    to that.
    """

    @property
    def address(self) -> str:
        """The URL that this transport was opened with, for messages."""
        ...

    def write(self, line: str, deadline: Deadline) -> None:
        """Send one message.

        Raises
        ------
        BenchTimeout
            If the wire did not take it in time.
        ProtocolError
            If the line cannot be sent whole (see `checked_line`).
        """
        ...

    def read(self, deadline: Deadline) -> str:
        """One text reply, without terminator.

        Raises
        ------
        BenchTimeout
            If nothing came in time; names the message that waited.
        ProtocolError
            If the reply was cut short or is not text; says how much came.
        """
        ...

    def read_block(self, deadline: Deadline) -> bytes:
        """The payload of one definite-length block; raises as `read` does."""
        ...

    def read_bytes(self, count: int, deadline: Deadline) -> bytes:
        """A reply of exactly `count` bytes, without header, any byte among them.

        Raises as `read` does; also `ProtocolError` where the reply is known to have another
        length.
        """
        ...

    def serial_poll(self, deadline: Deadline) -> int | None:
        """The status byte, read past the instrument's parser; None if the wire has no such thing.

        Raises
        ------
        BenchTimeout
            If the instrument did not answer the poll.
        """
        ...

    def device_clear(self, deadline: Deadline) -> bool:
        """Free the instrument's parser and queues, and drop what lies unread on this side.

        Returns False if the wire can only do the latter.
        """
        ...

    def pause(self, seconds: float) -> None:
        """Let time pass on this wire's clock; a replayed dialogue does not wait."""
        ...

    def close(self) -> None:
        """Let go of the wire; may be called twice, sends nothing to the instrument."""
        ...


def ask(transport: Transport, line: str, deadline: Deadline) -> str:
    """Send a query and read its text reply."""
    transport.write(line, deadline)
    return transport.read(deadline)


def ask_block(transport: Transport, line: str, deadline: Deadline) -> bytes:
    """Send a query and read the block that answers it."""
    transport.write(line, deadline)
    return transport.read_block(deadline)


def checked_line(line: str) -> bytes:
    """The bytes of a message, if it can be sent whole as one message.

    Raises
    ------
    ProtocolError
        If it is empty, not ASCII, holds a line end, or is longer than `LINE_LIMIT_BYTES`.
    """
    try:
        data = line.encode("ascii")
    except UnicodeEncodeError as error:
        raise ProtocolError(f"message {line!r} is not ASCII; nothing was sent") from error
    if not data or b"\n" in data or b"\r" in data:
        raise ProtocolError(f"message {line!r} is empty or holds a line end; nothing was sent")
    if len(data) > LINE_LIMIT_BYTES:
        raise ProtocolError(
            f"message {line[:40]!r}... has {len(data)} bytes, the limit is "
            f"{LINE_LIMIT_BYTES}; nothing was sent, split it"
        )
    return data


def take_block(take: Callable[[int], bytes]) -> bytes:
    """Read one definite-length block: ``#``, a digit n, n digits of length, payload, line feed.

    Parameters
    ----------
    take
        Returns exactly as many bytes as asked for, or raises.

    Returns
    -------
    bytes
        The payload. It may hold any byte; none is taken for an end.

    Raises
    ------
    ProtocolError
        If the header is damaged, claims more than `BLOCK_LIMIT_BYTES`, or no
        line feed follows the payload.
    """
    start = take(2)
    if start[:1] != b"#" or not start[1:].isdigit():
        raise ProtocolError(f"a block should start with '#' and a digit, but {start!r} came")
    if start == b"#0":
        raise ProtocolError("a block of indefinite length came, one of stated length was due")
    digits = take(int(start[1:]))
    if not digits.isdigit():
        raise ProtocolError(f"the length of a block should be digits, but {digits!r} came")
    length = int(digits)
    if length > BLOCK_LIMIT_BYTES:
        raise ProtocolError(
            f"a block claims {length} bytes, more than {BLOCK_LIMIT_BYTES}; "
            "its header must be damaged"
        )
    payload = take(length) if length else b""
    end = take(1)
    if end != b"\n":
        raise ProtocolError(f"a block of {length} bytes is followed by {end!r}, not by a line feed")
    return payload


def block_of(message: bytes, name: str) -> bytes:
    """The payload of one definite-length block that is a whole message.

    Parameters
    ----------
    message
        As it came, the line feed after the block included.
    name
        Of the block, for messages.

    Raises
    ------
    ProtocolError
        If the message is no block, ends within it, or goes on behind it.
    """
    taken = 0

    def take(count: int) -> bytes:
        nonlocal taken
        part = message[taken : taken + count]
        if len(part) < count:
            raise ProtocolError(
                f"{name} was cut short: {len(message)} bytes came, {taken + count} were due"
            )
        taken += count
        return part

    payload = take_block(take)
    if taken < len(message):
        raise ProtocolError(f"{name} is followed by {len(message) - taken} bytes")
    return payload
