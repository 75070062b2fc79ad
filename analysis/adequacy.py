"""Whether an observation looks like one of a hypothesis's own runs.

Owns the test behind "unexplained". Points of a sweep err together, so that no
table says how good a good fit is; but the runs of the hypothesis themselves do:
each is taken as if it had been observed and fitted by the others. It compares
no hypotheses.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.candidate import Candidate

__all__ = ["Adequacy", "judge_adequacy"]

_RUNS = 48
"""Runs that are taken in turn as if they had been observed: the nearest to the best place."""


@dataclass(frozen=True, slots=True)
class Adequacy:
    """How the fit of an observation compares with those of a hypothesis's own runs.

    `sigma`: by how many standard deviations it is worse, negative where it is
    better than most. `own`: the runs' log-likelihoods.
    """

    sigma: float
    own: tuple[float, ...]


def judge_adequacy(candidate: Candidate, rng: np.random.Generator) -> Adequacy:
    """Compare the fit of the observation with the fits of runs of the same hypothesis.

    The runs are given reading noise; each is fitted without the group that
    shares its deviations.
    """
    surface, best = candidate.surface, candidate.best
    noise = surface.observation.noise
    distance = np.sum(((surface.places - best.place) / surface.width) ** 2, axis=1)
    near = np.argsort(distance, kind="stable")[:_RUNS]
    families = candidate.population.deviations[:, 0]
    own = []
    for i in near:
        others = families != families[i]
        if not np.any(others):
            continue
        as_read = surface.difference[i].copy()
        as_read[:2] += rng.standard_normal((2, len(noise))) * noise
        moved = _wrapped(surface.difference[others] - as_read)
        alone = replace(surface, places=surface.places[others], difference=moved)
        own.append(alone.climb(surface.places[i], tries=1).log_likelihood)
    centre = float(np.median(own))
    below = [centre - value for value in own if value <= centre]
    spread = 1.4826 * float(np.median(below))
    return Adequacy((centre - best.log_likelihood) / max(spread, 1e-9), tuple(own))


def _wrapped(difference: NDArray[np.float64]) -> NDArray[np.float64]:
    difference = difference.copy()
    difference[:, 1] = np.angle(np.exp(1j * difference[:, 1]))
    return difference
