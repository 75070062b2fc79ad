"""An instrument on a bare stream, TCP or RS-232: one character ends a message, and a reply.

Owns where a reply ends on a wire that has no ends of its own. Such a wire has no
serial poll and no device clear. It speaks no SCPI.
"""

from __future__ import annotations

import time

from daq.errors import BenchTimeout, ProtocolError
from daq.transports.base import Deadline, checked_line, take_block
from daq.transports.inbox import Inbox
from daq.transports.links import Link

__all__ = ["StreamTransport"]


class StreamTransport:
    """Messages over an open link to the instrument itself; see `Transport`.

    Parameters
    ----------
    reply_end
        The character that ends a reply. What other line ends stand around it is dropped.
    """

    def __init__(self, link: Link, address: str, reply_end: bytes = b"\n") -> None:
        self.address = address
        self._end = reply_end
        self._link = link
        self._waiting = "nothing"
        self._inbox = Inbox(link, "the instrument")

    def write(self, line: str, deadline: Deadline) -> None:
        """Send one message."""
        data = checked_line(line) + b"\n"
        self._waiting = line
        self._link.send(data, deadline)

    def read(self, deadline: Deadline) -> str:
        """One text reply, without terminator."""
        while (line := self._inbox.taken_line(self._end)) is None:
            self._wait_for_more(deadline)
        try:
            return line.decode("ascii").strip()
        except UnicodeDecodeError as error:
            raise ProtocolError(
                f"{self.address}: the reply to {self._waiting!r} is not text: {line[:60]!r}"
            ) from error

    def read_block(self, deadline: Deadline) -> bytes:
        """The payload of one definite-length block."""
        before = 0

        def take(count: int) -> bytes:
            nonlocal before
            while (part := self._inbox.taken(count)) is None:
                self._wait_for_more(deadline, before)
            before += count
            return part

        return take_block(take)

    def read_bytes(self, count: int, deadline: Deadline) -> bytes:
        """A reply of so many bytes; what follows it is the next reply's."""
        while (data := self._inbox.taken(count)) is None:
            self._wait_for_more(deadline)
        return data

    def serial_poll(self, deadline: Deadline) -> None:
        """None: there is no such thing on this wire."""

    def device_clear(self, deadline: Deadline) -> bool:
        """Drop what lies unread, without waiting for more; False, as nothing is cleared."""
        self._inbox.clear()
        self._inbox.emptied()
        return False

    def pause(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(seconds)

    def close(self) -> None:
        """Let go of the link."""
        self._link.close()

    def _wait_for_more(self, deadline: Deadline, before: int = 0) -> None:
        """Gather bytes of a reply, `before` of which were used up; dribbles do not stretch it."""
        begun = before + len(self._inbox) > 0
        if not (begun and deadline.expired) and self._inbox.gather(deadline):
            return
        self._inbox.clear()
        if begun:
            raise ProtocolError(
                f"{self.address}: the reply to {self._waiting!r} began and was cut short; "
                f"its end did not come within {deadline.span_s:g} s"
            )
        raise BenchTimeout(
            f"{self.address}: {self._waiting!r} got no answer within {deadline.span_s:g} s; "
            "is the instrument switched on and at this address?"
        )
