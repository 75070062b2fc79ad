"""Posterior odds of sets of causes: the network's probability times a power of the likelihood.

Owns the weight of the two. Refinement and verdict rank sets by it; which of
tied ones leads is decided in `analysis.selection.verdict`. It names nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from analysis.emulation.fitted_model import Effects, FittedModel
from analysis.inference.posterior import Posterior
from analysis.inference.summary_likelihood import summarise_runs, summary_likelihoods
from analysis.observation.observation import Observation

__all__ = ["log_odds"]

_LEAST_PROBABILITY = 1e-6
"""What the network holds for less likely than this it has not learned."""

_SUMMARIES, _POINTS = 0.17, 0.01
"""Weights of the log-likelihoods of the runs' summaries and of all points: logistic regression over
drawn sets. The network has learned from the same summaries already, and neighbouring points err
together."""


def log_odds(
    found: Mapping[Effects, FittedModel],
    posterior: Posterior,
    observation: Observation,
    log_prior: Mapping[Effects, float],
    rng: np.random.Generator,
) -> dict[Effects, float]:
    """Log odds of candidates by set, but for a constant that all share.

    Parameters
    ----------
    log_prior
        Logarithm of the network's probability by set.
    """
    observed = posterior.summary(observation, posterior.scales.prior.unit.tolerances)
    runs = {
        key: summarise_runs(posterior, observation, one.population, rng)
        for key, one in found.items()
    }
    least = float(np.log(_LEAST_PROBABILITY))
    summaries, points = summary_likelihoods(observed, runs), _nested(found)
    return {
        key: max(log_prior[key], least) + _SUMMARIES * summaries[key] + _POINTS * points[key]
        for key in found
    }


def _nested(found: Mapping[Effects, FittedModel]) -> dict[Effects, float]:
    """Log-likelihoods over all points; that of a set is no less than that of any part of it.

    A set holds its parts. With as few runs in more dimensions it is fitted worse than they are.
    """
    single = {key: one.best.log_likelihood for key, one in found.items()}
    return {key: max(single[part] for part in found if set(part) <= set(key)) for key in found}
