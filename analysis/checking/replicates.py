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
from analysis.observation.observation import Observation
from analysis.observation.reading_noise import estimate_noise

__all__ = ["FEWEST_RUNS", "MOST_RUNS", "Replicate", "replicates_of"]

MOST_RUNS = 48
"""Runs that are taken in turn: the nearest to the best place."""

FEWEST_RUNS = 2
"""Own runs below which nothing is known of how they scatter."""

_LOUDEST = 1.5
"""By how much a noise may be louder than its estimate, at most."""

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
    distance = surface.distance(best.place)
    # Half of the runs deviate as a run does in the first datasheet value; the other half fits it.
    # The limits of what is doubted were settled so.
    folds = candidate.population.fold
    taken = 0
    for i in np.argsort(distance, kind="stable"):
        if taken == MOST_RUNS:
            return
        others = folds != folds[i]
        if not np.any(others):
            continue
        read = _reading_errors(surface.observation, candidate.population.variance[i], rng)
        as_read = surface.difference[i] + read
        quiet = surface.motions.quiet[i]
        alone = surface.of(others).against(as_read, quiet)
        if alone.lost(surface.places[i]) <= most_lost:
            taken += 1
            yield Replicate(surface.places[i], alone, as_read, quiet)


def _reading_errors(
    observation: Observation, variance: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.float64]:
    """What a bench adds (3, rows) to the channels of a run with a relative variance (rows,).

    Its noise is such that it shows that of the observation, where only its quietest points do: a
    standard error of few cycles scatters itself, and the least of many is less than the noise.
    """
    sampling = observation.scatter_sampling
    scatter = np.exp(sampling * rng.standard_normal(len(observation)))
    volts = observation.noise_v / np.where(observation.noise > 0.0, observation.noise, np.inf)
    heard = np.sqrt(variance + 2.0 * observation.noise**2) * scatter * volts
    shown = estimate_noise(heard, sampling)
    noise = observation.noise * np.clip(observation.noise_v / shown, 1.0, _LOUDEST)
    total = variance + 2.0 * noise**2
    share = 2.0 * noise**2 / total
    log_scatter = 0.5 * np.log(total / (variance + 2.0 * observation.noise**2))
    return np.vstack(
        [rng.standard_normal((2, len(noise))) * noise, log_scatter + share * np.log(scatter)]
    )
