"""Ticks of the Bode plots: logarithmic frequency and degrees.

Owns where ticks stand and what they say. Plots here have log10 of the
frequency on their x axis, since the plotting widget knows linear axes only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from textual_plot import AxisFormatter

__all__ = ["DegreeAxis", "LogHertzAxis"]

_DECADES: tuple[tuple[float, ...], ...] = (
    (1, 1.2, 1.4, 1.6, 1.8, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8, 9),
    (1, 1.5, 2, 3, 4, 5, 6, 8),
    (1, 2, 5),
    (1, 3),
    (1,),
)
"""Sets of ticks within a decade, the densest first."""
_FEWEST = 3
_DEGREE_STEPS = (1, 5, 15, 45, 90, 180)


class LogHertzAxis(AxisFormatter):
    """Round frequencies on an axis of log10(Hz)."""

    def get_ticks(self, min_: float, max_: float, max_ticks: int = 8) -> list[float]:
        """Positions, log10(Hz), of the densest round frequencies that fit."""
        for decade in _DECADES:
            ticks = self._ticks(decade, min_, max_)
            if len(ticks) <= max_ticks and (len(ticks) >= _FEWEST or decade == _DECADES[0]):
                break
        if len(ticks) < _FEWEST:
            # Less than a third of a decade: evenly spaced round numbers read best.
            return self._linear(min_, max_, max_ticks)
        return ticks[: max(1, max_ticks)]

    def get_labels_for_ticks(self, ticks: Sequence[float]) -> list[str]:
        """The frequencies in Hz."""
        return [f"{round(10.0**tick, 6):g}" for tick in ticks]

    @staticmethod
    def _ticks(decade: Sequence[float], low: float, high: float) -> list[float]:
        exponents = range(math.floor(low), math.floor(high) + 1)
        places = (math.log10(part) + exponent for exponent in exponents for part in decade)
        return [place for place in places if low <= place <= high]

    @staticmethod
    def _linear(low: float, high: float, most: int) -> list[float]:
        low_hz, high_hz = 10.0**low, 10.0**high
        rough = (high_hz - low_hz) / max(1, most - 1)
        power = 10.0 ** math.floor(math.log10(rough)) if rough > 0 else 1.0
        step = next(part * power for part in (1, 2, 5, 10) if part * power >= rough)
        first, last = math.ceil(low_hz / step), math.floor(high_hz / step)
        return [math.log10(count * step) for count in range(max(1, first), last + 1)]


class DegreeAxis(AxisFormatter):
    """Phase ticks at parts of a turn.

    Parameters
    ----------
    rows
        Height of the axis in lines; two ticks want a line between them.
    """

    def __init__(self, rows: int = 20) -> None:
        self._most = max(2, rows // 2)

    def get_ticks(self, min_: float, max_: float, max_ticks: int = 8) -> list[float]:
        """Multiples of the smallest step that is not crowded, degrees."""
        ticks: list[float] = []
        for step in _DEGREE_STEPS:
            ticks = [
                float(step * count)
                for count in range(math.ceil(min_ / step), math.floor(max_ / step) + 1)
            ]
            if len(ticks) <= min(max(2, max_ticks), self._most):
                break
        return ticks

    def get_labels_for_ticks(self, ticks: Sequence[float]) -> list[str]:
        """The angles."""
        return [f"{tick:g}" for tick in ticks]
