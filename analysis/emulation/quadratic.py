"""What a machine would show, between the machines that were simulated.

Owns local regression over draws: near a place in parameter space it tells the
mean of every channel, how single runs scatter about it, and how the mean
follows small deviations of datasheet values. Motion with play is not
repeatable, so a prediction is a distribution; it never runs a simulation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.errors import AnalysisError

__all__ = ["TAIL_FREEDOM", "QuadraticEmulator", "Prediction"]

TAIL_FREEDOM = 4.0
"""Degrees of freedom of Student's t, for the scatter of single runs."""

_FIT_ITERATIONS = 10
_SPARE_DRAWS = 6
_WIDENINGS = 1.25 ** np.arange(10)
_SMOOTHING_ROWS = 2
_LEAST_STD = np.array([1e-4, 1e-4, 0.05])
"""Least scatter of a single run believed, by channel: the regression itself is no better."""


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """Distribution of one run at one place, channels x rows.

    `mean`, `std` (3, rows): centre and scale of Student's t for a single run,
    the regression's own uncertainty included. `slopes` (k, 3, rows): change of
    the mean per unit of each deviation, the last one a common factor of the gain;
    `sigmas` (k,) their prior standard deviations. `runs` (near, 3, rows): single runs
    brought to this place, less the mean, and `shares` (near,) their weights:
    they show the branches between which the motion may choose.
    """

    mean: NDArray[np.float64]
    std: NDArray[np.float64]
    slopes: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    runs: NDArray[np.float64]
    shares: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class QuadraticEmulator:
    """Draws over places, with small deviations on top.

    Parameters
    ----------
    places
        (draws, d): where each machine stands, in coordinates of order one.
    deviations
        (draws, k): small relative deviations of datasheet values.
    channels
        (draws, 3, rows).
    blocks
        Rows that lie next to each other in one sweep, as slices: scatter is
        smoothed within them.
    width
        (d,): distance over which the response changes smoothly.
    sigmas
        (k,): prior standard deviation of each deviation.
    gain
        That of the tachometer's gain, which scales the whole response, as a share.
    """

    places: NDArray[np.float64]
    deviations: NDArray[np.float64]
    channels: NDArray[np.float64]
    blocks: tuple[slice, ...]
    width: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    gain: float

    def predict(self, place: NDArray[np.float64]) -> Prediction:
        """Local quadratic regression about `place` (d,).

        Raises
        ------
        AnalysisError
            If too few draws lie within reach.
        """
        offset, near, w = self._neighbours(place)
        basis = _basis(offset, self.deviations[near])
        count, terms = basis.shape
        # The phase may turn past 180 degrees; differences to a near draw may not.
        values = self._unwrapped(near, int(np.argmax(w)))
        shape = values.shape[1:]
        fit = _fit_tailed(basis, w, values.reshape(count, -1))
        variance = self._smoothed(fit.variance.reshape(shape))
        std = np.sqrt(variance * (1.0 + fit.leverage) + _LEAST_STD[:, None] ** 2)
        k = self.deviations.shape[1]
        slopes = np.zeros((k + 1, *shape))
        slopes[:k] = fit.coefficients[terms - k :].reshape((k, *shape))
        slopes[k, 0] = 1.0
        return Prediction(
            mean=fit.coefficients[0].reshape(shape),
            std=std,
            slopes=slopes,
            sigmas=np.append(self.sigmas, self.gain),
            runs=(values.reshape(count, -1) - basis @ fit.coefficients).reshape(count, *shape),
            shares=w / w.sum(),
        )

    def _neighbours(
        self, place: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.float64]]:
        """Offsets, choice and weights of near draws; the reach grows until they suffice."""
        d = self.places.shape[1]
        needed = 1 + d + d * (d + 1) // 2 + self.deviations.shape[1] + _SPARE_DRAWS
        for widening in _WIDENINGS:
            offset = (self.places - place) / (self.width * widening)
            distance = np.sqrt(np.sum(offset**2, axis=1))
            weight = np.clip(1.0 - (distance / 2.0) ** 3, 0.0, None) ** 3
            if weight.sum() >= needed:
                break
        else:
            raise AnalysisError(
                f"only {np.count_nonzero(weight > 0)} simulated machines lie near a place that "
                f"needs {needed}"
            )
        near = weight > 1e-6
        return offset[near], near, weight[near]

    def _unwrapped(self, near: NDArray[np.bool_], anchor: int) -> NDArray[np.float64]:
        values = self.channels[near].copy()
        turn = values[:, 1] - values[anchor, 1]
        values[:, 1] -= 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
        return values

    def _smoothed(self, variance: NDArray[np.float64]) -> NDArray[np.float64]:
        """Variance averaged over neighbouring frequencies: a few draws tell little of it."""
        smooth = np.empty_like(variance)
        for block in self.blocks:
            part = variance[:, block]
            total, count = np.zeros_like(part), np.zeros(part.shape[1])
            for shift in range(-_SMOOTHING_ROWS, _SMOOTHING_ROWS + 1):
                share = 1.0 / (1.0 + abs(shift))
                source = slice(max(shift, 0), part.shape[1] + min(shift, 0))
                target = slice(max(-shift, 0), part.shape[1] + min(-shift, 0))
                total[:, target] += share * part[:, source]
                count[target] += share
            smooth[:, block] = total / count
        return smooth


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    coefficients: NDArray[np.float64]
    variance: NDArray[np.float64]
    leverage: float


def _fit_tailed(
    basis: NDArray[np.float64], weight: NDArray[np.float64], values: NDArray[np.float64]
) -> _Fit:
    """Regression with Student's t errors, column by column; values are (draws, columns).

    A run that fell onto another branch of the motion is far off in whole
    stretches of the sweep. It must neither pull the mean nor blow up the scale.
    """
    count, terms = basis.shape
    products = (basis[:, :, None] * basis[:, None, :]).reshape(count, terms * terms)
    trust = np.repeat(weight[:, None], values.shape[1], axis=1)
    for iteration in range(_FIT_ITERATIONS):
        normal = (products.T @ trust).T.reshape(-1, terms, terms)
        diagonal = np.einsum("cii->ci", normal)
        diagonal += 1e-9 * diagonal + 1e-12
        right = (basis.T @ (trust * values)).T[..., None]
        coefficients = np.linalg.solve(normal, right)[..., 0].T
        residual = values - basis @ coefficients
        if iteration == 0:
            scale = (1.4826 * np.median(np.abs(residual), axis=0)) ** 2 + 1e-14
        z2 = residual**2 / scale
        tail = (TAIL_FREEDOM + 1.0) / (TAIL_FREEDOM + z2)
        trust = weight[:, None] * tail
        scale = (trust * residual**2).sum(axis=0) / weight.sum() + 1e-14
    plain = (basis * weight[:, None]).T @ basis + 1e-12 * np.eye(terms)
    hat = np.linalg.solve(plain, (basis * weight[:, None]).T)
    used = float(np.einsum("ij,ji->", hat, basis * weight[:, None]))
    total = float(weight.sum())
    variance = np.asarray(scale * total / max(total - used, 1.0), dtype=float)
    leverage = float(hat[0] @ hat[0])
    return _Fit(np.asarray(coefficients, dtype=float), variance, leverage)


def _basis(offset: NDArray[np.float64], deviations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Constant, linear and quadratic terms of the offset, then the deviations."""
    count, d = offset.shape
    cross = [offset[:, i] * offset[:, j] for i in range(d) for j in range(i, d)]
    return np.column_stack([np.ones(count), offset, *cross, deviations])
