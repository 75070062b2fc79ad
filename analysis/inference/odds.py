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

_LIKELIHOOD = 0.17
"""Weight of the log-likelihood of the runs' summaries. Logistic regression gives 0.18 for 38 drawn
sets, and 0.19 for 16 others: the network has learned from the same summaries already."""


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
    return {
        key: max(log_prior[key], least) + _LIKELIHOOD * likelihood
        for key, likelihood in summary_likelihoods(observed, runs).items()
    }
