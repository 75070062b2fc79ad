"""What is expected at a place, and how well an observation agrees with it: the arithmetic.

Owns which runs count there, and how much, and how datasheet values are leaned
on. It is compiled, and lets other threads run beside it, as a diagnosis asks
for tens of thousands of places. What the numbers are is the surface's.
"""

from __future__ import annotations

import numpy as np

from analysis.regression import TAIL, TAIL_SCALE, invert, solve_plane
from sim.compiling import njit

__all__ = [
    "compile_all",
    "expect_alike",
    "expect_by_row",
    "lean",
    "log_densities",
    "total_densities",
    "weigh",
]

_REACHES = 1.3 ** np.arange(-3, 9, dtype=np.float64)
"""Reaches of the kernel, in widths: the first is taken that holds enough runs."""

_ITERATIONS = 6

_TOGETHER = 8
"""Factors of which one logarithm is taken."""

_ANY_ORDER = {"contract", "reassoc", "nsz", "arcp"}


@njit(nogil=True, fastmath={"contract"}, error_model="numpy")
def _weigh_at(squares, alike, enough, weight):
    """Weights (n,) of runs at squared distances, by the first reach that suffices; the reach."""
    n = len(squares)
    reach = _REACHES[0]
    for pick in range(len(_REACHES)):
        reach = _REACHES[pick]
        total = 0.0
        for i in range(n):
            inside = max(1.0 - squares[i] / (4.0 * reach * reach), 0.0)
            weight[i] = inside * inside * alike[i]
            total += weight[i]
        if total >= enough:
            break
    return reach


@njit(nogil=True, cache=True, fastmath={"contract"}, error_model="numpy")
def weigh(squares, enough):
    """Weights (n,) of runs at squared distances, by the first reach that suffices, or the last."""
    weight = np.empty(len(squares))
    _weigh_at(squares, np.ones(len(squares)), enough, weight)
    return weight


@njit(nogil=True, cache=True, error_model="numpy")
def expect_alike(offset, enough, plain, mixed, alike, tailed):
    """Means and variances where runs are as near at one row as at any other.

    Parameters
    ----------
    offset
        (n, k): where the runs are, in widths.
    enough
        Weight of the runs that a regression takes.
    plain
        (columns, n): values of rows that all runs count at.
    mixed, alike
        (rows, 3, n), (rows, n): of the others, and how much each run counts there.
    tailed
        See `analysis.regression.solve_plane`.

    Returns
    -------
    mean, variance of the plain columns (columns,) and of the others (rows, 3), and the weight
    (rows,) that these rest on.
    """
    n = len(offset)
    squares = np.empty(n)
    for i in range(n):
        squares[i] = 0.0
        for j in range(offset.shape[1]):
            squares[i] += offset[i, j] ** 2
    weight = np.empty(n)
    mean, variance = np.empty(len(plain)), np.empty(len(plain))
    if len(plain):
        reach = _weigh_at(squares, np.ones(n), enough, weight)
        solve_plane(offset, weight, reach, plain, tailed, mean, variance)
    means, variances = np.empty((len(mixed), 3)), np.empty((len(mixed), 3))
    rested = np.empty(len(mixed))
    for row in range(len(mixed)):
        reach = _weigh_at(squares, alike[row], enough, weight)
        rested[row] = weight.sum()
        solve_plane(offset, weight, reach, mixed[row], tailed, means[row], variances[row])
    return mean, variance, means, variances, rested


@njit(nogil=True, cache=True, error_model="numpy")
def expect_by_row(offset, near, enough, values, alike, tailed):
    """Means and variances (rows, 3), and the weight (rows,) that they rest on.

    Every row has its own neighbours: `near` (rows, most) says which of the runs. `offset`
    (rows, n, k), `values` (rows, 3, n), `alike` (rows, n).
    """
    rows, n, k = offset.shape
    count = near.shape[1]
    means, variances, rested = np.empty((rows, 3)), np.empty((rows, 3)), np.empty(rows)
    squares, alike_there, weight = np.empty(count), np.empty(count), np.empty(count)
    offset_there, values_there = np.empty((count, k)), np.empty((3, count), values.dtype)
    for row in range(rows):
        for i in range(count):
            run = near[row, i]
            squares[i], alike_there[i] = 0.0, alike[row, run]
            for j in range(k):
                offset_there[i, j] = offset[row, run, j]
                squares[i] += offset[row, run, j] ** 2
            for c in range(3):
                values_there[c, i] = values[row, c, run]
        reach = _weigh_at(squares, alike_there, enough, weight)
        rested[row] = weight.sum()
        solve_plane(offset_there, weight, reach, values_there, tailed, means[row], variances[row])
    return means, variances, rested


