"""What is expected at a place, and how well an observation agrees with it: the arithmetic.

Owns which runs count there, and how much, and how datasheet values are leaned
on. It is compiled, and lets other threads run beside it, as a diagnosis asks
for tens of thousands of places. What the numbers are is the surface's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.regression import TAIL, TAIL_SCALE, invert, solve_plane
from sim.compiling import njit, part

__all__ = [
    "Readings",
    "Runs",
    "agree",
    "compile_all",
    "log_densities",
    "log_shares",
    "total_densities",
    "weigh",
]

_REACHES = 1.3 ** np.arange(-3, 9, dtype=np.float64)
"""Reaches of the kernel, in widths: the first is taken that holds enough runs."""

_BLUR = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0
"""Weights over neighbouring frequencies by which a scatter is smoothed: few runs tell little."""

_UNKNOWN = np.array([0.5, 0.5, 1.5])
"""Scatter of a motion that no run shows, by channel: a machine that never does what was observed
is unlikely, but not as unlikely as its other motion would have it."""

_ITERATIONS = 6

_TOGETHER = 8
"""Factors of which one logarithm is taken."""

_ANY_ORDER = {"contract", "reassoc", "nsz", "arcp"}


class Runs(NamedTuple):
    """Runs of one hypothesis; rows are those of an observation, k coordinates of its chart.

    `charted` (1 or rows, n, k): where they are, one for all rows where they are alike.
    `width` (k,). `enough`: weight of the runs that a regression takes; `most`: how many
    of the nearest take part, where every row has its own. `tailed`: see
    `analysis.regression.solve_plane`. `plain` (3 len(plain_rows), n): what they show minus what
    was observed, at rows where all runs count; `mixed` (len(mixed_rows), 3, n): at the others,
    where they count as `alike` (rows, n) says; `values` (rows, 3, n): at all. `neighbours`
    (rows, 5): which rows of its level a scatter is smoothed over. `least` (3, rows): variance
    that is always there.
    """

    charted: NDArray[np.float64]
    width: NDArray[np.float64]
    enough: float
    most: int
    tailed: bool
    plain: NDArray[np.float32]
    plain_rows: NDArray[np.int64]
    mixed: NDArray[np.float32]
    mixed_rows: NDArray[np.int64]
    values: NDArray[np.float32]
    alike: NDArray[np.float64]
    neighbours: NDArray[np.int64]
    least: NDArray[np.float64]

    @staticmethod
    def smoothed_over(blocks: list[slice]) -> NDArray[np.int64]:
        """`neighbours` where levels are blocks of rows."""
        shifts = np.arange(len(_BLUR)) - len(_BLUR) // 2
        return np.concatenate(
            [np.clip(np.arange(b.start, b.stop)[:, None] + shifts, b.start, b.stop - 1)
             for b in blocks]
        )  # fmt: skip


class Readings(NamedTuple):
    """What was observed, and how it may lean on datasheet values.

    `observed` (3, rows): where anything was. `slopes` (k, 3 rows): what a deviation does;
    `sigmas` (k,): its standard deviation. `before`, `both` (n, rows): which runs did one
    row before as was observed, and there too; `prior` (rows,): how many are believed to
    (`analysis.branches`).
    """

    observed: NDArray[np.bool_]
    slopes: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    before: NDArray[np.float64]
    both: NDArray[np.float64]
    prior: NDArray[np.float64]


@part(fastmath={"contract"})
def _weigh_at(squares, alike, enough, weight):
    """Weights (n,) of runs at squared distances, by the first reach that suffices, or the last.

    The reach, and the sum of the weights.
    """
    n = len(squares)
    reach, total = _REACHES[0], 0.0
    for pick in range(len(_REACHES)):
        reach = _REACHES[pick]
        total = 0.0
        for i in range(n):
            inside = max(1.0 - squares[i] / (4.0 * reach * reach), 0.0)
            weight[i] = inside * inside * alike[i]
            total += weight[i]
        if total >= enough:
            break
    return reach, total


@njit(nogil=True, cache=True, fastmath={"contract"}, error_model="numpy")
def weigh(squares, enough):
    """Weights (n,) of runs at squared distances, by the first reach that suffices, or the last."""
    weight = np.empty(len(squares))
    _weigh_at(squares, np.ones(len(squares)), enough, weight)
    return weight


@njit(nogil=True, cache=True, fastmath={"contract"}, error_model="numpy")
def log_shares(weight, before, both, prior):
    """Logarithm (rows,) of the share of weighted runs that do as was observed; see `Readings`."""
    found = np.empty(len(prior))
    for row in range(len(prior)):
        did, do = 1.0, prior[row]
        for i in range(len(weight)):
            did += weight[i] * before[i, row]
            do += weight[i] * both[i, row]
        found[row] = np.log(do / did)
    return found


@part(fastmath={"contract"})
def _offsets(charted, point, width, offset, squares):
    """How far (n, k) runs are from a point in one chart, in widths, and the squares (n,) of it."""
    n, k = charted.shape
    for i in range(n):
        squares[i] = 0.0
        for j in range(k):
            offset[i, j] = (charted[i, j] - point[j]) / width[j]
            squares[i] += offset[i, j] ** 2


@part()
def _nearest(far, most, scratch, near):
    """Which runs (most,) are the nearest, in any order: quickselect, then all within."""
    low, high = 0, len(far) - 1
    # Item by item: what assigns whole arrays takes seconds to compile.
    for i in range(len(far)):
        scratch[i] = far[i]
    while low < high:
        pivot = scratch[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while scratch[i] < pivot:
                i += 1
            while pivot < scratch[j]:
                j -= 1
            if i <= j:
                scratch[i], scratch[j] = scratch[j], scratch[i]
                i += 1
                j -= 1
        if most - 1 <= j:
            high = j
        elif most - 1 >= i:
            low = i
        else:
            break
    limit, taken = scratch[most - 1], 0
    for strictly in (True, False):
        for i in range(len(far)):
            if taken < most and (far[i] < limit if strictly else far[i] == limit):
                near[taken] = i
                taken += 1


@part()
def _alike(runs, point, mean, variance, distance):
    """Means and variances (3, rows) where runs are as near at one row as at any other."""
    _, n, k = runs.charted.shape
    offset, weight, all_alike = np.empty((n, k)), np.empty(n), np.ones(n)
    _offsets(runs.charted[0], point[0], runs.width, offset, distance)
    plain = len(runs.plain_rows)
    shown, spread = np.empty(max(3 * plain, 3)), np.empty(max(3 * plain, 3))
    # The plain rows are one problem, which comes first, if there are any.
    for at in range(-1 if plain else 0, len(runs.mixed_rows)):
        rows = runs.plain_rows if at < 0 else runs.mixed_rows[at : at + 1]
        values = runs.plain if at < 0 else runs.mixed[at]
        alike = all_alike if at < 0 else runs.alike[rows[0]]
        reach, rested = _weigh_at(distance, alike, runs.enough, weight)
        solve_plane(offset, weight, reach, values, runs.tailed, shown, spread)
        lacking = 0.0 if at < 0 else min(max(1.0 - rested, 0.0), 1.0)
        for j in range(len(rows)):
            for c in range(3):
                mean[c, rows[j]] = shown[3 * j + c]
                variance[c, rows[j]] = spread[3 * j + c] + lacking * _UNKNOWN[c] ** 2


@part()
def _by_row(runs, point, mean, variance, distance):
    """The same where every row has its own neighbours, those in another motion last."""
    rows, n, k = runs.charted.shape
    most = min(runs.most, n)
    offset, squares, far, scratch = np.empty((n, k)), np.empty(n), np.empty(n), np.empty(n)
    near = np.empty(most, np.int64)
    near_squares, alike, weight = np.empty(most), np.empty(most), np.empty(most)
    near_offset, values = np.empty((most, k)), np.empty((3, most), runs.values.dtype)
    three, spreads = np.empty(3), np.empty(3)
    for i in range(n):
        distance[i] = 0.0
    for row in range(rows):
        _offsets(runs.charted[row], point[row], runs.width, offset, squares)
        whole = True
        for i in range(n):
            distance[i] += squares[i] / rows
            far[i] = squares[i] / runs.alike[row, i]
            whole &= runs.alike[row, i] == 1.0
        _nearest(far, most, scratch, near)
        for at in range(most):
            i = near[at]
            near_squares[at], alike[at] = squares[i], runs.alike[row, i]
            for j in range(k):
                near_offset[at, j] = offset[i, j]
            for c in range(3):
                values[c, at] = runs.values[row, c, i]
        reach, rested = _weigh_at(near_squares, alike, runs.enough, weight)
        solve_plane(near_offset, weight, reach, values, runs.tailed, three, spreads)
        lacking = 0.0 if whole else min(max(1.0 - rested, 0.0), 1.0)
        for c in range(3):
            mean[c, row], variance[c, row] = three[c], spreads[c] + lacking * _UNKNOWN[c] ** 2


@part()
def _expect(runs, point):
    """Mean and scatter of a single run (3, rows) at a point, and how far (n,) runs are from it."""
    rows, n = runs.least.shape[1], runs.charted.shape[1]
    mean, variance, distance = np.empty((3, rows)), np.empty((3, rows)), np.empty(n)
    if len(runs.charted) > 1:
        _by_row(runs, point, mean, variance, distance)
    else:
        _alike(runs, point, mean, variance, distance)
    std = np.empty((3, rows))
    for c in range(3):
        for row in range(rows):
            total = runs.least[c, row]
            for s in range(len(_BLUR)):
                total += _BLUR[s] * variance[c, runs.neighbours[row, s]]
            std[c, row] = np.sqrt(total)
    return mean, std, distance


@part(fastmath={"contract"})
def _log_density(apart, std):
    """Student's t, but for a constant."""
    scale = TAIL_SCALE * std
    return -0.5 * (TAIL + 1.0) * np.log1p((apart / scale) ** 2 / TAIL) - np.log(scale)


