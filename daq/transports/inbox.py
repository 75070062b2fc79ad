"""What came over a link and was not taken yet, for wires whose messages have no ends of their own.

Owns the bytes between the link and whoever reads them, and how many are kept of a
peer that talks without end. It knows neither SCPI nor an adapter's own commands.
"""

from __future__ import annotations

from daq.errors import ProtocolError
from daq.transports.base import KEPT_LIMIT_BYTES, Deadline
from daq.transports.links import Link

__all__ = ["Inbox"]


class Inbox:
    """Bytes of a link; `peer` is what should be at its other end, for messages."""

    def __init__(self, link: Link, peer: str) -> None:
        self._link, self._peer = link, peer
        self._kept = bytearray()

    def __len__(self) -> int:
        return len(self._kept)

    def gather(self, deadline: Deadline) -> bool:
        """Wait for bytes and keep them; False if none came by the deadline.

        Raises
        ------
        ProtocolError
            If more came, and was not taken, than any reply has.
        """
        came = self._link.receive(deadline)
        self._kept += came
        if len(self._kept) > KEPT_LIMIT_BYTES:
            self._kept.clear()
            raise ProtocolError(
                f"{self._link.name}: talks without end, more than {KEPT_LIMIT_BYTES} bytes came; "
                f"is it {self._peer}?"
            )
        return bool(came)

    def taken(self, count: int) -> bytes | None:
        """`count` of the bytes kept, None if there are not so many yet."""
        if len(self._kept) < count:
            return None
        first = bytes(self._kept[:count])
        del self._kept[:count]
        return first

    def taken_line(self, end: bytes = b"\n") -> bytes | None:
        """The bytes kept up to the first line end, without it; None if there is none yet."""
        line = self.taken(self._kept.find(end) + 1)
        return line[:-1] if line else None

    def emptied(self) -> bytes:
        """Everything that has come so far, without waiting for more."""
        while self.gather(Deadline.after(0.0)):
            pass
        lying = bytes(self._kept)
        self._kept.clear()
        return lying

    def clear(self) -> None:
        """Forget what is kept."""
        self._kept.clear()
