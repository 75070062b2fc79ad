"""A simulated instrument's RS-232 interface: bytes both ways, at the speed of the line.

Owns the pace of the line and no more. An instrument that has such an interface satisfies
`SerialInstrument`.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from sim.instrument.bus import Instrument

__all__ = ["SerialInstrument", "SerialLine"]

_BITS = 10
"""Of a byte on the line: start, eight of data, stop."""
_BURST_S = 0.02
"""Time's worth of bytes that may come at once after the line was quiet."""


@runtime_checkable
class SerialInstrument(Instrument, Protocol):
    """An instrument with RS-232 beside its bus."""

    def serial_in(self, data: bytes) -> None:
        """Bytes that came."""
        ...

    def serial_out(self) -> bytes:
        """Everything that it has to say."""
        ...


class SerialLine:
    """The cable between a terminal and the instrument.

    Parameters
    ----------
    baud
        Speed of the line, 0 for as fast as can be.
    """

    name = "rs232"

    def __init__(self, instrument: SerialInstrument, baud: int = 9600) -> None:
        self._instrument = instrument
        self._rate = baud / _BITS
        self._output = bytearray()
        self._sent_at_s = 0.0

    def opened(self, now_s: float) -> None:
        """Nothing happens when somebody opens the port."""

    def receive(self, data: bytes, now_s: float) -> None:
        """Bytes from the host."""
        self._instrument.serial_in(data)

    def take_output(self, now_s: float) -> bytes:
        """Bytes for the host, as many as the line has carried by now."""
        self._output += self._instrument.serial_out()
        count = len(self._output)
        if self._rate:
            count = min(count, int(min(now_s - self._sent_at_s, _BURST_S) * self._rate))
            if not count:
                return b""
            self._sent_at_s = now_s
        data = bytes(self._output[:count])
        del self._output[:count]
        return data

    @property
    def busy(self) -> bool:
        """Whether bytes wait for their turn."""
        return bool(self._output) or self._instrument.reply_due

    def pump(self, now_s: float) -> None:
        """Nothing is done here but what the instrument does."""
