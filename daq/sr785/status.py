"""The status words of the SR785 (manual, chapter on remote programming).

Owns the meaning of the bits. It asks nothing.
"""

from __future__ import annotations

from enum import IntFlag

__all__ = ["ENABLED_EVENTS", "SWEPT", "Event", "Input", "Instrument", "Summary"]


class Summary(IntFlag):
    """The byte of a serial poll."""

    DISPLAY = 2
    STANDARD_EVENT = 32
    INTERFACE_FREE = 128
    """No command is executing."""


class Event(IntFlag):
    """``*ESR?``; reading clears."""

    OUTPUT_OVERFLOW = 4
    INPUT_OVERFLOW = 8
    EXECUTION_ERROR = 16
    COMMAND_ERROR = 32
    KEY_PRESSED = 64
    POWER_ON = 128

    @classmethod
    def errors(cls) -> Event:
        """All bits that say that something was not done as asked."""
        return cls.OUTPUT_OVERFLOW | cls.INPUT_OVERFLOW | cls.EXECUTION_ERROR | cls.COMMAND_ERROR


ENABLED_EVENTS = 0xFC
"""All of `Event`, for ``*ESE``."""


class Instrument(IntFlag):
    """``INST?``; reading clears."""

    PAUSED = 32
    STARTED = 64


class Input(IntFlag):
    """``INPS?`` of channel 1; those of channel 2 are 8 bits higher. Reading clears."""

    ABOVE_HALF = 2
    OVERLOAD = 4
    FORCED_DOWN = 8
    RANGED = 16


SWEPT = 1 << 4 | 1 << 12
"""``DSPS?``: the swept sines of displays A and B have finished."""
