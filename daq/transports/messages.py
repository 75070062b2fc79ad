"""Reading where every reply is one message with an end of its own: HiSLIP, VISA, the loop-back.

Owns how such a message is read as text, as a block or as bytes. How one comes is the wire's.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from daq.errors import ProtocolError
from daq.transports.base import Deadline, block_of

__all__ = ["MessageReader"]


class MessageReader(ABC):
    """The reading part of the `Transport` protocol over whole messages.

    `address` of the wire, and the line or act `_waiting` for a reply, are for errors.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self._waiting = "nothing"

    @abstractmethod
    def _message(self, deadline: Deadline) -> bytes:
        """The whole of the next message, its line feed included."""

    def read(self, deadline: Deadline) -> str:
        """One text reply, without terminator."""
        message = self._message(deadline)
        try:
            return message.decode("ascii").strip()
        except UnicodeDecodeError as error:
            raise ProtocolError(
                f"{self.address}: the reply to {self._waiting!r} is not text: {message[:60]!r}"
            ) from error

    def read_block(self, deadline: Deadline) -> bytes:
        """The payload of one definite-length block."""
        message = self._message(deadline)
        return block_of(message, f"{self.address}: the block that answers {self._waiting!r}")

    def read_bytes(self, count: int, deadline: Deadline) -> bytes:
        """A reply of so many bytes, which is a whole message."""
        message = self._message(deadline)
        if len(message) != count:
            raise ProtocolError(
                f"{self.address}: the reply to {self._waiting!r} has {len(message)} bytes, "
                f"{count} were due"
            )
        return message
