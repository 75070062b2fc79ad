"""Which motion a sweep follows where several exist side by side: quiet ones, and such as chatter.

Owns what tells them apart, the scatter from cycle to cycle, and how probable it
is among runs to do what was observed. At low drive the motor may swing inside
the play without meeting a tooth, or chatter; a sweep keeps to one of them over
many points. A run is comparable with an observation where both scatter alike.
It compares nothing itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.observation import Observation
from analysis.population import Population

__all__ = ["Motions", "find_motions"]

_WITHIN = 1.0
"""Runs scatter alike whose scatters differ by less than this in their logarithm: those of one
chattering motion do by about a quarter, a quiet and a chattering one by three."""

_STAY = 0.98
"""Prior share of runs that keep to their motion from one row to the next, worth `_PRIOR` runs."""
_PRIOR = 1.0


@dataclass(frozen=True, eq=False)
class Motions:
    """How runs scatter, and what they are compared with.

    `scatter` (n, rows): logarithm of the scatter of each run, with the reading's
    noise; `seen` (rows,): of the observation, NaN where that is not known.
    `starts` (rows,): whether a source level begins there.
    """

    scatter: NDArray[np.float64]
    seen: NDArray[np.float64]
    starts: NDArray[np.bool_]

    @classmethod
    def unknown(cls, runs: int, rows: int) -> Motions:
        """Nothing is known of the motion of the observation: all runs are alike."""
        nowhere = np.zeros(rows, dtype=bool)
        return cls(np.zeros((runs, rows)), np.full(rows, np.nan), nowhere)

    def of(self, runs: NDArray[np.bool_]) -> Motions:
        """Those of some runs (n,)."""
        return replace(self, scatter=self.scatter[runs])

    def against(self, scatter: NDArray[np.float64]) -> Motions:
        """The same runs beside another observation, whose scatter (rows,) is known."""
        return replace(self, seen=np.where(np.isfinite(self.seen), scatter, np.nan))

    @cached_property
    def alike(self) -> NDArray[np.float64]:
        """(n, rows): 1 where a run scatters as was observed or that is not known, else 0."""
        apart = np.abs(self.scatter - self.seen)
        return np.where(apart >= _WITHIN, 0.0, 1.0)

    @cached_property
    def mixed(self) -> NDArray[np.bool_]:
        """(rows,): where not all runs scatter as was observed."""
        return np.asarray(self.alike.min(axis=0) < 1.0)

    def log_shares(self, weight: NDArray[np.float64]) -> NDArray[np.float64]:
        """Logarithm (rows,) of the share of weighted runs (n,) that do as was observed.

        Of those that did so one row before: a level begins with one motion and then
        keeps to it or changes.
        """
        before = np.where(self.starts, 1.0, np.roll(self.alike, 1, axis=1))
        changed = np.abs(self.seen - np.roll(self.seen, 1)) >= _WITHIN
        prior = np.where(changed, 1.0 - _STAY, _STAY)
        prior = np.where(self.starts, 0.5, prior)
        prior[np.isnan(self.seen)] = 1.0
        both = weight @ (before * self.alike)
        return np.asarray(np.log((both + _PRIOR * prior) / (weight @ before + _PRIOR)))


def find_motions(observation: Observation, population: Population) -> Motions:
    """How the runs of a population scatter beside an observation."""
    scatter = population.channels(observation)[:, 2]
    starts = np.zeros(len(observation), dtype=bool)
    starts[[block.start for block in observation.blocks]] = True
    return Motions(scatter, observation.values[2], starts)
