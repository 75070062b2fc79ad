"""Local regression: the value at a point, and its error, from weighted runs around it.

Owns the arithmetic of many small regressions at once. It knows neither what
the runs are nor how near they have to be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["TAIL", "TAIL_SCALE", "Planes", "fit_planes", "regress"]

_RIDGE = 0.1
"""Ridge of the slopes, in units of the kernel's reach: few runs must not make a wild slope."""

TAIL = 4.0
"""Degrees of freedom of Student's t, whose variance is TAIL / (TAIL - 2) of its scale squared."""

TAIL_SCALE = float(np.sqrt((TAIL - 2.0) / TAIL))

_TAIL_ITERATIONS = 5


@dataclass(frozen=True, slots=True, eq=False)
class Planes:
    """Fits of values by planes, p problems with c columns over n runs.

    `coefficients` (p, c, 1 + k): value and slopes; `squares` (p, c, n): of what is
    left of every run; `weighed` (p, 1 + k, n): weights times basis; `inverse`
    (p, 1 + k, 1 + k): of the normal matrix.
    """

    coefficients: NDArray[np.float64]
    squares: NDArray[np.float64]
    weighed: NDArray[np.float64]
    inverse: NDArray[np.float64]


def fit_planes(
    offset: NDArray[np.float64],
    weight: NDArray[np.float64],
    ridge: NDArray[np.float64],
    values: NDArray,
) -> Planes:
    """Planes through values (p, c, n) at offsets (1 or p, n, k), with weights (p, n).

    `ridge` (p,) holds the slopes.
    """
    count, n, k = offset.shape
    one = np.ones((count, 1, n), values.dtype)
    basis = np.concatenate([one, offset.transpose(0, 2, 1)], axis=1, dtype=values.dtype)
    weighed = basis * weight[:, None].astype(values.dtype, copy=False)
    diagonal = np.column_stack([np.full(len(ridge), 1e-9), np.tile(ridge, (k, 1)).T])
    normal = weighed @ basis.transpose(0, 2, 1) + diagonal[:, :, None] * np.eye(k + 1)
    inverse = np.linalg.inv(normal).astype(values.dtype)
    coefficients = values @ weighed.transpose(0, 2, 1) @ inverse
    squares = coefficients @ basis
    np.subtract(values, squares, out=squares)
    np.square(squares, out=squares)
    return Planes(coefficients, squares, weighed, inverse)


def regress(
    offset: NDArray[np.float64],
    weight: NDArray[np.float64],
    reach: NDArray[np.float64],
    values: NDArray,
    *,
    tailed: bool,
) -> tuple[NDArray, NDArray]:
    """Value and variance (p, c) at offset 0 of p regressions with c columns each.

    Parameters
    ----------
    offset
        (1 or p, n, k): where the runs are, in widths.
    weight, reach
        (p, n), (p,): how much each counts, and how far the kernel reaches, in widths.
    values
        (p, c, n); the arithmetic has their precision.
    tailed
        Whether the scatter is that of Student's t, which a few runs far out do not
        blow up (slower), or a mean square.
    """
    # The ridge is for slopes in units of the kernel's reach.
    planes = fit_planes(offset, weight, _RIDGE * reach**2, values)
    squares, weighed, inverse = planes.squares, planes.weighed, planes.inverse
    w = weight[:, None].astype(values.dtype, copy=False)
    total, most = w.sum(axis=2), w * squares
    variance = most.sum(axis=2) / total
    # New arrays of this size would be asked of the system, and cost more than what fills them.
    share = np.empty_like(most)
    for _ in range(_TAIL_ITERATIONS if tailed else 0):
        bound = TAIL * (TAIL_SCALE**2 * variance + 1e-12)
        np.add(squares, bound[:, :, None], out=share)
        np.divide(most, share, out=share)
        variance = (TAIL + 1.0) * variance * share.sum(axis=2) / total
    used = (inverse * (weighed @ weighed.transpose(0, 2, 1))).sum(axis=(1, 2))[:, None]
    variance *= total / np.maximum(total - used, 0.3 * total)
    leverage = ((inverse[:, :1] @ weighed) ** 2).sum(axis=2)
    variance *= 1.0 + leverage
    return planes.coefficients[:, :, 0], variance
