"""A conversation with a SCPI instrument: bounded questions, a drained error queue, recovery.

Owns what a time-out or a damaged reply is followed by, device clear,
resynchronisation and a drained queue, and that no block of commands ends with
errors left unread. It knows IEEE 488.2 and SCPI, but no particular instrument.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.driving.conversation import Conversation
from daq.driving.replies import QueueEntry, decode_reals, parse_error, parse_integer, parse_string
from daq.driving.settings import Setting
from daq.errors import InstrumentError, ProtocolError
from daq.transports.base import Deadline, Transport, ask, ask_block

__all__ = ["Dialogue"]

_QUEUE_READS = 12
"""Reads of the error queue before it is taken to be endless; the queue holds 5."""

_STALE_REPLIES = 400
"""Replies dropped while looking for the one that proves both sides in step; the rest of a cut
block may hold many line feeds."""


class Dialogue(Conversation):
    """SCPI over one transport; see `Conversation` for the parameters."""

    def __init__(self, transport: Transport, reply_s: float = 5.0, block_s: float = 10.0) -> None:
        super().__init__(transport, reply_s, block_s)
        self._nonce = 0

    # Exchanges

    def ask_reals(self, line: str) -> NDArray[np.float64]:
        """Send a query that is answered by a block of big-endian doubles, shape (n,)."""
        deadline = Deadline.after(self.block_s)
        return self.guarded(
            lambda: decode_reals(ask_block(self.transport, line, deadline)), self.block_s
        )

    # Settings

    def apply(self, setting: Setting, value: Any) -> str:
        """Set, read back and compare.

        Returns
        -------
        str
            The read-back with its unit, which may differ from what was asked
            by the instrument's rounding.

        Raises
        ------
        LimitError
            If the value is out of range; nothing was sent.
        InstrumentError
            If the instrument reads back something else.
        """
        self.send(setting.command(value))
        return self.confirm(setting, value)

    def confirm(self, setting: Setting, value: Any) -> str:
        """Read a setting back and compare; see `apply`."""
        reply, unit = self.read_back(setting)
        try:
            fits, shown = setting.accepts(value, reply, unit), setting.shown(reply, unit)
        except ProtocolError as error:
            raise self.failure(error) from error
        if fits:
            return shown
        queue = self.drain()
        raise InstrumentError(
            f"{setting.name} was set to {value!r} and reads back {shown}"
            f"{_told(queue)}; the set-up is not what was asked for"
        )

    def read_back(self, setting: Setting) -> tuple[str, str | None]:
        """The reply to a setting's query, and its unit where that is in doubt."""
        reply = self.ask(f"{setting.header}?")
        unit = parse_string(self.ask(f"{setting.header}? UNIT")) if setting.asks_unit else None
        return reply, unit

    # The error queue

    def drain(self) -> list[QueueEntry]:
        """Read the error queue until it is empty; the entries, oldest first.

        Raises
        ------
        InstrumentError
            If it does not end.
        """
        entries: list[QueueEntry] = []
        for _ in range(_QUEUE_READS):
            entry = self.parsed("SYST:ERR?", parse_error)
            if entry.number == 0:
                return entries
            entries.append(entry)
        raise InstrumentError(
            f"the error queue does not end: {_QUEUE_READS} reads, the last gave {entries[-1]}"
        )

    def check(self, block: str, harmless: Callable[[QueueEntry], bool] | None = None) -> None:
        """Drain the queue at the end of a block of commands.

        Raises
        ------
        InstrumentError
            If it held anything but entries that are `harmless` here; names the block.
        """
        entries = [entry for entry in self.drain() if harmless is None or not harmless(entry)]
        if entries:
            raise InstrumentError(f"{block}: the instrument reports{_told(entries, ':')}")

    # Recovery

    def recover(self) -> str:
        """Device clear, get both sides in step, drain the queue, which is told.

        Raises
        ------
        LashbenchError
            If the instrument does not come back.
        """
        with self.lock:
            self.clear()
            return _told(self._drain_plainly())

    def clear(self) -> None:
        """Device clear, and get both sides in step where the wire has none."""
        self.trusted = False
        with self.lock:
            if not self.transport.device_clear(self.soon()):
                self._get_in_step()

    def _get_in_step(self) -> None:
        """Find the reply that answers this question and not an older one.

        On a wire without device clear a late reply may still come. A number
        that was never used before is stored in a register that matters to
        nobody (the user status enable) and asked for until it comes back.
        """
        self._nonce = self._nonce % 32000 + 17
        deadline = self.soon()
        self.transport.write(f"STAT:USER:ENAB {self._nonce}", deadline)
        self.transport.write("STAT:USER:ENAB?", deadline)
        for _ in range(_STALE_REPLIES):
            try:
                if parse_integer(self.transport.read(deadline)) == self._nonce:
                    break
            except ProtocolError:
                continue  # the rest of a reply that was cut, or another question's answer
        else:
            raise ProtocolError(
                f"{self.transport.address}: {_STALE_REPLIES} replies came and none was the one "
                "asked for; close the connection and open it again"
            )
        self.transport.write("STAT:USER:ENAB 0", deadline)

    def _drain_plainly(self) -> list[QueueEntry]:
        entries: list[QueueEntry] = []
        for _ in range(_QUEUE_READS):
            entry = parse_error(ask(self.transport, "SYST:ERR?", self.soon()))
            if entry.number == 0:
                break
            entries.append(entry)
        return entries


def _told(entries: Iterable[QueueEntry], lead: str = ", its queue held") -> str:
    listed = ", ".join(str(entry) for entry in entries)
    return f"{lead} {listed}" if listed else ""
