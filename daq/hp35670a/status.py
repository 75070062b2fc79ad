"""The status bits of the HP 35670A, and waiting on them until an operation is over.

Owns the meaning of the bits (programming guide, chapter 1) and the one wait:
``*OPC`` with a serial poll or ``*ESR?``, never a blocking ``*OPC?`` or
``*WAI``. What is waited for, and how long, is the driver's matter. The number
of questions asked does not depend on any clock, so that a recorded wait can
be replayed.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntFlag

from daq.driving.scpi_connection import Dialogue
from daq.errors import BenchTimeout, InstrumentError, MeasurementError
from daq.transports.base import Deadline

__all__ = [
    "DeviceState",
    "Operation",
    "Questionable",
    "StandardEvent",
    "Voltage",
    "arm_events",
    "polled",
    "wait_until_done",
]


class StandardEvent(IntFlag):
    """``*ESR?``; reading clears."""

    OPERATION_COMPLETE = 1
    QUERY_ERROR = 4
    DEVICE_ERROR = 8
    EXECUTION_ERROR = 16
    COMMAND_ERROR = 32
    POWER_ON = 128

    @classmethod
    def errors(cls) -> StandardEvent:
        """All bits that announce an entry in the error queue."""
        return cls.QUERY_ERROR | cls.DEVICE_ERROR | cls.EXECUTION_ERROR | cls.COMMAND_ERROR


class Operation(IntFlag):
    """``STAT:OPER:COND?``; there is no bit for a sweep as such."""

    CALIBRATING = 1
    SETTLING = 2
    RANGING = 4
    MEASURING = 16
    AVERAGING = 256

    @classmethod
    def busy(cls) -> Operation:
        """All bits of which a running measurement holds at least one."""
        return cls.CALIBRATING | cls.SETTLING | cls.RANGING | cls.MEASURING | cls.AVERAGING


class Questionable(IntFlag):
    """``STAT:QUES:COND?``."""

    CALIBRATION_FAILED = 256


class Voltage(IntFlag):
    """``STAT:QUES:VOLT?`` and its condition."""

    OVERLOAD_1 = 1
    OVERLOAD_2 = 2
    ABOVE_HALF_1 = 256
    ABOVE_HALF_2 = 512


class DeviceState(IntFlag):
    """``STAT:DEV?``; both are events only."""

    KEY_PRESSED = 16
    DISPLAY_READY = 32


_EVENT_ENABLE = StandardEvent.errors() | StandardEvent.OPERATION_COMPLETE
_STATUS_EVENT = 32
"""Status byte: a Standard Event is waiting."""

_FIRST_PAUSE_S = 0.0005
_PAUSE_GROWTH = 1.5
_WITNESS_EVERY = 12
"""Polls between two looks at a second witness."""

_IDLE_WITNESSES = 3
"""Looks in a row that must find nothing running before the end is taken to have been missed."""


def arm_events(dialogue: Dialogue) -> None:
    """Clear all events, and let the end of an operation and any error show in the status byte.

    Enables survive a reset and filters a preset, so all are set explicitly.
    """
    dialogue.send("*CLS")
    dialogue.send("STAT:PRES")
    dialogue.send(f"*ESE {int(_EVENT_ENABLE)}")
    dialogue.send(f"*SRE {_STATUS_EVENT}")
    dialogue.check("status registers")


def wait_until_done(dialogue: Dialogue, what: str, deadline: Deadline) -> None:
    """Wait for a set-up operation that a ``*OPC`` was sent after; raises as `polled` does.

    Such an operation (reset, calibration, a change of traces) may keep the
    parser from answering, so each answer may take as long as the whole wait.
    """
    pause_s, polls = _FIRST_PAUSE_S, 0
    while not _event_came(dialogue, what, polls, deadline.remaining_s):
        polls += 1
        if deadline.expired:
            raise dialogue.failure(_not_ended(what, deadline))
        dialogue.pause(pause_s)
        pause_s = min(pause_s * _PAUSE_GROWTH, 0.1)


def polled(
    dialogue: Dialogue, what: str, deadline: Deadline, longest_pause_s: float
) -> Iterator[int]:
    """Wait for a measurement that a ``*OPC`` was sent after, yielding after each fruitless poll.

    Parameters
    ----------
    what
        The measurement, for messages.
    longest_pause_s
        Pauses between polls grow up to this.

    Yields
    ------
    int
        How many polls there were.

    Raises
    ------
    InstrumentError
        If the instrument reports an error, or was switched off and on.
    MeasurementError
        If nothing is running and the end was not reported.
    BenchTimeout
        If it did not end in time.
    """
    pause_s, polls, idle = _FIRST_PAUSE_S, 0, 0
    while not _event_came(dialogue, what, polls, dialogue.reply_s):
        polls += 1
        if polls % _WITNESS_EVERY == 0:
            running = dialogue.ask_integer("STAT:OPER:COND?") & int(Operation.busy())
            idle = 0 if running else idle + 1
            if idle >= _IDLE_WITNESSES:
                if _finished(_events(dialogue, what, dialogue.reply_s)):
                    return
                raise MeasurementError(
                    f"{what}: nothing is running and its end was not reported; it was aborted, "
                    "or *OPC was cancelled, by another program or at the front panel"
                )
        if deadline.expired:
            raise dialogue.failure(_not_ended(what, deadline))
        yield polls
        dialogue.pause(min(pause_s, longest_pause_s))
        pause_s = min(pause_s * _PAUSE_GROWTH, longest_pause_s)


def _not_ended(what: str, deadline: Deadline) -> BenchTimeout:
    return BenchTimeout(f"{what}: *OPC did not report the end within {deadline.span_s:.3g} s")


def _event_came(dialogue: Dialogue, what: str, polls: int, reply_s: float) -> bool:
    status = dialogue.poll()
    # After a power failure the enables are gone and the status byte shows nothing, so the
    # events themselves are looked at now and then.
    if status is not None and not status & _STATUS_EVENT and (polls + 1) % _WITNESS_EVERY:
        return False
    return _finished(_events(dialogue, what, max(reply_s, dialogue.reply_s)))


def _events(dialogue: Dialogue, what: str, reply_s: float) -> StandardEvent:
    events = StandardEvent(dialogue.ask_integer("*ESR?", reply_s))
    if events & StandardEvent.POWER_ON:
        dialogue.trusted = False
        raise InstrumentError(
            f"{what}: the instrument was switched off and on in between; set it up anew"
        )
    if events & StandardEvent.errors():
        dialogue.check(what)
    return events


def _finished(events: StandardEvent) -> bool:
    return bool(events & StandardEvent.OPERATION_COMPLETE)
