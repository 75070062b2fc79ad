"""Which of two motions a sweep follows where both exist: a quiet one, and one that chatters.

Owns the state of a motion at every row, told by its scatter from cycle to
cycle, and how probable a sequence of states is among runs. At low drive the
motor may swing inside the play without meeting a tooth, or chatter; a sweep
keeps to one of them over many points. A run is comparable with an observation
where both are in the same state. It compares nothing itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.runs import Population
from analysis.observation.observation import Observation

__all__ = ["Regimes", "find_regimes"]

_ABOVE_NOISE = 0.7
"""Logarithm of a scatter above what the reading's noise alone shows: twice, and it chatters."""

_STAY = 0.98
"""Prior share of runs that stay in their state from one row to the next, worth one run."""


@dataclass(frozen=True, eq=False)
class Regimes:
    """States of runs and of what they are compared with.

    `quiet` (n, rows): whether a run is. `seen` (rows,): whether what was
    observed is, 1 or 0, and -1 where that is not known. `starts` (rows,): whether a
    source level begins there.
    """

    quiet: NDArray[np.bool_]
    seen: NDArray[np.int8]
    starts: NDArray[np.bool_]

    @classmethod
    def unknown(cls, runs: int, rows: int) -> Regimes:
        """Nothing is known of the motion of the observation: all runs are alike."""
        nowhere = np.zeros(rows, dtype=bool)
        return cls(np.zeros((runs, rows), dtype=bool), np.full(rows, -1, dtype=np.int8), nowhere)

    def of(self, runs: NDArray[np.bool_]) -> Regimes:
        """Those of some runs (n,)."""
        return replace(self, quiet=self.quiet[runs])

    def against(self, quiet: NDArray[np.bool_]) -> Regimes:
        """The same runs beside another observation, whose states (rows,) are known."""
        seen = np.where(self.seen < 0, self.seen, quiet.astype(np.int8))
        return replace(self, seen=seen.astype(np.int8))

    @cached_property
    def alike(self) -> NDArray[np.float64]:
        """(n, rows): 1 where a run is in the observed state or that is not known, else 0."""
        return np.where(self.seen < 0, 1.0, self.quiet == self.seen)

    @cached_property
    def mixed(self) -> NDArray[np.bool_]:
        """(rows,): where not all runs are in the observed state."""
        return np.asarray(self.alike.min(axis=0) < 1.0)

    @cached_property
    def course(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Whether runs (n, rows) did as observed one row before, and there too; the prior (rows,).

        The prior is that of the latter, as a number of runs, of one in all.
        """
        before = np.where(self.starts, 1.0, np.roll(self.alike, 1, axis=1))
        changed = (self.seen != np.roll(self.seen, 1)) & ~self.starts
        prior = np.where(self.starts, 0.5, np.where(changed, 1.0 - _STAY, _STAY))
        prior[self.seen < 0] = 1.0
        return before, before * self.alike, prior


def find_regimes(observation: Observation, population: Population) -> Regimes:
    """States of the runs of a population and of an observation."""
    limit = 0.5 * np.log(2.0 * observation.noise**2) + _ABOVE_NOISE
    scatter = population.channels(observation)[:, 2]
    seen = observation.values[2]
    starts = np.zeros(len(observation), dtype=bool)
    starts[[block.start for block in observation.blocks]] = True
    state = np.where(np.isfinite(seen), seen < limit, -1).astype(np.int8)
    return Regimes(scatter < limit, state, starts)
