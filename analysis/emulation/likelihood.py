"""How well a prediction explains an observation.

Owns the likelihood of an estimate (that of a diagnosis is `analysis.emulation.kernels.agree`) and
the temperature of both: Student's t for every channel, with the scatter of single
runs, the noise of the reading, and the logarithm of both. Datasheet deviations are fitted, with the
tolerances as priors. Heavy tails because a point with chaotic motion
can lie far out; the log-variance term because without it a machine whose
simulation scatters most would explain everything. And because the motion
may keep to one of several branches over a stretch of the sweep, the likelihood
follows branches along it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.quadratic import TAIL_FREEDOM, Prediction
from analysis.observation.observation import Observation

__all__ = ["TEMPERATURE", "Match", "match_prediction"]

TEMPERATURE = 15.0
"""Neighbouring points of a sweep err together: a likelihood counts about so many for one."""

_ITERATIONS = 12

_CHANGE = 0.05
_LOG_STAY, _LOG_CHANGE = np.log(1.0 - _CHANGE), np.log(_CHANGE)
"""Chance per point that a motion changes its branch."""

_LEAST_BRANCH_STD = 0.003
_SCATTER_STD = 0.4
"""Scatter about one single run: of a quiet one, and of the logarithm of the scatter itself."""


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """`log_likelihood` with deviations fitted away; `deviations` (k,) their best values.

    `residual` and `std` (3, rows): what is left at the best deviations, and
    one standard deviation of it; NaN where nothing was observed.
    """

    log_likelihood: float
    deviations: NDArray[np.float64]
    residual: NDArray[np.float64]
    std: NDArray[np.float64]


def match_prediction(observation: Observation, prediction: Prediction) -> Match:
    """Likelihood of an observation under a prediction, rows in the same order."""
    difference = observation.values - prediction.mean
    difference[1] = np.angle(np.exp(1j * difference[1]))
    std = prediction.std.copy()
    std[:2] = np.sqrt(std[:2] ** 2 + observation.noise**2)
    seen = np.isfinite(difference)
    y, s = difference[seen], std[seen]
    slopes, sigmas = prediction.slopes[:, seen], prediction.sigmas
    best: NDArray[np.float64] = np.zeros(len(sigmas))
    precision = np.diag(1.0 / sigmas**2)
    for _ in range(_ITERATIONS):
        z2 = ((y - best @ slopes) / s) ** 2
        trust = (TAIL_FREEDOM + 1.0) / (TAIL_FREEDOM + z2) / s**2
        normal = (slopes * trust) @ slopes.T + precision
        best = np.asarray(np.linalg.solve(normal, (slopes * trust) @ y), dtype=float)
    residual = difference - np.tensordot(best, prediction.slopes, axes=1)
    total = _log_branching(residual, std, prediction, observation)
    _, log_det = np.linalg.slogdet(normal @ np.diag(sigmas**2))
    total -= 0.5 * np.sum((best / sigmas) ** 2) + 0.5 * log_det
    return Match(float(total), best, residual, np.where(seen, std, np.nan))


def _log_branching(
    residual: NDArray[np.float64],
    std: NDArray[np.float64],
    prediction: Prediction,
    observation: Observation,
) -> float:
    """Likelihood of a sweep that may keep to any branch and change it now and then.

    A hidden Markov chain along the sweep: at each row the reading comes from
    the common run of machines, or keeps to what one single run did, within the
    scatter that this run shows itself.
    """
    common = _log_tailed(residual, std).sum(axis=0)
    own = np.exp(prediction.mean[2] + prediction.runs[:, 2])
    single = np.empty_like(prediction.runs)
    single[:, :2] = np.sqrt(own**2 + observation.noise**2 + _LEAST_BRANCH_STD**2)[:, None]
    single[:, 2] = _SCATTER_STD
    alone = _log_tailed(residual - prediction.runs, single).sum(axis=1)
    entry = np.log(np.append(0.5 * prediction.shares, 0.5) + 1e-12)
    log_density = np.concatenate([alone, common[None]])
    total = 0.0
    for block in observation.blocks:
        state = entry
        for row in range(block.start, block.stop):
            if row > block.start:
                state = np.logaddexp(state + _LOG_STAY, entry + _LOG_CHANGE)
            state = state + log_density[:, row]
            norm = np.logaddexp.reduce(state)
            total += norm
            state = state - norm
    return float(total)


def _log_tailed(residual: NDArray[np.float64], std: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log density of Student's t up to a constant; 0 where nothing was observed."""
    log_density = -0.5 * (TAIL_FREEDOM + 1.0) * np.log1p((residual / std) ** 2 / TAIL_FREEDOM)
    return np.where(np.isfinite(residual), log_density - np.log(std), 0.0)
