"""How much motion a search may simulate, and how much of it is spent.

Owns the limit, and the count that is held against it. What is spared when how much
of it is spent is for those to say who ask.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from analysis.observation import Observation
from sim.effort import Effort, counting

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

    It is that of a plain unit; what takes longer to step costs more (`sim.effort`). `so_far_s`:
    what `effort` counted before; `granted_s`: how much may be spent, but for the overdraft.
    """

    effort: Effort = field(default_factory=Effort)
    so_far_s: float = 0.0
    granted_s: float = math.inf

    @classmethod
    def for_observation(cls, observation: Observation, effort: Effort) -> Purse:
        """The purse of a measurement, out of what `effort` counts from now on."""
        sweep_s = sum(plan.duration_s for plan, _ in observation.plans)
        return cls(effort, effort.worth_s, max(_SWEEPS * sweep_s, _LEAST_S))

    def has_spent(self, share: float) -> bool:
        """Whether more than a share of what may be simulated was."""
        return self.effort.worth_s > self.so_far_s + share * self.granted_s

    @property
    def is_spent(self) -> bool:
        """Whether as much was simulated as may be."""
        return self.has_spent(1.0)

    @property
    def is_overdrawn(self) -> bool:
        """Whether the overdraft is spent, too."""
        return self.has_spent(_OVERDRAFT)

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Hold nothing that is simulated inside the block against the purse.

        What is kept from one measurement to the next would else decide what a search finds.
        """
        with counting() as made:
            yield
        self.effort.add(-made.simulated_s, -made.worth_s)
