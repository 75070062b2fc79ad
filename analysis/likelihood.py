"""How well a prediction explains an observation.

Owns one likelihood: Student's t for every channel, with the scatter of single
runs, the noise of the reading, the logarithm of both, and datasheet tolerances
as priors that are fitted away. Heavy tails because a point with chaotic motion
can lie far out; the log-variance term because without it a machine whose
simulation scatters most would explain everything. And because the motion may
hold to one of several branches over a stretch of the sweep, each short segment
may be explained by the common run of machines or by any single one of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from analysis.emulator import TAIL_FREEDOM, Prediction
from analysis.observation import Observation

__all__ = ["Match", "match_prediction"]

_ITERATIONS = 12


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


def match_prediction(
    observation: Observation,
    prediction: Prediction,
    sigmas: NDArray[np.float64],
    weight: float = 1.0,
) -> Match:
    """Likelihood of an observation under a prediction.

    Parameters
    ----------
    observation, prediction
        Rows in the same order.
    sigmas
        (k,): prior standard deviation of each deviation whose slope the
        prediction gives.
    weight
        Share of independent information in a row; below 1 where neighbouring
        points err together.
    """
    difference = observation.values - prediction.mean
    difference[1] = np.angle(np.exp(1j * difference[1]))
    std = prediction.std.copy()
    std[:2] = np.sqrt(std[:2] ** 2 + observation.noise**2)
    seen = np.isfinite(difference)
    y, s = difference[seen], std[seen]
    slopes = prediction.slopes[:, seen]
    best = np.zeros(len(sigmas))
    precision = np.diag(1.0 / sigmas**2)
    for _ in range(_ITERATIONS):
        z2 = ((y - best @ slopes) / s) ** 2
        trust = weight * (TAIL_FREEDOM + 1.0) / (TAIL_FREEDOM + z2) / s**2
        normal = (slopes * trust) @ slopes.T + precision
        best = np.linalg.solve(normal, (slopes * trust) @ y)
    residual = difference - np.tensordot(best, prediction.slopes, axes=1)
    main = _by_segment(_log_tailed(residual, std), observation.segments)
    apart = _log_tailed(residual - prediction.runs, std)
    singly = np.log(prediction.shares)[:, None] + _by_segment(apart, observation.segments)
    total = weight * np.logaddexp(main, logsumexp(singly, axis=0)).sum()
    _, log_det = np.linalg.slogdet(normal @ np.diag(sigmas**2))
    total -= 0.5 * np.sum((best / sigmas) ** 2) + 0.5 * log_det
    return Match(float(total), best, residual, np.where(seen, std, np.nan))


def _log_tailed(residual: NDArray[np.float64], std: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log density of Student's t up to a constant; 0 where nothing was observed."""
    log_density = -0.5 * (TAIL_FREEDOM + 1.0) * np.log1p((residual / std) ** 2 / TAIL_FREEDOM)
    return np.where(np.isfinite(residual), log_density - np.log(std), 0.0)


def _by_segment(
    log_density: NDArray[np.float64], segments: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Sums (..., segments) over channels and the rows of each segment."""
    return np.add.reduceat(log_density.sum(axis=-2), segments, axis=-1)
