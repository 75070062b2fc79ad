"""From simulated machines whose truth is known to an estimate and an honest error bar.

Owns the step from draws to a place and its uncertainty. Points of a sweep err
together, along branches of a chaotic motion, so that the curvature of a
likelihood promises too much. Here a regression learns the free numbers from
the channels of simulated runs, each run is predicted by a regression that has
not seen it, and the spread of what that gets wrong is the error bar. What nobody
knows of a bench differs from run to run, so that the bar holds it too. It runs
no simulation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotri  # pyright: ignore[reportAttributeAccessIssue] # not in the stubs

from analysis.emulation.noise_level import draw_noises
from analysis.ensemble.runs import Population
from analysis.observation.observation import Observation, channels_of_readings

__all__ = ["NEAREST", "ParameterPosterior", "calibrate"]

_RIDGES = (0.003, 0.01, 0.03, 0.1, 0.3)
_FLOOR = 0.03
"""Scatter below which a channel is not trusted to be known, in log units."""

_SQUASH = 0.6
_REACH = 2.0
_MARGIN = 1.3
"""Factor on stated errors: machines drawn anew were missed by so much more than those left out."""

NEAREST = 180
"""Runs that take part, if not told otherwise: the answer is learned where it lies."""

_WITHIN = 3.0
"""Runs that lie so many standard deviations about the first answer all take part with caution."""


@dataclass(frozen=True, slots=True, eq=False)
class ParameterPosterior:
    """Estimate of the free numbers: `mean` (d,) and `covariance` (d, d)."""

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]

    def density(self, grid: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weights over places (count, d) that sum to one; what lies outside the grid is cut."""
        offset = grid - self.mean
        distance = np.einsum("id,de,ie->i", offset, np.linalg.inv(self.covariance), offset)
        weight = np.exp(-0.5 * (distance - distance.min()))
        return np.asarray(weight / weight.sum())

    def sigma_points(
        self, low: NDArray[np.float64], high: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Places (2 d, d) with this mean and covariance (Julier and Uhlmann 2004), cut to bounds.

        `low`, `high` (d,).
        """
        sizes, ways = np.linalg.eigh(self.covariance)
        steps = ways * np.sqrt(len(sizes) * np.maximum(sizes, 0.0))
        return np.clip(self.mean + np.concatenate([steps.T, -steps.T]), low, high)


def calibrate(
    observation: Observation,
    runs: Population,
    width: NDArray[np.float64],
    gain: float,
    rng: np.random.Generator,
    *,
    nearest: int = NEAREST,
    cautious: bool = False,
) -> ParameterPosterior:
    """Estimate the place of an observation among runs.

    Kernel ridge regression from squashed channels to places, its ridge chosen by what it gets
    wrong about machines left out, first among all runs, then among the nearest. `width` (d,):
    distance over which the response changes smoothly. `gain`: one standard deviation of what scales
    the whole response, as a share.

    Parameters
    ----------
    nearest
        How many of the runs take part in the second.
    cautious
        Allow for a sweep that tells little. Runs then differ in what a stated error is itself off
        by, as the scatter says nothing else where all of a motion repeats itself; and all runs
        that may be the answer count among the nearest, as one that is hardly known would seem to
        be known as well as those lie close together.
    """
    readings = _readings(
        observation, runs, gain, rng, observation.scatter_sampling if cautious else 0.0
    )
    kin = _kin(runs.deviations)
    first = _regress(observation, readings, runs.places, kin)
    distance = np.abs((runs.places - first.mean) / width).max(axis=1)
    count = nearest
    if cautious:
        reach = _WITHIN * np.sqrt(np.diag(first.covariance))
        possible = np.all(np.abs(runs.places - first.mean) <= reach, axis=1)
        count = max(count, int(np.count_nonzero(possible)))
    if count >= len(runs):
        return first
    near = np.sort(np.argsort(distance, kind="stable")[:count])
    return _regress(observation, readings[near], runs.places[near], kin[near])


def _kin(deviations: NDArray[np.float64]) -> NDArray[np.int64]:
    """Label (runs,): machines that share their deviations share it, the rest stand alone."""
    _, label = np.unique(deviations, axis=0, return_inverse=True)
    label = np.asarray(label, dtype=np.int64).reshape(-1)
    alone = ~np.any(deviations != 0.0, axis=1)
    label[alone] = label.max(initial=0) + 1 + np.arange(np.count_nonzero(alone))
    return label


def _readings(
    observation: Observation,
    runs: Population,
    gain: float,
    rng: np.random.Generator,
    sampled: float,
) -> NDArray[np.float64]:
    """Channels of the runs with what a bench adds: reading noise and the tachometer's spread.

    And what its stated errors are off by, where they are those of the reading and not of a motion
    whose cycles were counted: each by its own, and all of them as the least ones tell the noise.
    """
    noises = draw_noises(observation, len(runs), rng)[:, None]
    if sampled:
        noises = noises * np.exp(sampled * rng.standard_normal(noises.shape))
    noise = observation.noise * (noises / observation.noise_v)
    values = channels_of_readings(runs.mean, runs.variance, noise, observation.floor)
    if sampled:
        share = 2.0 * noise**2 / (runs.variance + 2.0 * noise**2)
        values[:, 2] += sampled * share * rng.standard_normal(share.shape)
    values[:, 0] += rng.normal(0.0, gain, (len(values), 1))
    values[:, :2] += rng.standard_normal(values[:, :2].shape) * noise[:, None]
    return values


def _regress(
    observation: Observation,
    readings: NDArray[np.float64],
    places: NDArray[np.float64],
    kin: NDArray[np.int64],
) -> ParameterPosterior:
    features, asked = _features(observation, readings)
    count = len(features)
    # One product of matrices: all pairs of features at once would be hundreds of megabytes.
    square = (features**2).sum(axis=-1)
    apart = (square[:, None] + square - 2.0 * features @ features.T) / features.shape[1]
    scale = _REACH * float(np.median(apart[np.triu_indices(count, 1)])) + 1e-12
    kernel = np.exp(-apart / scale)
    likeness = np.exp(-((features - asked) ** 2).mean(axis=-1) / scale)
    centre = places.mean(axis=0)
    spread = places.std(axis=0) + 1e-12
    families = [np.flatnonzero(kin == label) for label in np.unique(kin)]

    def fitted(ridge: float) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        inverse = _inverse(kernel + ridge * np.eye(count))
        dual = inverse @ (places - centre)
        # What a regression without a machine and its kin gets wrong about it, in
        # closed form: machines with the same deviations would give them away.
        error = np.empty_like(dual)
        for family in families:
            error[family] = np.linalg.solve(inverse[np.ix_(family, family)], dual[family])
        return float(np.sum((error / spread) ** 2)), centre + likeness @ dual, error

    _, mean, error = min((fitted(ridge) for ridge in _RIDGES), key=lambda fit: fit[0])
    weight = likeness / likeness.max()
    effective = weight.sum() ** 2 / np.sum(weight**2)
    covariance = (error * weight[:, None]).T @ error / weight.sum()
    inflation = _MARGIN**2 * (1.0 + 2.0 / effective)
    return ParameterPosterior(
        mean, np.atleast_2d(covariance * inflation) + np.diag((1e-3 * spread) ** 2)
    )


def _inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a symmetric, positive matrix: half of what one costs that takes it for any."""
    factor, failed = dpotrf(matrix, lower=True)
    half, _ = dpotri(factor, lower=True)
    if failed:
        raise np.linalg.LinAlgError("the kernel of the runs is not positive")
    return np.asarray(half + np.tril(half, -1).T)


def _features(
    observation: Observation, readings: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Channels as numbers of order one: of the runs (runs, seen) and of the observation."""
    values, asked = readings.copy(), observation.values.copy()
    turn = np.angle(np.mean(np.exp(1j * values[:, 1]), axis=0))
    values[:, 1] = np.angle(np.exp(1j * (values[:, 1] - turn)))
    asked[1] = np.angle(np.exp(1j * (asked[1] - turn)))
    seen = np.isfinite(asked)
    flat, one = values[:, seen], asked[seen]
    centre = np.median(flat, axis=0)
    scale = np.hypot(1.4826 * np.median(np.abs(flat - centre), axis=0), _FLOOR)
    # A squashed channel cannot outvote the rest from a chaotic point.
    return np.tanh(_SQUASH * (flat - centre) / scale), np.tanh(_SQUASH * (one - centre) / scale)
