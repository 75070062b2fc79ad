"""A hypothesis's own runs, each taken as if it had been observed.

Owns that substitution alone: with it a fit can be compared with those that the
hypothesis would give if it were true, which no table tells, because points of
a sweep err together. It judges nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.emulator import Emulator
from analysis.emulation.fitted_model import FittedModel

__all__ = ["FEWEST_RUNS", "MOST_RUNS", "Replicate", "replicates_of"]

MOST_RUNS = 48
"""Runs that are taken in turn: the nearest to the best place."""

FEWEST_RUNS = 2
"""Own runs below which nothing is known of how they scatter."""

_LOST = 0.02
"""Share of rows at which a run may do what no other does, if the observation has no more."""


@dataclass(frozen=True, slots=True, eq=False)
class Replicate:
    """A run of a hypothesis in place of the observation.

    `place` (d,): where it was made. `alone`: the hypothesis's surface from
    the half of its runs that deviates otherwise. `as_read` (3, rows): the run
    with reading noise, minus the true observation; `quiet` (rows,): its state.
    """

    place: NDArray[np.float64]
    alone: Emulator
    as_read: NDArray[np.float64]
    quiet: NDArray[np.bool_]

    def seen_by(self, surface: Emulator) -> Emulator:
        """Another hypothesis's surface, relative to this run instead of the observation."""
        return surface.against(self.as_read, self.quiet)


def replicates_of(candidate: FittedModel, rng: np.random.Generator) -> Iterator[Replicate]:
    """The runs nearest to a candidate's best place, one by one.

    A run that alone did what it did has no others to be fitted by: it would be unlike them by
    hundreds, and tells nothing of an observation that is not alone.
    """
    surface, best = candidate.surface, candidate.best
    most_lost = max(surface.lost(best.place), _LOST * len(surface.observation))
    noise = surface.observation.noise
    distance = surface.distance(best.place)
    # Half of the runs deviate as a run does in the first datasheet value; the other half fits it.
    # The limits of what is doubted were settled so.
    halves = candidate.population.deviations[:, 0]
    taken = 0
    for i in np.argsort(distance, kind="stable"):
        if taken == MOST_RUNS:
            return
        others = halves != halves[i]
        if not np.any(others):
            continue
        as_read = surface.difference[i].copy()
        as_read[:2] += rng.standard_normal((2, len(noise))) * noise
        quiet = surface.motions.quiet[i]
        alone = surface.of(others).against(as_read, quiet)
        if alone.lost(surface.places[i]) <= most_lost:
            taken += 1
            yield Replicate(surface.places[i], alone, as_read, quiet)
