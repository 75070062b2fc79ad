"""A signal source's output: what level comes out of the connector, and how it gets there.

Owns the ramp between levels. It does not decide when the source is on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["Source"]


@dataclass(slots=True)
class Source:
    """The output: an amplitude on its way to a target, and an offset."""

    begin_s: float = 0.0
    begin_vpk: float = 0.0
    target_vpk: float = 0.0
    rate: float = 0.0
    """V peak per second; 0 steps. [S]"""
    offset_v: float = 0.0

    def level(self, now_s: float) -> float:
        """Amplitude at a moment, V peak."""
        if self.rate <= 0.0:
            return self.target_vpk
        travelled = self.rate * max(0.0, now_s - self.begin_s)
        distance = self.target_vpk - self.begin_vpk
        return self.begin_vpk + math.copysign(min(abs(distance), travelled), distance)

    def aim(self, now_s: float, target_vpk: float, rate: float) -> None:
        """Head for another amplitude."""
        if target_vpk == self.target_vpk and rate == self.rate:
            return
        present = self.level(now_s)
        self.begin_s, self.begin_vpk = now_s, present
        self.target_vpk, self.rate = target_vpk, rate

    def remaining_s(self, now_s: float) -> float:
        """Time until the target is reached."""
        if self.rate <= 0.0:
            return 0.0
        return abs(self.target_vpk - self.level(now_s)) / self.rate

    def off(self, now_s: float) -> None:
        """No output at once."""
        self.begin_s, self.begin_vpk, self.target_vpk = now_s, 0.0, 0.0
        self.rate = self.offset_v = 0.0
