"""What an estimator is worth: tried on simulated machines whose truth is known.

Owns the step from a likelihood to an honest interval. Points of a sweep err
together, along branches of a chaotic motion, so that curvature of a likelihood
promises too much. Here the estimators meet runs they have not seen, the best
combination of them is learned, and the spread of what it gets wrong is the
error bar. It runs no simulation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.emulator import GAIN_TOLERANCE, Emulator
from analysis.likelihood import match_prediction
from analysis.observation import Observation

__all__ = ["Calibrated", "calibrate"]

_FOLDS = 4
_PLACES = 25
_TEMPER = 0.1
_RIDGE = 0.02
_FLOOR = 0.05
_NEAREST = 96
"""Runs that take part: the answer is learned where it lies."""


@dataclass(frozen=True, slots=True, eq=False)
class Calibrated:
    """Estimate of the free numbers: `mean` (d,) and `covariance` (d, d)."""

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]

    def density(self, grid: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weights over places (count, d) that sum to one; what lies outside the grid is cut."""
        offset = grid - self.mean
        distance = np.einsum("id,de,ie->i", offset, np.linalg.inv(self.covariance), offset)
        weight = np.exp(-0.5 * (distance - distance.min()))
        return np.asarray(weight / weight.sum())


def calibrate(observation: Observation, emulator: Emulator, rng: np.random.Generator) -> Calibrated:
    """Estimate the place of an observation among the draws of an emulator.

    Two estimators, each kept from seeing what it is tried on: the mean of the
    tempered likelihood over places (one free number only), and a ridge
    regression of the place on all channels. A linear combination of both is
    fitted on the draws.
    """
    first = _ridge(observation, emulator, _readings(observation, emulator, rng), None)
    distance = np.abs((emulator.places - first.observed) / emulator.width).max(axis=1)
    near = np.sort(np.argsort(distance, kind="stable")[:_NEAREST])
    readings = _readings(observation, emulator, rng)
    summaries = [_ridge(observation, emulator, readings, near)]
    if emulator.places.shape[1] == 1:
        summaries.append(_likelihood_means(observation, emulator, readings, near, rng))
    truth = emulator.places[near]
    learned = np.column_stack([np.ones(len(near)), *(s.tried for s in summaries)])
    asked = np.concatenate([[1.0], *(s.observed for s in summaries)])
    normal = learned.T @ learned + 1e-6 * len(near) * np.eye(learned.shape[1])
    combination = np.linalg.solve(normal, learned.T @ truth)
    error = truth - learned @ combination
    freedom = len(near) - learned.shape[1]
    covariance = np.atleast_2d(error.T @ error / freedom) * (1.0 + learned.shape[1] / len(near))
    return Calibrated(asked @ combination, covariance + np.diag((1e-3 * emulator.width) ** 2))


@dataclass(frozen=True, slots=True, eq=False)
class _Summary:
    """An estimator's answers: for draws it had not seen (near, d), and for the observation (d,)."""

    tried: NDArray[np.float64]
    observed: NDArray[np.float64]


def _readings(
    observation: Observation, emulator: Emulator, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Channels of the draws with what a bench adds: reading noise and the tachometer's spread."""
    values = emulator.channels.copy()
    values[:, 0] += rng.normal(0.0, GAIN_TOLERANCE, (len(values), 1))
    values[:, :2] += rng.standard_normal(values[:, :2].shape) * observation.noise
    return values


def _ridge(
    observation: Observation,
    emulator: Emulator,
    readings: NDArray[np.float64],
    near: NDArray[np.int64] | None,
) -> _Summary:
    """Regression of the place on squashed channels, with leave-one-out answers in closed form."""
    picked = np.arange(len(readings)) if near is None else near
    values, asked = readings[picked].copy(), observation.values.copy()
    turn = np.angle(np.mean(np.exp(1j * values[:, 1]), axis=0))
    values[:, 1] = np.angle(np.exp(1j * (values[:, 1] - turn)))
    asked[1] = np.angle(np.exp(1j * (asked[1] - turn)))
    seen = np.isfinite(asked)
    flat, one = values[:, seen], asked[seen]
    centre = np.median(flat, axis=0)
    scale = np.hypot(1.4826 * np.median(np.abs(flat - centre), axis=0), _FLOOR)
    # A squashed channel cannot outvote the rest from a chaotic point.
    features, feature = (
        np.tanh(0.5 * (flat - centre) / scale),
        np.tanh(0.5 * (one - centre) / scale),
    )
    kernel = features @ features.T / flat.shape[1] + _RIDGE * np.eye(len(flat))
    inverse = np.linalg.inv(kernel)
    truth = emulator.places[picked]
    mean = truth.mean(axis=0)
    dual = inverse @ (truth - mean)
    tried = truth - dual / np.diag(inverse)[:, None]
    return _Summary(tried, mean + (features @ feature / flat.shape[1]) @ dual)


def _likelihood_means(
    observation: Observation,
    emulator: Emulator,
    readings: NDArray[np.float64],
    near: NDArray[np.int64],
    rng: np.random.Generator,
) -> _Summary:
    """Mean place under the tempered likelihood; each fold of draws meets an emulator without it."""
    truth = emulator.places[near, 0]
    places = np.linspace(truth.min(), truth.max(), _PLACES)
    fold = rng.permutation(len(near)) % _FOLDS
    tried, observed = np.empty(len(near)), np.empty(_FOLDS)
    for f in range(_FOLDS):
        blind = emulator.without(near[fold == f])
        predictions = [blind.predict(np.array([place])) for place in places]

        def mean_place(values: NDArray[np.float64], predictions: list = predictions) -> float:
            asked = replace(observation, values=values)
            log_likelihood = np.array(
                [match_prediction(asked, p, branching=False).log_likelihood for p in predictions]
            )
            weight = np.exp(_TEMPER * (log_likelihood - log_likelihood.max()))
            return float(weight @ places / weight.sum())

        for i in np.flatnonzero(fold == f):
            unseen = np.where(np.isfinite(observation.values), readings[near[i]], np.nan)
            tried[i] = mean_place(unseen)
        observed[f] = mean_place(observation.values)
    return _Summary(tried[:, None], np.array([observed.mean()]))
