"""How much motion a search may simulate for a leader that explains nothing.

Owns the limit, and the count that is held against it. Whether a leader explains
is not its question (`analysis.doubt`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from sim.effort import Effort

__all__ = ["Purse"]

_PER_ROW_S = 1600.0
"""Seconds of motion per row of a measurement. For three levels of 61 points these are 290,000 s,
three and a half minutes of one core; of 16 pairs that were hidden one took more before it led."""


@dataclass(frozen=True, slots=True)
class Purse:
    """What may be spent, and what is: motion in s, so that no clock decides what a search finds."""

    effort: Effort = field(default_factory=Effort)
    allowed_s: float = math.inf

    @classmethod
    def for_rows(cls, rows: int, effort: Effort) -> Purse:
        """The purse of a measurement with so many rows, out of what `effort` will count."""
        return cls(effort, effort.simulated_s + _PER_ROW_S * rows)

    @property
    def is_spent(self) -> bool:
        """Whether as much was simulated as may be."""
        return self.effort.simulated_s > self.allowed_s
