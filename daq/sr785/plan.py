"""From frequencies to sweeps that the SR785 can run: whole grids, or repeats at one frequency.

Owns that choice, the numbers of points and cycles, and how long a sweep takes. The instrument has
no single frequency in swept sine: evenly spaced frequencies become one sweep, any other one
becomes a sweep of ten points or more over a span too narrow to matter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.analyser import PointSettings
from daq.sr785.settings import (
    LEAST_INTEGRATE_S,
    LEAST_POINTS,
    LEAST_SETTLE_S,
    MOST_POINTS,
)

__all__ = ["Grid", "Repeats", "cycles_at", "duration_s", "grids_of", "repeats_at"]

_SPAN = 1e-4
"""Width of the sweep that stands for one frequency, relative to it."""
_EVEN = 1e-6
"""Part of a step by which evenly spaced frequencies may be off."""
_LEAST_KEPT = 4
"""Points of a repeat whose scatter is its standard error."""


@dataclass(frozen=True, slots=True)
class Grid:
    """One sweep; arrays and fields in the order in which it is driven."""

    start_hz: float
    stop_hz: float
    points: int
    is_log: bool
    settle_cycles: int
    integrate_cycles: int
    skipped: int = 0
    """Points at its beginning that nobody asked for."""
    kept: int | None = None
    """Points after those that were asked for; None for all."""

    @property
    def frequencies_hz(self) -> NDArray[np.float64]:
        """Where its points are, shape (points,)."""
        spaced = np.geomspace if self.is_log else np.linspace
        return spaced(self.start_hz, self.stop_hz, self.points)

    @property
    def asked_hz(self) -> NDArray[np.float64]:
        """Those that were asked for."""
        end = None if self.kept is None else self.skipped + self.kept
        return self.frequencies_hz[self.skipped : end]


class Repeats(Grid):
    """A narrow sweep that stands for one frequency: the first points settle, the rest repeat."""

    __slots__ = ()


def grids_of(
    frequencies_hz: Sequence[float], band_hz: tuple[float, float], settings: PointSettings
) -> list[Grid] | None:
    """The sweeps that measure evenly spaced frequencies in their order; None if they are not.

    A run shorter than a sweep may be begins earlier, or ends later, within the band.
    """
    asked = np.asarray(frequencies_hz, dtype=float)
    if len(asked) < 2:
        return None
    for is_log in (False, True):
        spaced = np.geomspace if is_log else np.linspace
        due = spaced(asked[0], asked[-1], len(asked))
        if due[0] != due[-1] and np.all(np.abs(asked - due) <= _EVEN * np.abs(np.diff(due)).min()):
            break
    else:
        return None
    cycles = settings.settle_cycles, settings.integrate_cycles
    if len(asked) >= LEAST_POINTS:
        count = math.ceil(len(asked) / MOST_POINTS)
        return [
            Grid(float(part[0]), float(part[-1]), len(part), is_log, *cycles)
            for part in np.array_split(due, count)
        ]
    extra = LEAST_POINTS - len(asked)
    for before in (extra, 0):
        longer = _extended(due, is_log, before, extra - before)
        if band_hz[0] <= min(longer) and max(longer) <= band_hz[1]:
            first, last = float(longer[0]), float(longer[-1])
            return [Grid(first, last, LEAST_POINTS, is_log, *cycles, before, len(asked))]
    return None


def _extended(
    grid_hz: NDArray[np.float64], is_log: bool, before: int, after: int
) -> NDArray[np.float64]:
    """The same grid with points more at its ends."""
    places = np.arange(-before, len(grid_hz) + after)
    if is_log:
        step = (grid_hz[-1] / grid_hz[0]) ** (1.0 / (len(grid_hz) - 1))
        return np.asarray(grid_hz[0] * step**places)
    return np.asarray(grid_hz[0] + (grid_hz[1] - grid_hz[0]) * places)


def repeats_at(
    frequency_hz: float, band_hz: tuple[float, float], settings: PointSettings
) -> Repeats:
    """The narrow sweep for one frequency; within the band where that has room for it.

    It integrates as many cycles as are asked for, shared out over ten points or so; those that
    pass before the settle cycles are over are not kept.
    """
    wanted, settle = settings.integrate_cycles, settings.settle_cycles
    share = max(1, math.ceil(wanted / LEAST_POINTS), math.ceil((wanted + settle) / MOST_POINTS * 2))
    settled, integrated = cycles_at(frequency_hz, 1, share)
    kept = max(_LEAST_KEPT, math.ceil(wanted / integrated))
    skipped = math.ceil(settle / (settled + integrated))
    skipped = max(skipped, LEAST_POINTS - kept)
    width = _SPAN * frequency_hz
    low = frequency_hz - width / 2
    if band_hz[1] - band_hz[0] > width:
        low = min(max(low, band_hz[0]), band_hz[1] - width)
    return Repeats(low, low + width, skipped + kept, False, 1, share, skipped, kept)


def cycles_at(frequency_hz: float, settle: int, integrate: int) -> tuple[int, int]:
    """Cycles that a point really settles and integrates: there is a shortest time for both.

    The variance that the instrument tells refers to these and not to those that were set.
    """
    settle_s = max(LEAST_SETTLE_S, settle / frequency_hz)
    integrate_s = max(LEAST_INTEGRATE_S, integrate / frequency_hz)
    return (
        math.ceil(settle_s * frequency_hz - 1e-9),
        math.ceil(integrate_s * frequency_hz - 1e-9),
    )


def duration_s(grid: Grid, settings: PointSettings) -> float:
    """How long a sweep drives, ramps included, without ranging and overhead, s."""
    driven_s = sum(
        sum(cycles_at(float(hz), grid.settle_cycles, grid.integrate_cycles)) / float(hz)
        for hz in grid.frequencies_hz
    )
    slew = settings.slew_vpk_per_s
    return driven_s + (2.0 * settings.source_vpk / slew if slew else 0.0)
