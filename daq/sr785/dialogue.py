"""The conversation with an SR785: each command waited for and checked, replies on our interface.

Owns what the instrument's language demands of every exchange: ``OUTX`` before the first question,
no command before the one before is done, the standard event word after each. It knows no setting.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from daq.driving.conversation import Conversation
from daq.driving.replies import parse_integer
from daq.errors import ConfigurationError, InstrumentError, LinkError, ProtocolError
from daq.sr785.status import ENABLED_EVENTS, Event, Summary
from daq.transports.address import SerialPort, parse_address
from daq.transports.base import Deadline, Transport, ask

__all__ = ["GPIB", "RS232", "Dialogue", "interface_of"]

GPIB, RS232 = 0, 1
"""Where replies go, as ``OUTX`` counts."""
_FIRST_PAUSE_S = 0.0005
_LONGEST_PAUSE_S = 0.05
_STALE_REPLIES = 400
_BITS = 10
"""Of a character on a serial line: start, eight of data, stop."""
_NAMES = {
    Event.OUTPUT_OVERFLOW: "its output buffer overflowed",
    Event.INPUT_OVERFLOW: "its input buffer overflowed",
    Event.EXECUTION_ERROR: "execution error",
    Event.COMMAND_ERROR: "command error",
}


def interface_of(transport: Transport) -> int:
    """The interface that a wire leads to; a replayed one counts as where it was recorded."""
    return GPIB if _serial_port(transport) is None else RS232


def _serial_port(transport: Transport) -> SerialPort | None:
    address = str(getattr(transport, "recorded_address", transport.address))
    try:
        found = parse_address(address)
    except ConfigurationError:
        return None
    return found if isinstance(found, SerialPort) else None


class Dialogue(Conversation):
    """Questions and commands to one SR785; see `Conversation` for the other parameters.

    Parameters
    ----------
    interface
        `GPIB` or `RS232`; found out from the transport if left out.
    """

    def __init__(
        self,
        transport: Transport,
        reply_s: float = 5.0,
        block_s: float = 10.0,
        interface: int | None = None,
    ) -> None:
        super().__init__(transport, reply_s, block_s)
        self.interface = interface_of(transport) if interface is None else interface
        port = _serial_port(transport)
        self.character_s = 0.0 if port is None else _BITS / port.baud
        """What one character takes on a serial line, s."""
        self.key_pressed = False
        """Whether somebody has touched the front panel since this was last set to False."""
        self._polls = True
        self._nonce = 0

    # Exchanges

    def ask(self, line: str, within_s: float | None = None) -> str:
        """Send a query and read its reply, after a look at whether anybody wants an end.

        A look at a running sweep is some forty exchanges: none of them waits for all.
        """
        self._look()
        return super().ask(line, within_s)

    def _look(self) -> None:
        if self.on_wait is not None:
            self.on_wait()

    def command(self, line: str, within_s: float | None = None) -> None:
        """Send a command, wait until it is done, and insist that it was.

        Raises
        ------
        InstrumentError
            If it was refused; names it.
        """
        self._look()
        self.send(line)
        self.finish(line, self.reply_s if within_s is None else within_s)

    def finish(self, line: str, within_s: float) -> None:
        """Wait until nothing is executing, and insist that no error was reported."""
        deadline, pause_s = Deadline.after(within_s), _FIRST_PAUSE_S
        while self._polls:
            status = self.poll()
            if status is None:
                self._polls = False
                break
            if status & Summary.INTERFACE_FREE:
                if status & Summary.STANDARD_EVENT:
                    break
                return
            if deadline.expired:
                raise self.failure(
                    ProtocolError(
                        f"{self.transport.address}: {line!r} was still executing after "
                        f"{within_s:g} s"
                    )
                )
            self.pause(pause_s)
            pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)
        self.check(line, within_s)

    def check(self, what: str, within_s: float | None = None) -> None:
        """Read the standard event word, which also waits for the commands before it.

        Raises
        ------
        InstrumentError
            If it tells of an error, or of a power failure.
        """
        events = Event(self.ask_integer("*ESR?", within_s) & ENABLED_EVENTS)
        if events & Event.KEY_PRESSED:
            self.key_pressed = True
        if events & Event.POWER_ON:
            self.trusted = False
            raise InstrumentError(
                f"{what}: the instrument was switched off and on in between; set it up anew"
            )
        if events & Event.errors():
            self.trusted = False
            raise InstrumentError(f"{what}: the instrument refuses it{told(events, ':')}")

    def events_wait(self) -> bool | None:
        """Whether an enabled event of a display waits; None where the wire has no serial poll."""
        status = self.poll() if self._polls else None
        if status is None:
            return None
        if status & Summary.STANDARD_EVENT:
            self.check("sweep")
        return bool(status & Summary.DISPLAY)

    def ask_floats(self, line: str, count: int) -> NDArray[np.float64]:
        """Send a query that is answered by so many 32-bit floats, little-endian, shape (count,).

        No serial poll may come between: the instrument is busy until all is read.
        """

        def exchange() -> bytes:
            deadline = Deadline.after(self.block_s)
            self.transport.write(line, deadline)
            return self.transport.read_bytes(4 * count, deadline)

        self._look()
        data = self.guarded(exchange, self.block_s)
        return np.frombuffer(data, dtype="<f4").astype(np.float64)

    # Recovery

    def recover(self) -> str:
        """Device clear, replies to our interface, both sides in step; the events, in words."""
        with self.lock:
            self.trusted = False
            cleared = self.transport.device_clear(self.soon())
            self.transport.write(f"OUTX {self.interface}", self.soon())
            if not cleared:
                self._get_in_step()
            return told(Event(parse_integer(ask(self.transport, "*ESR?", self.soon()))))

    def _get_in_step(self) -> None:
        """Find the reply that answers this question and not an older one.

        A number that was never used before is put into a register that matters to nobody, the
        enables of the input word, and asked for until it comes back.
        """
        self._nonce = self._nonce % 30000 + 17
        deadline = self.soon()
        self.transport.write(f"INPE {self._nonce}", deadline)
        self.transport.write("INPE?", deadline)
        for _ in range(_STALE_REPLIES):
            try:
                if parse_integer(self.transport.read(deadline)) == self._nonce:
                    break
            except ProtocolError:
                continue  # the rest of a trace, or another question's answer
        else:
            raise LinkError(
                f"{self.transport.address}: {_STALE_REPLIES} replies came and none was the one "
                "asked for; close the connection and open it again"
            )
        self.transport.write("INPE 0", deadline)


def told(events: Event, lead: str = ", its events were") -> str:
    """Errors in words; empty if there is none."""
    words = [name for bit, name in _NAMES.items() if events & bit]
    return f"{lead} {', '.join(words)}" if words else ""
