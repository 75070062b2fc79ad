"""A sweep: which frequencies are measured, and which displayed point shows which.

Owns the plan of a swept-sine measurement and the points measured so far. It
measures nothing and lets no time pass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.measuring.frequency import GRID_HZ, band
from sim.analyser35670a.measuring.point import Point
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.units import Quantity

__all__ = ["FEW", "LEAST_POINTS", "MANY", "MOST_POINTS", "Sweep", "measured_points", "plan_sweep"]

LEAST_POINTS, FEW, MANY, MOST_POINTS = 3, 401, 801, 801
_WIDEST_STEP = 0.1
"""Share of the band that auto resolution steps over at most. [S]"""


def measured_points(
    resolution: Quantity, start_hz: float, stop_hz: float, logarithmic: bool
) -> int:
    """Measured points that a resolution means, from 3 to 801.

    Raises
    ------
    ScpiError
        -222 if it is outside that; -131 for a unit that the spacing lacks.
    """
    value, unit = resolution.value, resolution.unit
    if unit in (("HZ",) if logarithmic else ("PNT/DEC", "PNT/OCT")):
        raise ScpiError(-131)
    span, decades = stop_hz - start_hz, math.log10(stop_hz / max(start_hz, GRID_HZ))
    try:
        exact = {
            "HZ": lambda: span / value,
            "PCT": lambda: 100.0 / value,
            "PNT/DEC": lambda: value * decades,
            "PNT/OCT": lambda: value * decades / math.log10(2.0),
        }.get(unit, lambda: value)()
    except ZeroDivisionError:
        exact = math.inf
    if not LEAST_POINTS - 0.5 <= exact < MOST_POINTS + 0.5:
        raise ScpiError(-222, "Out of range: value not changed.")
    return round(exact)


@dataclass(slots=True)
class Sweep:
    """One measurement: its band, its plan, and what came of it.

    `uneven` is a sweep with auto resolution; its X axis is what was measured.
    `both_ends`: whether the last point of plan and axis is the stop.
    """

    start_hz: float
    stop_hz: float
    logarithmic: bool
    downward: bool
    manual: bool
    uneven: bool
    shown: int
    plan: tuple[float, ...]
    both_ends: bool
    finest: float = 0.0
    change: float = 0.02
    points: list[Point] = field(default_factory=list)
    complete: bool = False

    def next_hz(self) -> float | None:
        """Frequency of the point after the last one, None at the end of the sweep."""
        if self.uneven:
            return self._next_uneven()
        done = len(self.points)
        return self.plan[done] if done < len(self.plan) else None

    def _place(self, hz: float) -> float:
        """Position in the band, 0 to 1."""
        if self.logarithmic:
            return math.log(hz / self.start_hz) / math.log(self.stop_hz / self.start_hz)
        return (hz - self.start_hz) / (self.stop_hz - self.start_hz)

    def _frequency(self, place: float) -> float:
        if self.logarithmic:
            return float(self.start_hz * (self.stop_hz / self.start_hz) ** place)
        return self.start_hz + place * (self.stop_hz - self.start_hz)

    def _next_uneven(self) -> float | None:
        """Adapt the step to how much the response changed over the last one."""
        sign, begin, end = (-1.0, 1.0, 0.0) if self.downward else (1.0, 0.0, 1.0)
        if not self.points:
            return self._frequency(begin)
        here = self._place(self.points[-1].frequency_hz)
        if abs(end - here) < 1e-9 or len(self.points) >= self.shown:
            return None
        step = self.finest
        if len(self.points) > 1:
            last = abs(here - self._place(self.points[-2].frequency_hz))
            now, before = (_response(point) for point in self.points[:-3:-1])
            change = abs(now - before) / max(abs(before), 1e-30)
            factor = self.change / change if change > 0 else 2.0
            step = min(max(last * min(max(factor, 0.1), 2.0), self.finest), _WIDEST_STEP)
        # Leave enough points to reach the end of the band.
        step = max(step, abs(end - here) / max(self.shown - len(self.points), 1))
        return self._frequency(min(max(here + sign * step, 0.0), 1.0))

    @property
    def axis(self) -> NDArray[np.float64]:
        """Displayed X axis, shape (shown,), Hz."""
        if self.uneven:
            measured = sorted(point.frequency_hz for point in self.points)
            padding = [measured[-1] if measured else self.start_hz]
            return np.array((measured + padding * self.shown)[: self.shown])
        places = np.arange(self.shown) / (self.shown - 1 if self.both_ends else self.shown)
        if self.logarithmic:
            return np.asarray(self.start_hz * (self.stop_hz / self.start_hz) ** places)
        return self.start_hz + places * (self.stop_hz - self.start_hz)

    def shown_points(self, hold: bool) -> NDArray[np.intp]:
        """For each displayed point the measured one that it shows, -1 for none; (shown,)."""
        picked = np.full(self.shown, -1, dtype=np.intp)
        if not self.points:
            return picked
        measured = np.array([point.frequency_hz for point in self.points])
        order = np.argsort(measured, kind="stable")
        if self.uneven:
            picked[: len(order)] = order[: self.shown]
            if self.complete:
                picked[len(order) :] = order[-1]
            return picked
        axis = self.axis
        if self.manual or not hold:
            nearest = np.abs(axis[None, :] - measured[:, None]).argmin(axis=1)
            picked[nearest] = np.arange(len(measured))
            return picked
        cuts = (measured[order][1:] + measured[order][:-1]) / 2.0
        picked = order[np.searchsorted(cuts, axis)]
        if not self.complete:
            half = (self.stop_hz - self.start_hz) / (2.0 * self.shown)
            low, high = measured.min() - half, measured.max() + half
            picked[(axis < low) | (axis > high)] = -1
        return picked


def _response(point: Point) -> complex:
    reference = point.amplitudes[0]
    return complex(point.amplitudes[1] / reference) if reference else 0j


def plan_sweep(instrument: InstrumentCore) -> Sweep:
    """The sweep that the present settings ask for."""
    settings = instrument.settings
    start, stop = band(instrument)
    logarithmic = settings.get("SWE:SPAC") == "LOG"
    uneven = bool(settings.get("FREQ:RES:AUTO"))
    manual = settings.get("SWE:MODE") == "MAN"
    downward = settings.get("SWE:DIR") == "DOWN" and not manual
    resolution = settings.get("FREQ:RES:AUTO:MIN" if uneven else "FREQ:RES")
    count = _count(resolution, start, stop, logarithmic)
    sweep = Sweep(
        start_hz=start,
        stop_hz=stop,
        logarithmic=logarithmic,
        downward=downward,
        manual=manual,
        uneven=uneven and not manual,
        shown=FEW if count <= FEW else MANY,
        plan=(),
        both_ends=instrument.choices.both_ends,
        finest=1.0 / count,
        change=settings.get("FREQ:RES:AUTO:MCH").value / 100.0,
    )
    if manual:
        sweep.plan = (settings.get("FREQ:MAN").value,)
    else:
        intervals = count - 1 if sweep.both_ends else count
        places = [k / intervals for k in range(count)]
        if downward:
            places = [1.0 - place for place in places]
        sweep.plan = tuple(sweep._frequency(place) for place in places)
    return sweep


def _count(resolution: Quantity, start: float, stop: float, logarithmic: bool) -> int:
    """Points, brought into range: band or spacing may have changed since it was set."""
    try:
        return measured_points(resolution, start, stop, logarithmic)
    except ScpiError:
        return FEW if resolution.unit in ("HZ", "PNT/DEC", "PNT/OCT") else MANY
