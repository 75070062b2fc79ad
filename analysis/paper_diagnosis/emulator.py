"""Features of single runs over ratio and size, learned from scattered runs.

Owns the regression: at any place the centre of what single runs show, how far
they scatter about it, and how often they show the features at all. It
simulates nothing and knows no measurement.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["FREEDOM", "Surface"]

FREEDOM = 8.0
"""Degrees of freedom of Student's t for single runs: some jump to another branch of the motion.

Over 2286 runs left out of their own regression, eight give the tails that were seen.
"""

_REACH = 0.12
"""Width of the kernel in every coordinate, all of which run from 0 to 1."""

_ROUNDS = 5
_NEIGHBOURS_PER_TERM = 5
_ODD = 3.0
_SHRINKING = 10.0
_STIFFNESS = 0.3
"""Pull of slopes to zero, in runs: where there are few, a level is safer than a line."""

_FLOOR = 0.3
"""Least scatter, Hz and dB: runs that agree better than this do so by chance."""


@dataclass(frozen=True)
class Surface:
    """Runs of one hypothesis: places (n, d) in coordinates of order one, features (n, q)."""

    places: NDArray[np.float64]
    features: NDArray[np.float64]

    def joined(self, places: NDArray[np.float64], features: NDArray[np.float64]) -> Surface:
        """The surface with further runs."""
        return Surface(np.vstack([self.places, places]), np.vstack([self.features, features]))

    @cached_property
    def correlation(self) -> NDArray[np.float64]:
        """How the scatter of one feature goes with that of another, shape (q, q)."""
        mean, std, _ = self.predict(self.places)
        residual = (self.features - mean) / std
        whole = residual[np.isfinite(residual).all(axis=1)]
        count, q = len(whole), self.features.shape[1]
        if count <= q:
            return np.eye(q)
        # An odd run must not make a correlation; few runs are told to know little of it.
        found = np.corrcoef(np.clip(whole, -_ODD, _ODD).T)
        share = count / (count + _SHRINKING)
        return np.asarray(share * np.nan_to_num(found) + (1.0 - share) * np.eye(q))

    def predict(
        self, places: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """What single runs show at places (m, d).

        Returns
        -------
        mean, std
            Shape (m, q): centre and scale of Student's t with `FREEDOM`.
        shown
            Shape (m, q): share of runs that show each feature, 0 to 1.

        Local lines in every coordinate, fitted by expectation and maximisation
        for Student's t, so that a run on another branch does not bend them.
        """
        apart = (places[:, None, :] - self.places[None, :, :]) / _REACH
        distance = np.einsum("mnd,mnd->mn", apart, apart)
        kernel = np.exp(-0.5 * distance / self._widening(distance)[:, None])
        seen = np.isfinite(self.features)
        weight = kernel[:, :, None] * seen  # (m, n, q)
        total = kernel.sum(axis=1)[:, None] + 1e-12
        shown = (weight.sum(axis=1) + 0.25) / (total + 0.5)
        mean, std = _local_lines(-apart, np.where(seen, self.features, 0.0), weight)
        return mean, std, shown

    def _widening(self, distance: NDArray[np.float64]) -> NDArray[np.float64]:
        """Square of the factor on the kernel's width that lets in enough runs, (m,)."""
        terms = 1 + self.places.shape[1]
        rank = min(_NEIGHBOURS_PER_TERM * terms, distance.shape[1]) - 1
        return np.maximum(1.0, np.partition(distance, rank, axis=1)[:, rank])


def _local_lines(
    apart: NDArray[np.float64], features: NDArray[np.float64], weight: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Intercepts and scales (m, q) of robust weighted lines; apart (m, n, d)."""
    basis = np.concatenate([np.ones((*apart.shape[:2], 1)), apart], axis=-1)  # (m, n, p)
    places, runs, terms = basis.shape
    squares = (basis[..., :, None] * basis[..., None, :]).reshape(places, runs, terms**2)
    # A feature that no run near by shows still needs numbers; its share shown makes them moot.
    weight = np.ascontiguousarray(weight.transpose(0, 2, 1))  # (m, q, n)
    features = features.T
    count = weight.sum(axis=-1) + 1e-9  # (m, q)
    free = np.maximum(count - 0.5 * terms, 0.25 * count)
    ridge = np.diag([1e-9, *[_STIFFNESS] * (terms - 1)])
    trust = np.ones_like(weight)
    for _ in range(_ROUNDS):
        both = weight * trust
        normal = (both @ squares).reshape(*count.shape, terms, terms) + ridge
        line = np.linalg.solve(normal, ((both * features) @ basis)[..., None])[..., 0]
        residual = features - line @ basis.transpose(0, 2, 1)
        scale = np.sqrt(np.sum(both * residual**2, axis=-1) / free)
        scale = np.maximum(scale, _FLOOR)
        trust = (FREEDOM + 1.0) / (FREEDOM + (residual / scale[..., None]) ** 2)
    leverage = np.linalg.inv(normal)[..., 0, 0]
    wide = scale * np.sqrt(1.0 + np.clip(leverage, 0.0, 4.0))
    return np.asarray(line[..., 0], dtype=float), np.asarray(wide, dtype=float)
