"""Whether an observation looks like one of a hypothesis's own runs.

Owns the tests behind "unexplained" (does it fit, as own runs do, and leave no more structure) and
the one behind "consistent": whether
what a cause explains better is more than it would explain by chance where
nothing is hidden. All take a hypothesis's own runs as if they had been
observed. It ranks no hypotheses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.checking.lack_of_fit import judge_structure
from analysis.checking.replicates import FEWEST_RUNS, Replicate, replicates_of
from analysis.emulation.fitted_model import FittedModel
from analysis.execution.executor import side_by_side

__all__ = ["Adequacy", "judge_adequacy", "judge_chance"]

_TRIES = 2


@dataclass(frozen=True, slots=True)
class Adequacy:
    """How the fit of an observation compares with those of a hypothesis's own runs.

    `sigma`: by how many standard deviations it is worse, negative where it is
    better than most. `structure`: by how many it leaves more structure. Both are 0 where no runs
    can be compared.
    """

    sigma: float
    structure: float


def judge_adequacy(candidate: FittedModel, rng: np.random.Generator) -> Adequacy:
    """Compare the fit of the observation with the fits of runs of the same hypothesis.

    The runs are given reading noise; each is fitted by the half of the others that deviates
    otherwise (`analysis.checking.replicates`).
    """
    fits = side_by_side(
        lambda run: run.alone.climb(run.place, tries=1), replicates_of(candidate, rng)
    )
    if len(fits) < FEWEST_RUNS:
        # Nearly every run did alone what it did: nothing speaks against the observation.
        return Adequacy(0.0, 0.0)
    surface, best = candidate.surface, candidate.best
    own = [fit.log_likelihood for fit in fits]
    sigma = _worse([best.log_likelihood, *own])
    structure = judge_structure(best, fits, surface.observation, surface.sigmas)
    return Adequacy(sigma, structure)


def _worse(likelihoods: Sequence[float]) -> float:
    """Standard deviations by which the first of some log-likelihoods is less than the others."""
    seen, *own = likelihoods
    centre = np.median(own)
    below = [centre - value for value in own if value <= centre]
    return float((centre - seen) / max(1.4826 * np.median(below), 1e-9))


def judge_chance(simpler: FittedModel, alleged: FittedModel, rng: np.random.Generator) -> float:
    """Share of a hypothesis's own runs that another explains better by as much as it does here.

    A cause with a broad range may imitate one branch of a motion that has
    several: it then fits better than the hypothesis that is true, whose
    expectation is blurred over all branches, and does so for its own runs, too
    (D. R. Cox, "Tests of separate families of hypotheses", 1961).
    """
    seen = alleged.best.log_likelihood - simpler.best.log_likelihood

    def gain(run: Replicate) -> float:
        there = run.seen_by(alleged.surface).climb(alleged.best.place, tries=_TRIES)
        return there.log_likelihood - run.alone.climb(run.place, tries=_TRIES).log_likelihood

    gains = side_by_side(gain, replicates_of(simpler, rng))
    if len(gains) < FEWEST_RUNS:
        return 0.0
    return float(np.mean(np.array(gains) >= seen))
