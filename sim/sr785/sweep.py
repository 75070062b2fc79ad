"""A swept-sine measurement of the SR785: start, pause, go on, finish, one point after the other.

Owns the state of the measurement and the process that lets its time pass and moves its status
bits. What a point reads is `point`'s matter, what a display makes of it is `traces`'.
"""

from __future__ import annotations

import math
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from daq.errors import AnalysisError
from sim.instrument.agenda import HOLD, Process, Steps
from sim.sr785.parts import InstrumentCore
from sim.sr785.point import Point, take_point
from sim.sr785.settings import SWEPT
from sim.sr785.status import Display, Error, Input, Instrument

__all__ = ["State", "Sweep"]

_RECORD_S = 0.1
"""[S] One record in a group that does not sweep."""


class State(Enum):
    """Where a measurement stands."""

    IDLE = "none"
    RUNNING = "running"
    PAUSED = "paused"
    DONE = "finished"


class Sweep:
    """The measurement of one instrument, in whatever group."""

    def __init__(self, instrument: InstrumentCore) -> None:
        self._instrument = instrument
        self._process: Process | None = None
        self.state = State.IDLE
        self.started = 0
        self.points_begun = 0
        self.averaged = 0
        """Records in the average of a group that does not sweep."""
        self.axis_hz: NDArray[np.float64] = np.zeros(0)
        self.bins: dict[int, tuple[int, Point]] = {}
        """By bin: running number of the point, and the point."""
        self.interpolated: dict[int, Point] = {}
        """Bins that auto resolution skipped; the data do not tell them from measured ones."""
        self.present: tuple[int, float] = (0, 0.0)
        self.never_ends = False

    @property
    def running(self) -> bool:
        """Whether points are being taken."""
        return self.state is State.RUNNING

    def start(self) -> None:
        """``STRT``: begin anew."""
        instrument = self._instrument
        self._stop()
        self.started += 1
        status = instrument.status
        status.words["DSPS"] &= ~(Display.SWEPT | Display.SWEPT << 8)
        status.put("INST", Instrument.STARTED)
        self.state = State.RUNNING
        if instrument.group != SWEPT:
            self._process = instrument.agenda.start(self._records())
            instrument.refresh_source()
            return
        if instrument.choices.start_clears or len(self.axis_hz) != instrument.settings.get("SNPS"):
            self.forget_data()
        self.axis_hz = instrument.settings.axis_hz()
        instrument.refresh_source()
        self._process = instrument.agenda.start(self._points(), self._finished)

    def pause(self) -> None:
        """``PAUS``: the source goes off."""
        if self.running:
            self.state = State.PAUSED
        self._instrument.status.put("INST", Instrument.PAUSED)
        self._instrument.refresh_source()

    def go_on(self) -> None:
        """``CONT``: resume at the point that was reached; the source is on again."""
        if self.state is not State.PAUSED or self._process is None:
            return
        self.state = State.RUNNING
        self._instrument.status.put("INST", Instrument.STARTED)
        self._instrument.refresh_source()
        self._process.resume()

    def reset(self) -> None:
        """A change of start, stop or number of points: the data go, a sweep begins anew."""
        running = self.running and self._instrument.group == SWEPT
        self._stop()
        self.forget_data()
        if running:
            self.start()
        else:
            self.state = State.IDLE

    def forget(self) -> None:
        """Nothing is measured any more, and nothing is kept."""
        self._stop()
        self.state = State.IDLE
        self.forget_data()

    def forget_data(self) -> None:
        """The bins are empty."""
        self.bins.clear()
        self.interpolated.clear()
        self._instrument.traces.keep_all()

    def _stop(self) -> None:
        if self._process is not None:
            self._process.stop()
            self._process = None

    # ------------------------------------------------------------ processes

    def _records(self) -> Steps:
        """Records of a group that does not sweep; a linear average ends with its last."""
        get, status = self._instrument.settings.get, self._instrument.status
        self.averaged = 0
        while True:
            yield _RECORD_S
            status.put("DSPS", Display.NEW | Display.NEW << 8)
            self.averaged += 1
            wanted = int(get("FAVN")) if get("FAVG") else 1
            if self.averaged >= wanted:
                status.put("DSPS", Display.AVERAGED | Display.AVERAGED << 8)
                if get("FAVT") == 0:
                    return

    def _points(self) -> Steps:
        instrument, skip, passed = self._instrument, 0, 0
        order = list(range(len(self.axis_hz)))
        if instrument.settings.get("SSTR") > instrument.settings.get("SSTP"):
            order.reverse()
        place = 0
        while place < len(order):
            while self.state is State.PAUSED:
                yield HOLD
            left_s = instrument.source.remaining_s(instrument.agenda.now_s)
            if left_s > 0:
                yield left_s
            row = order[place]
            self.present = place, float(self.axis_hz[row])
            self.points_begun += 1
            instrument.begin_point()
            try:
                point = take_point(instrument, float(self.axis_hz[row]), (self.started, place))
            except AnalysisError:
                instrument.status.put("ERRS", Error.MATH)
                self.never_ends = True
                return
            yield point.settle_s
            if point.ranging_s:
                yield point.ranging_s
            yield point.integrated_s
            self._judge(point)
            yield instrument.choices.point_overhead_s
            self.bins[row] = self.points_begun, point
            instrument.status.put("DSPS", Display.NEW | Display.NEW << 8)
            skip = self._skips(order, place, passed, skip)
            after = min(place + 1 + skip, max(place + 1, len(order) - 1))
            place, passed = after, after - place - 1
        self.never_ends = instrument.faults.take("stuck-measuring-bit") is not None

    def _judge(self, point: Point) -> None:
        """Move the input word."""
        bits = 0
        for channel in (0, 1):
            found = Input.ABOVE_HALF if point.above_half[channel] else Input.BELOW_HALF
            found |= Input.OVERLOAD if point.overloaded[channel] else Input(0)
            found |= Input.FORCED_DOWN if point.forced[channel] else Input(0)
            found |= Input.RANGED if point.ranged[channel] else Input(0)
            bits |= int(found) << 8 * channel
        self._instrument.status.put("INPS", bits)
        self._instrument.input_now = bits

    def _skips(self, order: list[int], place: int, passed: int, before: int) -> int:
        """Points that auto resolution leaves out next, filling those left out on the way here."""
        get = self._instrument.settings.get
        last = place - 1 - passed
        if not get("SARS") or last < 0:
            return 0
        old, new = self.bins[order[last]][1], self.bins[order[place]][1]
        for step in range(1, passed + 1):
            share = step / (passed + 1)
            mixed = (1 - share) * old.amplitudes + share * new.amplitudes
            self.interpolated[order[last + step]] = Point(
                old.frequency_hz, mixed, old.variances, old.integrated_s, old.above_half,
                old.overloaded, old.forced, old.ranged, old.settle_s, old.ranging_s,
            )  # fmt: skip
        levels = [abs(point.amplitudes[1] / point.amplitudes[0]) for point in (old, new)]
        change_db = abs(20.0 * math.log10(max(levels[1], 1e-12) / max(levels[0], 1e-12)))
        if change_db < get("SFST"):
            return min(2 * before + 1, int(get("SSKP")) - 1)
        return before // 2 if change_db > get("SSLO") else before

    def _finished(self) -> None:
        instrument = self._instrument
        self._process = None
        if self.never_ends:
            return
        self.state = State.DONE
        instrument.status.put("DSPS", Display.SWEPT | Display.SWEPT << 8)
        if instrument.settings.get("SRPT"):
            self.start()
        instrument.refresh_source()