@njit(nogil=True, cache=True, error_model="numpy")
def agree(runs, readings, points, asked, leaning):
    """How an observation agrees with what is expected at points.

    Parameters
    ----------
    points
        (count, 1 or rows, k) in the chart of the runs.
    asked
        (rows,): the rows that deviations are fitted to, and that count.
    leaning
        Whether it leans on deviations, and counts how many runs do as was observed; else both
        are left in the scatter.

    Returns
    -------
    The log-likelihoods (count,). Of the last point, observed minus expected at the best
    deviations, its standard deviation and the log density of every channel (3, rows), and the
    deviations (k,).
    """
    rows, k = len(asked), len(readings.sigmas)
    totals, best = np.zeros(len(points)), np.zeros(k)
    residual, std, density = np.empty((3, rows)), np.empty((3, rows)), np.empty((3, rows))
    apart, seen, shares = np.empty(3 * rows), np.empty(3 * rows, np.bool_), np.zeros(rows)
    for at in range(len(points)):
        mean, std, distance = _expect(runs, points[at])
        for c in range(3):
            for row in range(rows):
                apart[c * rows + row] = -mean[c, row]
                seen[c * rows + row] = readings.observed[c, row] and asked[row]
        if leaning:
            best, totals[at] = lean(apart, std.ravel(), readings.slopes, readings.sigmas, seen)
            weight = weigh(distance, runs.enough)
            shares = log_shares(weight, readings.before, readings.both, readings.prior)
        for c in range(3):
            for row in range(rows):
                left = apart[c * rows + row]
                for a in range(k):
                    left -= best[a] * readings.slopes[a, c * rows + row]
                known = readings.observed[c, row]
                residual[c, row] = left if known else np.nan
                density[c, row] = _log_density(left, std[c, row]) if known else 0.0
                # Of runs near the place so many do as was observed.
                density[c, row] += shares[row] if c == 2 else 0.0
                totals[at] += density[c, row] if seen[c * rows + row] else 0.0
    for c in range(3):
        for row in range(rows):
            if not readings.observed[c, row]:
                std[c, row] = np.nan
    return totals, residual, std, density, best


