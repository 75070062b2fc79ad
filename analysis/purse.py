"""How much motion a search may simulate for a leader that explains nothing.

Owns the limit, and the count that is held against it. Whether a leader explains
is not its question (`analysis.doubt`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from analysis.observation import Observation
from sim.effort import Effort

__all__ = ["Purse"]

_SWEEPS, _LEAST_S = 1500, 230_000.0
"""Machines that may be taken through a sweep, and what any measurement may take: about as much as
the usual sweep of an EDSS, three levels of 61 points, or two and a half minutes of one core. What
has few rows is looked at on all of them from the beginning, and needs no fewer machines. A load
with a payload, hidden there, took 296,000 s in all, and its payload led from 150,000 on."""

_OVERDRAFT = 1.25
"""How many times as much may be spent while the leader might still become an explanation."""


@dataclass(frozen=True, slots=True)
class Purse:
    """What may be spent, and what is: motion in s, so that no clock decides what a search finds.

    It is that of a plain unit; a shaft that hardens costs more (`sim.effort`). `allowed_s`,
    `most_s`: how much, and with the overdraft.
    """

    effort: Effort = field(default_factory=Effort)
    allowed_s: float = math.inf
    most_s: float = math.inf

    @classmethod
    def for_observation(cls, observation: Observation, effort: Effort) -> Purse:
        """The purse of a measurement, out of what `effort` counts from now on."""
        sweep_s = sum(plan.duration_s for plan, _ in observation.plans)
        so_far, granted = effort.worth_s, max(_SWEEPS * sweep_s, _LEAST_S)
        return cls(effort, so_far + granted, so_far + _OVERDRAFT * granted)

    @property
    def is_spent(self) -> bool:
        """Whether as much was simulated as may be."""
        return self.effort.worth_s > self.allowed_s

    @property
    def is_overdrawn(self) -> bool:
        """Whether the overdraft is spent, too."""
        return self.effort.worth_s > self.most_s
