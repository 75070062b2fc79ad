"""Measurements of the little world, and what is judged of them."""

import numpy as np
from worlds.synthetic import candidate, observation, read

from analysis.checking.goodness_of_fit import Adequacy
from analysis.emulation.likelihood import TEMPERATURE
from analysis.selection.verdict import judge_candidates

TRUE, WRONG = ("load-inertia",), ("shaft-stiffness",)
FITS = Adequacy(0.0, 0.0)
SETS = ((), TRUE, WRONG, ("cable-stiffness",), ("amplifier-gain",))


def seen(effects, seed, size=0.5):
    return observation(read(effects, np.array([0.5, size]), np.random.default_rng(seed)))


def judge(observed, sets=SETS, seed=0, scores=None):
    """What is judged of sets; `scores` in place of those that their runs would give them."""
    found = [candidate(observed, effects, seed + i) for i, effects in enumerate(sets)]
    found.sort(key=lambda c: -c.best.log_likelihood)
    return judge_candidates(
        found, observed, np.random.default_rng(seed), odds(scores or likelihoods(found))
    )


def odds(scores):
    """Log odds of scores."""
    return {key: score / TEMPERATURE for key, score in scores.items()}


def likelihoods(found):
    """Scores by the likelihood alone, as if no network had been asked."""
    return {one.hypothesis.effects: one.best.log_likelihood for one in found}
