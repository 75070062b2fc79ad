"""The sweep plan: which levels and frequencies are visited, in which order, for how long.

One plan serves the real analyser, the simulated one and the simulation, so
that any bias of the procedure is the same on every side. A plan drives
nothing itself and knows no instrument.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from daq.errors import InputError

__all__ = ["MOST_POINTS", "Direction", "Spacing", "SweepPlan", "spaced_frequencies"]

MOST_POINTS = 100_000
"""Points of a sweep: at a tenth of a second each they take three hours."""

Direction = Literal["up", "down"]
Spacing = Literal["lin", "log"]


@dataclass(frozen=True, slots=True)
class SweepPlan:
    """A stepped-sine sweep at one or more source levels.

    Parameters
    ----------
    frequencies_hz
        Ascending, distinct, positive. `direction` says in which order they are visited.
    levels_vpk
        Source levels in V peak, swept one after the other; distinct and positive.
    direction
        ``"up"`` or ``"down"`` in frequency.
    settle_cycles, integrate_cycles
        Whole drive cycles waited, then averaged, at each point.
    from_rest
        True: every point starts from rest (the paper's procedure). False: the
        motion carries on from point to point (a real sweep).
    dc_offset_v
        Constant voltage added to the source, in V.

    Raises
    ------
    InputError
        If any value is outside what a sweep can mean.
    """

    frequencies_hz: tuple[float, ...]
    levels_vpk: tuple[float, ...]
    direction: Direction = "up"
    settle_cycles: int = 20
    integrate_cycles: int = 30
    from_rest: bool = False
    dc_offset_v: float = 0.0

    def __post_init__(self) -> None:
        frequencies = np.asarray(self.frequencies_hz, dtype=float)
        levels = np.asarray(self.levels_vpk, dtype=float)
        if frequencies.ndim != 1 or frequencies.size == 0:
            raise InputError("sweep plan: no frequencies given; give at least one in Hz")
        if not np.all(np.isfinite(frequencies)) or np.any(frequencies <= 0):
            raise InputError("sweep plan: every frequency must be a positive number of Hz")
        if np.any(np.diff(frequencies) <= 0):
            raise InputError("sweep plan: frequencies must be ascending and distinct")
        if levels.ndim != 1 or levels.size == 0:
            raise InputError("sweep plan: no source level given; give at least one in V peak")
        if not np.all(np.isfinite(levels)) or np.any(levels <= 0):
            raise InputError("sweep plan: every source level must be a positive number of V peak")
        if np.unique(levels).size != levels.size:
            raise InputError("sweep plan: a source level is given twice; give each once")
        if self.direction not in ("up", "down"):
            raise InputError(f"sweep plan: direction {self.direction!r} is not 'up' or 'down'")
        if self.settle_cycles < 0:
            raise InputError(
                f"sweep plan: settle cycles {self.settle_cycles} is negative; use 0 or more"
            )
        if self.integrate_cycles < 1:
            raise InputError(
                f"sweep plan: integrate cycles {self.integrate_cycles} is below 1; use 1 or more"
            )
        if not np.isfinite(self.dc_offset_v):
            raise InputError("sweep plan: the DC offset must be a finite number of V")

    @property
    def visited_hz(self) -> NDArray[np.float64]:
        """Frequencies in the order in which they are visited, shape (points,), Hz."""
        ascending = np.asarray(self.frequencies_hz, dtype=float)
        return ascending if self.direction == "up" else ascending[::-1].copy()

    @property
    def points(self) -> int:
        """Number of points over all levels."""
        return len(self.frequencies_hz) * len(self.levels_vpk)

    @property
    def duration_s(self) -> float:
        """Time that the plan drives the source, in s, without the instrument's overhead."""
        cycles = self.settle_cycles + self.integrate_cycles
        return float(cycles * np.sum(1.0 / np.asarray(self.frequencies_hz)) * len(self.levels_vpk))


def spaced_frequencies(
    start_hz: float, stop_hz: float, points: int, spacing: Spacing = "lin"
) -> tuple[float, ...]:
    """Frequencies from start to stop, both included.

    Raises
    ------
    InputError
        If the band is empty, not positive, or holds fewer than two points
        (one point is allowed where start and stop are equal) or too many.
    """
    if not (np.isfinite(start_hz) and np.isfinite(stop_hz)) or start_hz <= 0:
        raise InputError(f"band {start_hz} to {stop_hz} Hz: the start must be above 0 Hz")
    if points == 1 and start_hz == stop_hz:
        return (float(start_hz),)
    if stop_hz <= start_hz:
        raise InputError(f"band {start_hz} to {stop_hz} Hz: the stop must lie above the start")
    if points < 2:
        raise InputError(f"{points} points cannot span a band; use 2 or more")
    if points > MOST_POINTS:
        raise InputError(f"{points} points are more than a sweep holds; use up to {MOST_POINTS}")
    if spacing == "lin":
        grid = np.linspace(start_hz, stop_hz, points)
    elif spacing == "log":
        grid = np.geomspace(start_hz, stop_hz, points)
    else:
        raise InputError(f"spacing {spacing!r} is not 'lin' or 'log'")
    return tuple(float(f) for f in grid)
