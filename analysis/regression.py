"""Local regression: the value at a point, and its error, from weighted runs around it.

Owns the arithmetic of many small regressions at once, compiled, as a diagnosis
asks for tens of thousands of them (but for the planes that widths
are learned from). It knows neither what the runs are nor how near they have to be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.compiling import njit, part

__all__ = ["TAIL", "TAIL_SCALE", "Planes", "fit_planes", "invert", "solve_plane"]

_RIDGE = 0.1
"""Ridge of the slopes, in units of the kernel's reach: few runs must not make a wild slope."""

TAIL = 4.0
"""Degrees of freedom of Student's t, whose variance is TAIL / (TAIL - 2) of its scale squared."""

TAIL_SCALE = float(np.sqrt((TAIL - 2.0) / TAIL))

_TAIL_ITERATIONS = 5

_ANY_ORDER = {"contract", "reassoc", "nsz", "arcp"}
"""Sums may be made in any order: vectors need it. NaN stays NaN."""


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


@njit(nogil=True, error_model="numpy")
def solve_plane(offset, weight, reach, values, tailed, value, variance):
    """Value and variance (c,) at offset 0 of c columns, which are overwritten.

    Parameters
    ----------
    offset
        (n, k): where the runs are, in widths.
    weight, reach
        (n,): how much each counts; how far the kernel reaches, in widths.
    values
        (c, n), single precision, as the arithmetic is.
    tailed
        Whether the scatter is that of Student's t, which a few runs far out do not
        blow up (slower), or a mean square.
    """
    n, k = offset.shape
    near = np.empty(n, np.int64)
    count = 0
    for i in range(n):
        if weight[i] > 0.0:
            near[count] = i
            count += 1
    basis = np.empty((k + 1, count), np.float32)
    w = np.empty(count, np.float32)
    for i in range(count):
        run = near[i]
        w[i] = weight[run]
        basis[0, i] = 1.0
        for j in range(k):
            basis[j + 1, i] = offset[run, j]
    normal, doubly, total = _products(basis, w)
    # The ridge is for slopes in units of the kernel's reach.
    normal[0, 0] += 1e-9
    for j in range(1, k + 1):
        normal[j, j] += _RIDGE * reach * reach
    inverse, _ = invert(normal)
    hat = _hat(inverse, basis, w)
    used, leverage = 0.0, 0.0
    for i in range(k + 1):
        leverage_i = 0.0
        for j in range(k + 1):
            used += inverse[i, j] * doubly[i, j]
            leverage_i += doubly[i, j] * inverse[0, j]
        leverage += leverage_i * inverse[0, i]
    widened = total / max(total - used, 0.3 * total) * (1.0 + leverage)
    v, squares = np.empty(count, np.float32), np.empty(count, np.float32)
    for c in range(len(values)):
        for i in range(count):
            v[i] = values[c, near[i]]
        value[c] = _squares_left(v, basis, hat, squares)
        variance[c] = widened * _spread(squares, w, total, tailed)


@njit(nogil=True, error_model="numpy")
def invert(matrix):
    """Inverse of a small matrix, symmetric and positive, and the logarithm of its determinant."""
    size = len(matrix)
    left, inverse, log_det = np.empty((size, size)), np.zeros((size, size)), 0.0
    for a in range(size):
        inverse[a, a] = 1.0
        for b in range(size):
            left[a, b] = matrix[a, b]
    for a in range(size):
        log_det += np.log(left[a, a])
        per_pivot = 1.0 / left[a, a]
        for c in range(size):
            left[a, c] *= per_pivot
            inverse[a, c] *= per_pivot
        for b in range(size):
            if b != a:
                factor = left[b, a]
                for c in range(size):
                    left[b, c] -= factor * left[a, c]
                    inverse[b, c] -= factor * inverse[a, c]
    return inverse, log_det


@part(fastmath=_ANY_ORDER)
def _products(basis, w):
    """The normal matrix, the same with weights squared, and the sum of the weights."""
    size, count = basis.shape
    normal, doubly = np.empty((size, size)), np.empty((size, size))
    for a in range(size):
        for b in range(a + 1):
            one, two = np.float32(0.0), np.float32(0.0)
            for i in range(count):
                both = w[i] * basis[a, i] * basis[b, i]
                one += both
                two += w[i] * both
            normal[a, b] = normal[b, a] = one
            doubly[a, b] = doubly[b, a] = two
    return normal, doubly, normal[0, 0]


@part(fastmath=_ANY_ORDER)
def _hat(inverse, basis, w):
    """What makes value and slopes of what runs show (1 + k, n)."""
    size, count = basis.shape
    hat = np.zeros((size, count), np.float32)
    for a in range(size):
        for b in range(size):
            share = np.float32(inverse[a, b])
            for i in range(count):
                hat[a, i] += share * w[i] * basis[b, i]
    return hat


@part(fastmath=_ANY_ORDER)
def _squares_left(v, basis, hat, squares):
    """Value of the plane through v (n,); `squares` of what it leaves are overwritten."""
    size, count = basis.shape
    value = np.float32(0.0)
    for i in range(count):
        value += hat[0, i] * v[i]
    for i in range(count):
        squares[i] = v[i] - value
    for a in range(1, size):
        slope = np.float32(0.0)
        for i in range(count):
            slope += hat[a, i] * v[i]
        for i in range(count):
            squares[i] -= slope * basis[a, i]
    for i in range(count):
        squares[i] *= squares[i]
    return value


@part(fastmath=_ANY_ORDER)
def _spread(squares, w, total, tailed):
    """Their weighted mean, or the variance of Student's t that they show."""
    count = len(squares)
    most = np.float32(0.0)
    for i in range(count):
        most += w[i] * squares[i]
    variance = most / total
    if not tailed:
        return variance
    half = count // 2
    for _ in range(_TAIL_ITERATIONS):
        bound = np.float32(TAIL * (TAIL_SCALE**2 * variance + 1e-12))
        share = np.float32(0.0)
        # Two fractions on one denominator: dividing is what takes long.
        for i in range(half):
            x, y = squares[i] + bound, squares[i + half] + bound
            share += (w[i] * squares[i] * y + w[i + half] * squares[i + half] * x) / (x * y)
        for i in range(2 * half, count):
            share += w[i] * squares[i] / (squares[i] + bound)
        variance *= (TAIL + 1.0) * share / total
    return variance
