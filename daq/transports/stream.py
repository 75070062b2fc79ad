"""An instrument on a bare TCP stream: one line feed ends a message, and a reply.

Owns where a reply ends on a wire that has no ends of its own, and what is kept of
one that does not end. Such a wire has no serial poll and no device clear. It speaks
no SCPI.
"""

from __future__ import annotations

import time

from daq.errors import BenchTimeout, ProtocolError
from daq.transports.base import KEPT_LIMIT_BYTES, Deadline, checked_line, take_block
from daq.transports.links import Link

__all__ = ["StreamTransport"]


class StreamTransport:
    """Messages over an open link to the instrument itself; see `Transport`."""

    def __init__(self, link: Link, address: str) -> None:
        self.address = address
        self._link = link
        self._waiting = "nothing"
        self._kept = bytearray()

    def write(self, line: str, deadline: Deadline) -> None:
        """Send one message."""
        data = checked_line(line) + b"\n"
        self._waiting = line
        self._link.send(data, deadline)

    def read(self, deadline: Deadline) -> str:
        """One text reply, without terminator."""
        while (end := self._kept.find(b"\n")) < 0:
            self._wait_for_more(deadline, begun=bool(self._kept))
        line = self._taken(end + 1)
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
            while len(self._kept) < count:
                self._wait_for_more(deadline, begun=bool(before or self._kept))
            before += count
            return self._taken(count)

        return take_block(take)

    def serial_poll(self, deadline: Deadline) -> None:
        """None: there is no such thing on this wire."""

    def device_clear(self, deadline: Deadline) -> bool:
        """Drop what lies unread, without waiting for more; False, as nothing is cleared."""
        self._kept.clear()
        while self._gather(Deadline.after(0.0)):
            pass
        self._kept.clear()
        return False

    def pause(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(seconds)

    def close(self) -> None:
        """Let go of the link."""
        self._link.close()

    def _taken(self, count: int) -> bytes:
        first = bytes(self._kept[:count])
        del self._kept[:count]
        return first

    def _gather(self, deadline: Deadline) -> bool:
        """Keep what is there, waiting for a first byte; False if none came by the deadline."""
        came = self._link.receive(deadline)
        self._kept += came
        if len(self._kept) > KEPT_LIMIT_BYTES:
            self._kept.clear()
            raise ProtocolError(
                f"{self.address}: talks without end after {self._waiting!r}, more than "
                f"{KEPT_LIMIT_BYTES} bytes; is it the instrument?"
            )
        return bool(came)

    def _wait_for_more(self, deadline: Deadline, *, begun: bool) -> None:
        """Gather bytes of a reply; a peer that dribbles on does not stretch the deadline."""
        if not (begun and deadline.expired) and self._gather(deadline):
            return
        self._kept.clear()
        if begun:
            raise ProtocolError(
                f"{self.address}: the reply to {self._waiting!r} began and was cut short; "
                f"its end did not come within {deadline.span_s:g} s"
            )
        raise BenchTimeout(
            f"{self.address}: {self._waiting!r} got no answer within {deadline.span_s:g} s; "
            "is the instrument switched on and at this address?"
        )
