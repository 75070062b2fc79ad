"""Scales of plots: which value lies at which cell, and where ticks stand.

Owns the choice of round limits and steps of 1, 2 and 5. On a linear scale ticks are a whole number
of cells apart, so that they are even on a grid of characters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Scale", "degree_scale", "frequency_scale", "linear_scale"]

_STEPS = (1.0, 2.0, 5.0)
_DEGREES = (1.0, 2.0, 5.0, 15.0, 30.0, 45.0, 90.0, 180.0, 360.0, 720.0, 1800.0, 3600.0)
_LOG_SPAN = 4.0
"""Ratio of the ends of a band from which its axis is logarithmic."""

_DECADES: tuple[tuple[float, ...], ...] = (
    (1, 1.5, 2, 3, 4, 5, 6, 8),
    (1, 2, 5),
    (1, 3),
    (1,),
)
"""Sets of ticks within a decade, the densest first."""


@dataclass(frozen=True, slots=True)
class Scale:
    """Values along an axis of some cells.

    Parameters
    ----------
    low, high
        Values at the outer edges of the first and the last cell.
    cells
        Length of the axis.
    ticks
        Values of the ticks, ascending.
    is_log
        Whether it is logarithmic.
    """

    low: float
    high: float
    cells: int
    ticks: tuple[float, ...]
    is_log: bool = False

    def place(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where values lie, in cells from the start of the axis; NaN stays NaN."""
        low, high = self.low, self.high
        if self.is_log:
            with np.errstate(divide="ignore", invalid="ignore"):
                values = np.log(values)
            low, high = math.log(low), math.log(high)
        return np.asarray((values - low) / (high - low) * self.cells)

    def value(self, place: float) -> float:
        """The value at a place in cells; the inverse of `place`."""
        share = place / self.cells
        if self.is_log:
            return float(self.low * (self.high / self.low) ** share)
        return self.low + share * (self.high - self.low)

    @property
    def labels(self) -> list[str]:
        """What the ticks say: with as many decimals as the finest needs."""
        digits = max((_decimals(tick) for tick in self.ticks), default=0)
        if self.is_log:
            return [f"{tick:g}" for tick in self.ticks]
        return [f"{tick:.{digits}f}" for tick in self.ticks]


def linear_scale(
    low: float,
    high: float,
    cells: int,
    apart: tuple[int, int] = (2, 6),
    steps: Sequence[float] = (),
) -> Scale:
    """A linear scale that holds a range, with even ticks.

    Parameters
    ----------
    low, high
        What must be on it.
    cells
        Length of the axis, 2 or more.
    apart
        Fewest and most cells between two ticks.
    steps
        Steps to choose from; 1, 2 and 5 times powers of ten if left out.
    """
    if not high > low:
        margin = abs(low) * 0.05 or 0.5
        low, high = low - margin, high + margin
    fewest, most = min(apart[0], cells), min(apart[1], max(1, cells))
    needed = (high - low) / max(1, cells - 1)
    power = 10.0 ** math.floor(math.log10(needed * fewest))
    parts = steps or [p * power * ten for ten in (1, 10, 100, 1000, 10000) for p in _STEPS]
    found = [
        _aligned(low, high, cells, step, count)
        for step in parts
        for count in range(fewest, most + 1)
        if step / count >= needed
    ]
    if not found:
        return linear_scale(low, high, cells, apart)
    # Two ticks or more tell a scale; then as little room is left empty as can be.
    return min(found, key=lambda one: (len(one.ticks) < 2, one.high - one.low))


def _aligned(low: float, high: float, cells: int, step: float, count: int) -> Scale:
    """The scale with ticks every `count` cells, with a range in its middle."""
    per_cell = step / count
    first = round(0.5 * (low + high) / per_cell - 0.5 * (cells - 1))
    first = min(first, math.floor(low / per_cell + 0.5 + 1e-9))
    values = [n for n in range(first, first + cells) if n % count == 0]
    bottom = (first - 0.5) * per_cell
    ticks = tuple(round(n // count * step, 12) for n in values)
    return Scale(bottom, bottom + cells * per_cell, cells, ticks)


def degree_scale(low: float, high: float, cells: int, apart: tuple[int, int] = (2, 5)) -> Scale:
    """A scale of angles: steps are parts of a turn."""
    return linear_scale(low, high, cells, apart, _DEGREES)


def frequency_scale(low: float, high: float, cells: int, least: int = 8) -> Scale:
    """A scale of frequencies, Hz: logarithmic over a wide band, linear over a narrow one.

    Parameters
    ----------
    least
        Cells that a label takes.
    """
    if high < _LOG_SPAN * low:
        return linear_scale(low, high, cells, (least, 2 * least))
    margin = (high / low) ** (0.5 / max(1, cells - 1))
    low, high = low / margin, high * margin
    most = max(2, cells // least)
    ticks: list[float] = []
    for decade in _DECADES:
        exponents = range(math.floor(math.log10(low)), math.floor(math.log10(high)) + 1)
        places = (float(f"{part * 10.0**e:.12g}") for e in exponents for part in decade)
        ticks = [hertz for hertz in places if low <= hertz <= high]
        if len(ticks) <= most:
            break
    return Scale(low, high, cells, tuple(ticks[: most + 1]), True)


def _decimals(value: float) -> int:
    text = f"{value:.9f}".rstrip("0")
    return len(text.partition(".")[2])
