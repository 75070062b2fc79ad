"""A conversation with a SCPI instrument: bounded questions, a drained error queue, recovery.

Owns the rules that hold for every exchange: each has a deadline, a time-out
or a damaged reply is followed at once by device clear, resynchronisation and
a drained queue, and no block of commands ends with errors left unread. It
knows IEEE 488.2 and SCPI, but no particular instrument.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from daq.errors import BenchTimeout, InstrumentError, LashbenchError, LinkError, ProtocolError
from daq.scpi import (
    QueueEntry,
    decode_reals,
    parse_error,
    parse_integer,
    parse_number,
    parse_string,
)
from daq.scpi_settings import Setting
from daq.transports.base import Deadline, Transport, ask, ask_block

__all__ = ["Dialogue"]

_QUEUE_READS = 12
"""Reads of the error queue before it is taken to be endless; the queue holds 5."""

_RECOVERY_S = 2.0
"""Bound of each step of a recovery: what follows it may be making the source safe."""
_RECOVERY_IN_ALL_S = 20.0
"""Announced for all its steps."""

_LOOK_S = 0.1
"""Longest pause without a look at whether anybody wants it to end."""

_STALE_REPLIES = 400
"""Replies dropped while looking for the one that proves both sides in step; the rest of a cut
block may hold many line feeds."""

_Result = TypeVar("_Result")


class Dialogue:
    """Questions and commands over one transport, one at a time.

    Parameters
    ----------
    transport
        The wire.
    reply_s
        Bound of one ordinary reply, s.
    block_s
        Bound of one block of data, s; a slow serial adapter needs some.

    Notes
    -----
    After any `BenchTimeout` or `ProtocolError` the attribute `trusted` is
    False: the state of the instrument is unknown until it is set up anew.
    """

    def __init__(self, transport: Transport, reply_s: float = 5.0, block_s: float = 10.0) -> None:
        self.transport = transport
        self.reply_s = reply_s
        self.block_s = block_s
        self.trusted = False
        self.on_wait: Callable[[], None] | None = None
        """Called between the polls of a wait; may raise to end it."""
        self.on_exchange: Callable[[float], None] | None = None
        """Told before each exchange how long it may take at most, s; must not raise."""
        self.lock = threading.RLock()
        """Held for each exchange; whoever needs several in a row may hold it longer."""
        self._nonce = 0

    # Exchanges

    def send(self, line: str) -> None:
        """Send a command that is not answered."""
        self._guarded(
            lambda: self.transport.write(line, Deadline.after(self.reply_s)), self.reply_s
        )

    def ask(self, line: str, within_s: float | None = None) -> str:
        """Send a query and read its reply."""
        bound_s = self.reply_s if within_s is None else within_s
        deadline = Deadline.after(bound_s)
        return self._guarded(lambda: ask(self.transport, line, deadline), bound_s)

    def ask_integer(self, line: str, within_s: float | None = None) -> int:
        """Send a query that is answered by an integer."""
        return self._parsed(line, parse_integer, within_s)

    def ask_number(self, line: str) -> float:
        """Send a query that is answered by a number."""
        return self._parsed(line, parse_number, None)

    def ask_reals(self, line: str) -> NDArray[np.float64]:
        """Send a query that is answered by a block of big-endian doubles, shape (n,)."""
        deadline = Deadline.after(self.block_s)
        return self._guarded(
            lambda: decode_reals(ask_block(self.transport, line, deadline)), self.block_s
        )

    def poll(self) -> int | None:
        """Serial poll; None where the wire has none."""
        return self._guarded(
            lambda: self.transport.serial_poll(Deadline.after(self.reply_s)), self.reply_s
        )

    def pause(self, seconds: float) -> None:
        """Let time pass, with a look at `on_wait` at least every `_LOOK_S`."""
        left_s = seconds
        while True:
            if self.on_wait is not None:
                self.on_wait()
            if left_s <= 0:
                return
            self.transport.pause(min(left_s, _LOOK_S))
            left_s -= _LOOK_S

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
            entry = self._parsed("SYST:ERR?", parse_error, None)
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

    def recover(self) -> list[QueueEntry]:
        """Device clear, get both sides in step, drain the queue; the state is unknown then.

        Raises
        ------
        LashbenchError
            If the instrument does not come back.
        """
        with self.lock:
            self.clear()
            return self._drain_plainly()

    def clear(self) -> None:
        """Device clear, and get both sides in step where the wire has none."""
        self.trusted = False
        with self.lock:
            if not self.transport.device_clear(self._soon()):
                self._get_in_step()

    def _get_in_step(self) -> None:
        """Find the reply that answers this question and not an older one.

        On a wire without device clear a late reply may still come. A number
        that was never used before is stored in a register that matters to
        nobody (the user status enable) and asked for until it comes back.
        """
        self._nonce = self._nonce % 32000 + 17
        deadline = self._soon()
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

    def _soon(self) -> Deadline:
        return Deadline.after(min(self.reply_s, _RECOVERY_S))

    def _drain_plainly(self) -> list[QueueEntry]:
        entries: list[QueueEntry] = []
        for _ in range(_QUEUE_READS):
            entry = parse_error(ask(self.transport, "SYST:ERR?", self._soon()))
            if entry.number == 0:
                break
            entries.append(entry)
        return entries

    def _guarded(self, exchange: Callable[[], _Result], bound_s: float) -> _Result:
        if self.on_exchange is not None:
            self.on_exchange(bound_s)
        with self.lock:
            try:
                return exchange()
            except (BenchTimeout, ProtocolError) as error:
                raise self.failure(error) from error
            except LinkError:
                self.trusted = False
                raise

    def _parsed(
        self, line: str, parse: Callable[[str], _Result], within_s: float | None
    ) -> _Result:
        text = self.ask(line, within_s)
        try:
            return parse(text)
        except ProtocolError as error:
            complete = ProtocolError(f"{self.transport.address}: {line!r}: {error}")
            raise self.failure(complete) from error

    def failure(self, error: BenchTimeout | ProtocolError) -> LashbenchError:
        """Recover from a time-out or a damaged reply; the error to raise, with what was found."""
        if self.on_exchange is not None:
            self.on_exchange(_RECOVERY_IN_ALL_S)
        try:
            queue = self.recover()
        except LashbenchError as failure:
            return type(error)(f"{error}; no recovery: {failure}; its state is unknown")
        return type(error)(f"{error}; after a device clear{_told(queue)}; its state is unknown")


def _told(entries: Iterable[QueueEntry], lead: str = ", its queue held") -> str:
    listed = ", ".join(str(entry) for entry in entries)
    return f"{lead} {listed}" if listed else ""
