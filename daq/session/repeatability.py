"""Whether points that were measured twice are the same within their errors.

Owns the comparison of two visits. It judges the conditions of a measurement,
never the unit.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable
from dataclasses import dataclass

from daq.analyser import SweepPoint

__all__ = ["Repetition", "compare"]

_FLOOR_DB = 0.05
"""Difference between two visits that is no sign of anything, dB."""
_SIGMA = 6.0
"""Median distance in standard errors from which two visits differ. The instrument's error is
that of independent cycles; the motion of a servo with play wanders more slowly than that, and
two sweeps of the same unit lie about three of these errors apart where it does."""


@dataclass(frozen=True, slots=True)
class Repetition:
    """How well a number of points came again.

    `median_db` is the median difference in magnitude; `median_sigma` the same
    in standard errors, None where no error is known.
    """

    points: int
    median_db: float
    median_sigma: float | None

    @property
    def differs(self) -> bool:
        """Whether the second visit is another response."""
        return self.median_sigma is not None and self.median_sigma > _SIGMA

    def __str__(self) -> str:
        sigma = "" if self.median_sigma is None else f" ({self.median_sigma:.1f} standard errors)"
        return (
            f"{self.points} points came again within {self.median_db:.2f} dB{sigma} at the median"
        )


def compare(pairs: Iterable[tuple[SweepPoint, SweepPoint]]) -> Repetition | None:
    """Compare two visits point by point; None where no pair has a magnitude."""
    differences, sigmas = [], []
    for one, other in pairs:
        sizes = abs(one.gain), abs(other.gain)
        if not all(size > 0 and math.isfinite(size) for size in sizes):
            continue
        apart_db = abs(20.0 * math.log10(sizes[0] / sizes[1]))
        differences.append(apart_db)
        if one.gain_std_db is not None and other.gain_std_db is not None:
            sigmas.append(apart_db / math.hypot(one.gain_std_db, other.gain_std_db, _FLOOR_DB))
    if not differences:
        return None
    sigma = statistics.median(sigmas) if sigmas else None
    return Repetition(len(differences), statistics.median(differences), sigma)
