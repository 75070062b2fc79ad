"""The SR785's status words, their enables, the serial-poll byte and the service request.

Owns every status bit and how one leads to another. It does not know why a bit changes.
"""

from __future__ import annotations

from enum import IntFlag

__all__ = ["Display", "Error", "Event", "Input", "Instrument", "Status", "Summary"]


class Summary(IntFlag):
    """The status byte."""

    INST = 1
    DISP = 2
    INPT = 4
    IERR = 8
    MAV = 16
    ESB = 32
    SRQ = 64
    IFC = 128


class Event(IntFlag):
    """``*ESR?``."""

    OUTPUT_OVERFLOW = 4
    INPUT_OVERFLOW = 8
    EXECUTION = 16
    COMMAND = 32
    KEY = 64
    POWER_ON = 128


class Instrument(IntFlag):
    """``INST?``."""

    TRIGGERED = 1
    PAUSED = 32
    STARTED = 64


class Display(IntFlag):
    """``DSPS?``; those of display B are 8 bits higher."""

    NEW = 1
    AVERAGED = 2
    SETTLED = 4
    SWEPT = 16


class Input(IntFlag):
    """``INPS?``; those of channel 2 are 8 bits higher."""

    BELOW_HALF = 1
    ABOVE_HALF = 2
    OVERLOAD = 4
    FORCED_DOWN = 8
    RANGED = 16


class Error(IntFlag):
    """``ERRS?``."""

    OUTPUT = 1
    MATH = 4


WORDS = ("INST", "DSPS", "INPS", "ERRS", "*ESR")
ENABLES = {"INSE": "INST", "DSPE": "DSPS", "INPE": "INPS", "ERRE": "ERRS", "*ESE": "*ESR"}
_SUMMARY = {
    "INST": Summary.INST,
    "DSPS": Summary.DISP,
    "INPS": Summary.INPT,
    "ERRS": Summary.IERR,
    "*ESR": Summary.ESB,
}


class Status:
    """All words of one instrument."""

    def __init__(self) -> None:
        self.words: dict[str, int] = dict.fromkeys(WORDS, 0)
        self.enables: dict[str, int] = dict.fromkeys(WORDS, 0)
        self.request_enable = 0
        self.keeps_enables = False
        """What ``*PSC 0`` asks for."""
        self.message_available = False
        self.busy = False
        self.requesting = False
        self._reasons = 0

    def put(self, word: str, bits: int) -> None:
        """Set bits of a word."""
        self.words[word] |= bits
        self.update()

    def take(self, word: str, bit: int | None) -> int:
        """Read a word, or one bit of it, and clear what was read."""
        value = self.words[word]
        if bit is not None:
            self.words[word] = value & ~(1 << bit)
            value = value >> bit & 1
        else:
            self.words[word] = 0
        self.update()
        return value

    def clear(self) -> None:
        """``*CLS``."""
        self.words = dict.fromkeys(WORDS, 0)
        self.update()

    def power_on(self) -> None:
        """Come up after a power cycle."""
        self.words = dict.fromkeys(WORDS, 0)
        if not self.keeps_enables:
            self.enables = dict.fromkeys(WORDS, 0)
            self.request_enable = 0
        self.requesting, self._reasons = False, 0
        self.put("*ESR", Event.POWER_ON)

    @property
    def bits(self) -> int:
        """The status byte without request and IFC."""
        found = sum(int(_SUMMARY[word]) for word in WORDS if self.words[word] & self.enables[word])
        return found | (int(Summary.MAV) if self.message_available else 0)

    def status_byte(self) -> int:
        """``*STB?``: IFC is never set, as this is a command in execution itself."""
        bits = self.bits
        return bits | (int(Summary.SRQ) if bits & self.request_enable else 0)

    def serial_poll(self) -> int:
        """The byte of a serial poll; takes the request back."""
        value = self.bits | (int(Summary.SRQ) if self.requesting else 0)
        self.requesting = False
        return value | (0 if self.busy else int(Summary.IFC))

    def update(self) -> None:
        """Raise the request on a new reason; let it fall when no reason is left."""
        bits = self.bits | (0 if self.busy else int(Summary.IFC))
        reasons = bits & self.request_enable
        if reasons & ~self._reasons:
            self.requesting = True
        if not reasons:
            self.requesting = False
        self._reasons = reasons
