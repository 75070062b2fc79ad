"""A GPIB instrument behind a Prologix-like adapter: messages, late replies, polls, clears.

Owns the exchange with the instrument through an `Adapter`: escaping, asking
again for a reply that is late, counting a block's bytes, and telling an
adapter that is silent from an instrument that is.
"""

from __future__ import annotations

import time

from daq.errors import BenchTimeout, LinkError, ProtocolError
from daq.transports.base import LINE_LIMIT_BYTES, Deadline, checked_line, take_block
from daq.transports.prologix_adapter import MARGIN_S, READ_TIMEOUT_MS, Adapter, escape

__all__ = ["PrologixTransport"]

_ONE_READ_S = READ_TIMEOUT_MS / 1000 + MARGIN_S
_FRUITLESS_READS = 3
"""Reads in a row that bring nothing after which a reply that has begun is taken to be cut."""

_ADAPTER_S = 1.0
"""Bound of a question to the adapter itself."""


class PrologixTransport:
    """Messages to one instrument through a Prologix, AR488 or alike; see `Transport`.

    Parameters
    ----------
    adapter
        Set up for the instrument's address; closed with the transport.
    address
        URL, for messages.
    """

    def __init__(self, adapter: Adapter, address: str) -> None:
        self.address = address
        self._adapter = adapter
        self._waiting = "nothing"
        self._in_step = True
        self._fruitless = 0

    def write(self, line: str, deadline: Deadline) -> None:
        """Send one message; raises `ProtocolError` if bytes lie there that nobody asked for."""
        data = escape(checked_line(line))
        if len(data) > LINE_LIMIT_BYTES:
            raise ProtocolError(
                f"message {line!r} has {len(data)} bytes once escaped, the limit is "
                f"{LINE_LIMIT_BYTES}; nothing was sent, split it"
            )
        if not self._in_step and not self._get_in_step(deadline.within(_ADAPTER_S)) and "?" in line:
            # A command may still do good once the adapter comes back; the answer to a question
            # could not be told from an older one.
            raise self._adapter_silent()
        lying = self._adapter.lying()
        if lying:
            raise ProtocolError(
                f"{self.address}: {lying[:60]!r} came unasked for, after {self._waiting!r} and "
                f"before {line!r}; nothing was sent"
            )
        self._waiting = line
        self._adapter.send(data, deadline)

    def read(self, deadline: Deadline) -> str:
        """One text reply, without terminator."""
        adapter = self._adapter
        self._fruitless = 0
        adapter.send(b"++read eoi", deadline)
        while (line := adapter.taken_reply()) is None:
            self._wait_for_more(deadline)
        try:
            return line.replace(b"\0", b"").decode("ascii").strip()
        except UnicodeDecodeError as error:
            raise ProtocolError(
                f"{self.address}: the reply to {self._waiting!r} is not text: {line[:60]!r}"
            ) from error

    def read_block(self, deadline: Deadline) -> bytes:
        """The payload of one definite-length block."""
        adapter = self._adapter
        self._fruitless = 0
        adapter.send(b"++read eoi", deadline)
        before = 0

        def take(count: int) -> bytes:
            nonlocal before
            while (part := adapter.inbox.taken(count)) is None:
                self._wait_for_more(deadline, before)
            before += count
            return part

        return take_block(take)

    def read_bytes(self, count: int, deadline: Deadline) -> bytes:
        """A reply of so many bytes; they are counted, as any of them may look like an end."""
        adapter = self._adapter
        self._fruitless = 0
        adapter.send(b"++read eoi", deadline)
        while (data := adapter.inbox.taken(count)) is None:
            self._wait_for_more(deadline)
        return data

    def _wait_for_more(self, deadline: Deadline, before: int = 0) -> None:
        """Gather bytes of a reply; where the adapter gave up on it, ask for it again.

        An adapter gives up in silence when a byte is late, and what is left of
        the reply stays in the instrument. `before` bytes of it were used up.
        """
        came_before = before + len(self._adapter.inbox)
        if deadline.expired or (came_before and self._fruitless >= _FRUITLESS_READS):
            raise self._silence(came_before, deadline)
        if self._adapter.inbox.gather(Deadline.after(_ONE_READ_S)):
            self._fruitless = 0
        elif not deadline.expired:
            self._fruitless += 1
            self._adapter.send(b"++read eoi", deadline)

    def serial_poll(self, deadline: Deadline) -> int:
        """The status byte; an adapter that answers nothing is a `BenchTimeout` of its own kind."""
        patience = Deadline.after(max(deadline.remaining_s, _ONE_READ_S))
        answer = self._adapter.ask("++spoll", patience)
        if answer is None:
            self._waiting = "serial poll"
            raise self._silence(0, patience)
        if not answer.isdigit() or int(answer) > 255:
            raise ProtocolError(
                f"{self.address}: the adapter answers a serial poll with {answer!r}; "
                "a number from 0 to 255 was due"
            )
        return int(answer)

    def device_clear(self, deadline: Deadline) -> bool:
        """Clear the instrument, drop what lies unread, and set the adapter up if it forgot."""
        self._adapter.send(b"++clr", deadline)
        if not self._get_in_step(deadline):
            raise self._adapter_silent()
        if self._adapter.has_forgotten(deadline):
            self._adapter.set_up(deadline)
            self._adapter.send(b"++clr", deadline)
            self._get_in_step(deadline)
        return True

    def pause(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(seconds)

    def close(self) -> None:
        """Let go of the adapter."""
        self._adapter.close()

    def _get_in_step(self, deadline: Deadline) -> bool:
        self._in_step = self._adapter.resynchronise(deadline)
        return self._in_step

    def _adapter_silent(self) -> LinkError:
        return LinkError(
            f"{self.address}: the adapter is silent since {self._waiting!r}; is it plugged in and "
            "powered, and is the instrument switched on?"
        )

    def _silence(self, came: int, deadline: Deadline) -> Exception:
        """What a reply that did not come, or not whole, means; asks the adapter to find out."""
        if not self._get_in_step(Deadline.after(_ADAPTER_S)):
            return self._adapter_silent()
        forgot = self._adapter.has_forgotten(Deadline.after(_ADAPTER_S))
        hint = "; the adapter was reset and lost its settings" if forgot else ""
        if came:
            return ProtocolError(
                f"{self.address}: the reply to {self._waiting!r} was cut short, {came} bytes "
                f"came{hint}"
            )
        return BenchTimeout(
            f"{self.address}: the instrument is silent, {self._waiting!r} got no answer within "
            f"{deadline.span_s:g} s{hint}; is it switched on and at this GPIB address?"
        )
