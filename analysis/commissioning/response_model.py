"""The channels of a sweep as a linear function of coordinates, by what simulated drives show.

Owns the slopes, their smoothing along the sweep, and the estimate of coordinates by them. It makes
no posterior and simulates nothing.

Method: a channel of a chaotic drive scatters, and so do slopes that are regressed on some hundred
drives; over a long sweep that is more than what the channels tell. Neighbouring frequencies have
similar slopes: these are a Gaussian process along the sweep (Rasmussen and Williams 2006, 2.2). Its
amplitude is what the slopes have beyond their errors, its length makes them likeliest (5.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

__all__ = ["LEAST_STD", "ResponseModel"]

LEAST_STD = 1e-3
"""Least residual of the logarithm of gain, and rad of phase: that of an analyser's own accuracy."""

_LENGTHS = (0.25, 1.0, 2.0, 4.0)
"""Lengths, in points of the sweep, over which slopes may be alike; the first is none."""

_ALIKE = 2.0
"""Variance of regressed slopes over that of independent drives: those of a family share most
coordinates. With 1 to 2 six sweeps told the same within 0.4 nats, with 5 less."""

_LEAST_SIGNAL = 0.02
"""Least mean square of a slope over its variance: a coordinate that shows nowhere stays regular."""


@dataclass(frozen=True, slots=True, eq=False)
class ResponseModel:
    """Channels as a linear function of coordinates: `centre` (rows,), `slopes` (d, rows).

    `std` (rows,) of what is left; `precision` (d, d) of the coordinates by these channels.
    """

    centre: Vector
    slopes: Vector
    std: Vector
    precision: Vector

    @classmethod
    def fit(
        cls,
        x: Vector,
        y: Vector,
        series: NDArray[np.int64] | None = None,
        others: Sequence[tuple[Vector, Vector]] = (),
    ) -> ResponseModel:
        """The model of drives with coordinates (n, d) and channels (n, rows).

        Parameters
        ----------
        series
            Number (rows,) of the channel and level that each row is of, neighbours of the sweep
            next to each other; slopes are smoothed along each. None: they are not.
        others
            Drives that were drawn elsewhere, which have the slopes in common but not the centre.
        """
        inside = [(a - a.mean(axis=0), b - b.mean(axis=0)) for a, b in ((x, y), *others)]
        design, shown = (np.concatenate(parts) for parts in zip(*inside, strict=True))
        slopes = np.asarray(np.linalg.lstsq(design, shown, rcond=None)[0], dtype=float)
        left = inside[0][1] - inside[0][0] @ slopes
        spare = max(len(x) - 1 - x.shape[1], 1)
        std = np.maximum(np.sqrt(np.sum(left**2, axis=0) / spare), LEAST_STD)
        if series is not None:
            variance = _ALIKE * np.diag(np.linalg.pinv(design.T @ design))
            slopes = std * _smoothed(slopes / std, variance, series)
        centre = y.mean(axis=0) - x.mean(axis=0) @ slopes
        return cls(centre, slopes, std, np.asarray((slopes / std**2) @ slopes.T))

    def estimate(self, y: Vector) -> Vector:
        """Least-squares estimates (n, d) of the coordinates, drawn a little to the middle."""
        right = ((y - self.centre) / self.std**2) @ self.slopes.T
        solved = np.linalg.solve(self.precision + np.eye(len(self.precision)), right.T)
        return np.asarray(solved.T, dtype=float)

    def remainder(self, y: Vector) -> Vector:
        """What the best coordinates leave (n, rows), over its standard deviation."""
        return np.asarray((y - self.centre - self.estimate(y) @ self.slopes) / self.std)


def _smoothed(slopes: Vector, variance: Vector, series: NDArray[np.int64]) -> Vector:
    """Slopes (d, rows) with errors of some variance (d,), smoothed along each series."""
    found = np.empty_like(slopes)
    for one in np.unique(series):
        rows = series == one
        found[:, rows] = _along(slopes[:, rows], variance)
    return found


def _along(slopes: Vector, variance: Vector) -> Vector:
    """The same of one series (d, points)."""
    signal = np.mean(slopes**2, axis=1) - variance
    amplitude = np.maximum(signal, _LEAST_SIGNAL * variance)[:, None]
    best, likeliest = np.empty_like(slopes), np.full(len(slopes), -np.inf)
    for length in _LENGTHS:
        values, vectors = _correlation(slopes.shape[1], length)
        turned, total = slopes @ vectors, amplitude * values + variance[:, None]
        likelihood = -0.5 * np.sum(turned**2 / total + np.log(total), axis=1)
        better = likelihood > likeliest
        likeliest[better] = likelihood[better]
        best[better] = ((turned * amplitude * values / total) @ vectors.T)[better]
    return best


@lru_cache(maxsize=64)
def _correlation(points: int, length: float) -> tuple[Vector, Vector]:
    """Eigenvalues and eigenvectors of the squared-exponential correlation of so many points."""
    place = np.arange(points)
    values, vectors = np.linalg.eigh(np.exp(-0.5 * ((place[:, None] - place) / length) ** 2))
    return np.maximum(values, 0.0), vectors
