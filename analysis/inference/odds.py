"""Posterior odds of a set of causes: the network's probability times a power of the likelihood.

Owns the weight of the two. Refinement and verdict rank sets by it; which of
tied ones leads is decided in `analysis.selection.verdict`. It names nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from analysis.emulation.fitted_model import Effects, FittedModel
from analysis.emulation.likelihood import TEMPERATURE

__all__ = ["log_odds"]

_LEAST_PROBABILITY = 1e-6
"""What the network holds for less likely than this it has not learned."""


def log_odds(candidate: FittedModel, log_prior: Mapping[Effects, float]) -> float:
    """Log odds of a candidate, but for a constant that all candidates of one observation share.

    Parameters
    ----------
    log_prior
        Logarithm of the network's probability by set. A set without one is as likely as can be.
    """
    least = float(np.log(_LEAST_PROBABILITY))
    prior = max(log_prior.get(candidate.hypothesis.effects, 0.0), least)
    return float(candidate.best.log_likelihood / TEMPERATURE + prior)