@njit(nogil=True, fastmath=_ANY_ORDER, error_model="numpy")
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
    best, normal, right = np.zeros(k), np.zeros((k, k)), np.zeros(k)
    trust, left, known = np.empty(columns), np.empty(columns), np.empty(columns)
    for c in range(columns):
        known[c] = apart[c] if seen[c] else 0.0
    for _ in range(_ITERATIONS):
        for c in range(columns):
            left[c] = known[c]
        for a in range(k):
            for c in range(columns):
                left[c] -= best[a] * slope[a, c]
        for c in range(columns):
            scale = TAIL_SCALE * std[c]
            trust[c] = (TAIL + 1.0) / (TAIL * scale * scale + left[c] * left[c])
            if not seen[c]:
                trust[c] = 0.0
        for a in range(k):
            for b in range(a + 1):
                total = 0.0
                for c in range(columns):
                    total += trust[c] * slope[a, c] * slope[b, c]
                normal[a, b] = normal[b, a] = total
            total = 0.0
            for c in range(columns):
                total += trust[c] * slope[a, c] * known[c]
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


@njit(nogil=True, cache=True, error_model="numpy")
def log_densities(mean, std):
    """Student's t with means and standard deviations (columns,); 0 where a mean is not finite."""
    found = np.zeros(len(mean))
    for c in range(len(mean)):
        if np.isfinite(mean[c]):
            found[c] = _log_density(mean[c], std[c])
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
    n, rows, k = 6, 4, 1
    line = np.linspace(-1.0, 1.0, n)[:, None]
    values, alike = np.zeros((rows, 3, n), np.float32), np.ones((rows, n))
    every, none = np.arange(rows), np.arange(0)
    runs = Runs(
        line[None], np.ones(k), 1.0, n, True, values.reshape(-1, n), every, values[:0], none,
        values, alike, Runs.smoothed_over([slice(0, rows)]), np.ones((3, rows)),
    )  # fmt: skip
    observed, one, many = np.ones((3, rows), bool), np.ones(3 * rows), np.ones((2, 3 * rows))
    share = np.ones((n, rows))
    readings = Readings(observed, many, np.ones(2), share, share, np.ones(rows))
    agree(runs, readings, line[None, None, 0], observed[0], True)
    weigh(one, 1.0)
    log_densities(one, one)
    total_densities(one, many, many, many, many)
