"""Fits of many values by planes, as many small problems at once.

Owns that arithmetic alone; that of a fit at a place is compiled (`analysis.emulation.kernels`). It
knows neither what the runs are nor how near they have to be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Planes", "fit_planes"]


@dataclass(frozen=True, slots=True, eq=False)
class Planes:
    """Fits of values by planes, p problems with c columns over n runs.

    `coefficients` (p, c, 1 + k): value and slopes; `squares` (p, c, n): of what is
    left of every run.
    """

    coefficients: NDArray[np.float64]
    squares: NDArray[np.float64]


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
    return Planes(coefficients, squares)
