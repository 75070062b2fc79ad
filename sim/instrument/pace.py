"""How fast the instrument's time goes: as fast as it can be computed, or by the clock.

Owns the two ways of moving an instrument's agenda. In fast operation time
jumps from event to event and a reading never depends on how long anybody
waited; by the clock, a second is a second (or a stated fraction of one).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

from sim.instrument.bus import Instrument

__all__ = ["ByTheClock", "Fast", "Pace"]

_LONGEST_WAIT_S = 0.25


class Pace(Protocol):
    """A way of letting the instrument's time go on."""

    def advance(self) -> bool:
        """Let some time pass; whether anything happened."""
        ...

    def touch(self) -> None:
        """A controller has done something on the bus."""
        ...

    @property
    def wait_s(self) -> float | None:
        """Wall time until `advance` has something to do; None if nothing is due."""
        ...


class Fast:
    """From event to event, without any waiting.

    A continuous sweep would never end; it goes on for as long as a controller
    takes an interest, one sweep beyond its last word.
    """

    def __init__(self, instrument: Instrument) -> None:
        self._instrument = instrument
        self._started = 0

    def touch(self) -> None:
        """Let continuous sweeps go on."""
        self._started = self._instrument.measurements_begun

    @property
    def _idle(self) -> bool:
        instrument = self._instrument
        repeats = instrument.measurements_begun > self._started + 1
        return repeats and instrument.repeats

    def advance(self) -> bool:
        """The next event."""
        return not self._idle and self._instrument.agenda.run_next()

    def advance_point(self) -> bool:
        """Events up to the end of the next point, or of what is under way without one."""
        begun = self._instrument.points_begun
        moved = False
        while self.advance():
            moved = True
            if self._instrument.points_begun > begun + 1:
                break
        return moved

    @property
    def wait_s(self) -> float | None:
        """None, or nothing to wait for."""
        return 0.0 if not self._idle and self._instrument.agenda.has_work else None


class ByTheClock:
    """By a clock.

    Parameters
    ----------
    rate
        Seconds of the instrument per second of the clock; 1 is honest.
    """

    def __init__(
        self,
        instrument: Instrument,
        rate: float = 1.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._instrument = instrument
        self._rate = rate
        self._clock = clock
        self._start_s = clock() - instrument.agenda.now_s / rate

    @property
    def _now_s(self) -> float:
        return (self._clock() - self._start_s) * self._rate

    def touch(self) -> None:
        """Time goes by itself."""

    def advance(self) -> bool:
        """Everything that is due by now."""
        agenda = self._instrument.agenda
        due = agenda.next_s
        agenda.run_until(self._now_s)
        return due is not None and due <= self._now_s

    @property
    def wait_s(self) -> float | None:
        """Until the next event, in short waits so that a clock may jump."""
        due = self._instrument.agenda.next_s
        if due is None:
            return None
        return min(max(0.0, (due - self._now_s) / self._rate), _LONGEST_WAIT_S)