@njit(nogil=True, cache=True, fastmath=_ANY_ORDER, error_model="numpy")
def lean(apart, std, slope, sigmas, seen):
    """Datasheet deviations that bring expectations closest, and what they cost.

    Parameters
    ----------
    apart, std
        (columns,): observed minus expected, and its standard deviation.
    slope
        (k, columns): what a deviation does.
    sigmas
        (k,): standard deviations of the deviations.
    seen
        (columns,): which columns count.

    Returns
    -------
    The deviations (k,), and the logarithm of their prior, the width of what they leave open
    included.
    """
    k, columns = slope.shape
    best, normal = np.zeros(k), np.zeros((k, k))
    trust, left = np.empty(columns), np.empty(columns)
    for _ in range(_ITERATIONS):
        for c in range(columns):
            left[c] = apart[c] if seen[c] else 0.0
        for a in range(k):
            for c in range(columns):
                left[c] -= best[a] * slope[a, c]
        for c in range(columns):
            scale = TAIL_SCALE * std[c]
            trust[c] = (TAIL + 1.0) / (TAIL * scale * scale + left[c] * left[c])
            if not seen[c]:
                trust[c] = 0.0
        right = np.zeros(k)
        for a in range(k):
            for b in range(a + 1):
                total = 0.0
                for c in range(columns):
                    total += trust[c] * slope[a, c] * slope[b, c]
                normal[a, b] = normal[b, a] = total
            total = 0.0
            for c in range(columns):
                total += trust[c] * slope[a, c] * (apart[c] if seen[c] else 0.0)
            right[a] = total
            normal[a, a] += 1.0 / sigmas[a] ** 2
        inverse, log_det = invert(normal)
        for a in range(k):
            best[a] = 0.0
            for b in range(k):
                best[a] += inverse[a, b] * right[b]
    log_prior = -0.5 * log_det
    for a in range(k):
        log_prior -= np.log(sigmas[a]) + 0.5 * (best[a] / sigmas[a]) ** 2
    return best, log_prior


@njit(nogil=True, cache=True, fastmath={"contract"}, error_model="numpy")
def log_densities(mean, std):
    """Student's t with means and standard deviations (columns,); 0 where a mean is not finite."""
    found = np.empty(len(mean))
    for c in range(len(mean)):
        scale = TAIL_SCALE * std[c]
        tail = -0.5 * (TAIL + 1.0) * np.log1p((mean[c] / scale) ** 2 / TAIL)
        found[c] = tail - np.log(scale) if np.isfinite(mean[c]) else 0.0
    return found


@njit(nogil=True, cache=True, fastmath={"contract"}, error_model="numpy")
def total_densities(mean, one_shift, other_shift, one_std, other_std):
    """Summed log densities (m, n) of every one of m shifts together with every one of n others.

    `mean` (columns,), NaN where nothing was observed; `one_shift`, `one_std` (m, columns),
    `other_shift`, `other_std` (n, columns): the wider of the two scatters counts.
    """
    m, n = len(one_shift), len(other_shift)
    known = np.flatnonzero(np.isfinite(mean))
    found = np.empty((m, n))
    for i in range(m):
        for j in range(n):
            total, tails, scales, held = 0.0, 1.0, 1.0, 0
            for at in range(len(known)):
                c = known[at]
                scale = TAIL_SCALE * max(one_std[i, c], other_std[j, c])
                z = (mean[c] + one_shift[i, c] + other_shift[j, c]) / scale
                tails *= 1.0 + z * z / TAIL
                scales *= scale
                held += 1
                if held == _TOGETHER:
                    total -= 0.5 * (TAIL + 1.0) * np.log(tails) + np.log(scales)
                    tails, scales, held = 1.0, 1.0, 0
            found[i, j] = total - 0.5 * (TAIL + 1.0) * np.log(tails) - np.log(scales)
    return found


def compile_all() -> None:
    """Compile what is here, or load what was: seconds that a set-up may spend beforehand."""
    runs, rows = 6, 4
    values, alike = np.zeros((rows, 3, runs), np.float32), np.ones((rows, runs))
    offset = np.linspace(-1.0, 1.0, runs)[:, None]
    near = np.tile(np.arange(runs), (rows, 1))
    expect_alike(offset, 1.0, values.reshape(-1, runs), values, alike, True)
    expect_by_row(np.tile(offset, (rows, 1, 1)), near, 1.0, values, alike, True)
    one, many = np.ones(3 * rows), np.ones((2, 3 * rows))
    weigh(np.ones(runs), 1.0)
    log_densities(one, one)
    lean(one, one, many, np.ones(2), one > 0.0)
    total_densities(one, many, many, many, many)
