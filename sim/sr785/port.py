"""One interface of the SR785: its input buffer, its output buffer, and what happens beyond them.

Owns bytes and line ends. It executes nothing.
"""

from __future__ import annotations

from collections import deque

__all__ = ["BUFFER_BYTES", "Port"]

BUFFER_BYTES = 256


class Port:
    """GPIB or RS-232.

    Parameters
    ----------
    ends
        Characters that end a line sent to it.
    reply_end
        What ends each reply.
    """

    def __init__(self, ends: bytes, reply_end: bytes) -> None:
        self._ends, self._reply_end = ends, reply_end
        self._line = bytearray()
        self.commands: deque[bytes] = deque()
        self.replies: deque[bytearray] = deque()
        self.transfer: bytearray | None = None
        """A trace on its way out, which no buffer holds."""

    def take(self, data: bytes, end: bool) -> bool:
        """Take bytes; whether the buffer has overflowed, by which both are empty."""
        for index, byte in enumerate(data):
            if byte in self._ends:
                self._end_line()
            else:
                self._line.append(byte)
            if end and index == len(data) - 1:
                self._end_line()
            if len(self._line) + sum(map(len, self.commands)) > BUFFER_BYTES:
                self.clear()
                return True
        return False

    def _end_line(self) -> None:
        # An empty command between two semicolons is none.
        self.commands.extend(part for part in bytes(self._line).split(b";") if part.strip())
        self._line.clear()

    def put(self, reply: str) -> bool:
        """Queue a reply; whether the buffer has overflowed, by which both are empty."""
        self.replies.append(bytearray(reply.encode("latin-1") + self._reply_end))
        if sum(map(len, self.replies)) > BUFFER_BYTES:
            self.clear()
            return True
        return False

    def put_text_transfer(self, text: str) -> None:
        """Begin to send a trace in ASCII."""
        self.transfer = bytearray(text.encode("ascii") + self._reply_end)

    @property
    def has_output(self) -> bool:
        """Whether anything could be read."""
        return bool(self.replies) or self.transfer is not None

    def read(self, limit: int | None) -> tuple[bytes, bool]:
        """Up to so many bytes of the oldest reply, and whether it ends with them."""
        source = self.replies[0] if self.replies else self.transfer
        if source is None:
            return b"", False
        data = bytes(source[:limit])
        del source[: len(data)]
        if source:
            return data, False
        if self.replies:
            self.replies.popleft()
        else:
            self.transfer = None
        return data, True

    def clear(self) -> None:
        """Empty both buffers, and give up a transfer."""
        self._line.clear()
        self.commands.clear()
        self.replies.clear()
        self.transfer = None
