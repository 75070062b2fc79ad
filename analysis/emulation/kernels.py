"""What is expected at a place, and how well an observation agrees with it: the compiled arithmetic.

Owns local regression over the runs near a place, the density of Student's t, and how datasheet
values are leaned on. It lets other threads run beside it. What the numbers are is the surface's
(`analysis.emulation.kernel_data` says in which form they come). A diagnosis asks for tens of
thousands of places, so all of it is one compiled function at each. It has more than 400 lines since
numba's cache on disk looks at one file alone to tell whether it is stale.
"""

from __future__ import annotations

import numpy as np

from sim.engine.compiling import njit, part

__all__ = [
    "BLUR", "TAIL", "TAIL_SCALE", "agree", "invert", "lean", "log_shares",
    "solve_plane", "weigh",
]  # fmt: skip

_RIDGE = 0.1
"""Ridge of the slopes, in units of the kernel's reach: few runs must not make a wild slope."""

TAIL = 4.0
"""Degrees of freedom of Student's t, whose variance is TAIL / (TAIL - 2) of its scale squared."""

TAIL_SCALE = float(np.sqrt((TAIL - 2.0) / TAIL))

_TAIL_ITERATIONS = 5

_REACHES = 1.3 ** np.arange(-3, 9, dtype=np.float64)
"""Reaches of the kernel, in widths: the first is taken that holds enough runs."""

BLUR = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0
"""Weights over neighbouring frequencies by which a scatter is smoothed: few runs tell little."""

_UNKNOWN = np.array([0.5, 0.5, 1.5])
"""Scatter of a motion that no run shows, by channel: a machine that never does what was observed
is unlikely, but not as unlikely as its other motion would have it."""

_ITERATIONS = 6

_ANY_ORDER = {"contract", "reassoc", "nsz", "arcp"}
"""Sums may be made in any order: vectors need it. NaN stays NaN."""


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


@part(fastmath=_ANY_ORDER)
def _weigh_at(squares, alike, enough, weight):
    """Weights (n,) of runs at squared distances, by the first reach that suffices, or the last.

    The reach, and the sum of the weights.
    """
    n = len(squares)
    reach, total = _REACHES[0], 0.0
    for pick in range(len(_REACHES)):
        reach = _REACHES[pick]
        per_square, total = 1.0 / (4.0 * reach * reach), 0.0
        for i in range(n):
            inside = max(1.0 - squares[i] * per_square, 0.0)
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
    runs, rows = before.shape
    did, do = np.ones(rows), np.empty(rows)
    for row in range(rows):
        do[row] = prior[row]
    # Run by run, as they lie in memory.
    for i in range(runs):
        for row in range(rows if weight[i] > 0.0 else 0):
            did[row] += weight[i] * before[i, row]
            do[row] += weight[i] * both[i, row]
    for row in range(rows):
        do[row] = np.log(do[row] / did[row])
    return do


@part(fastmath={"contract"})
def _squares_off(charted, point, width, squares):
    """How far (n,) runs are from a point in one chart (k, n), in widths squared."""
    k, n = charted.shape
    for i in range(n):
        squares[i] = 0.0
    for j in range(k):
        at, per_width = point[j], 1.0 / width[j]
        for i in range(n):
            off = (charted[j, i] - at) * per_width
            squares[i] += off * off


@part()
def _offsets(charted, point, width, runs, offset):
    """How far (count, k) some runs are from a point, in widths."""
    k = len(charted)
    for j in range(k):
        at, per_width = point[j], 1.0 / width[j]
        for i in range(len(runs)):
            offset[i, j] = (charted[j, runs[i]] - at) * per_width


@part(fastmath=_ANY_ORDER)
def _count(far, limit):
    """How many lie within a limit."""
    count = 0
    for i in range(len(far)):
        count += 1 if far[i] <= limit else 0
    return count


@part(fastmath=_ANY_ORDER)
def _farthest(far):
    """The largest of them."""
    most = far[0]
    for i in range(len(far)):
        most = max(most, far[i])
    return most


@part()
def find_nearest(far, most, guess, near):
    """Which runs (most,) are the nearest, in any order; the limit that they lie within.

    By halving what may be the limit, as counting goes in vectors and sorting does not. `guess`: a
    limit to begin with, or 0.
    """
    low, high, held = 0.0, _farthest(far), len(far)
    limit = guess if 0.0 < guess < high else 0.5 * high
    while held > most and low < limit < high:
        count = _count(far, limit)
        if count < most:
            low = limit
        else:
            high, held = limit, count
        # A guess is not far off.
        limit = 2.0 * limit if held == len(far) and 2.0 * limit < high else 0.5 * (low + high)
    # Some may be as far as each other, so that no limit parts them.
    sure, taken = high if held == most else low, 0
    for i in range(len(far)):
        if far[i] <= sure and taken < most:
            near[taken] = i
            taken += 1
    for i in range(len(far) if taken < most else 0):
        if sure < far[i] <= high and taken < most:
            near[taken] = i
            taken += 1
    return high


@part()
def _alike(runs, point, mean, variance, distance):
    """Means and variances (3, rows) where runs are as near at one row as at any other."""
    _, k, n = runs.charted.shape
    offset, weight, all_alike = np.empty((n, k)), np.empty(n), np.ones(n)
    _squares_off(runs.charted[0], point[0], runs.width, distance)
    _offsets(runs.charted[0], point[0], runs.width, np.arange(n), offset)
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
    rows, k, n = runs.charted.shape
    most = min(runs.most, n)
    squares, far, limit = np.empty(n), np.empty(n), 0.0
    near = np.empty(most, np.int64)
    near_squares, alike, weight = np.empty(most), np.empty(most), np.empty(most)
    near_offset, values = np.empty((most, k)), np.empty((3, most), runs.values.dtype)
    three, spreads = np.empty(3), np.empty(3)
    for i in range(n):
        distance[i] = 0.0
    for row in range(rows):
        _squares_off(runs.charted[row], point[row], runs.width, squares)
        least = 1.0
        for i in range(n):
            distance[i] += squares[i] / rows
            far[i] = squares[i] / runs.alike[row, i]
            least = min(least, runs.alike[row, i])
        limit = find_nearest(far, most, limit, near)
        _offsets(runs.charted[row], point[row], runs.width, near, near_offset)
        for at in range(most):
            i = near[at]
            near_squares[at], alike[at] = squares[i], runs.alike[row, i]
            for c in range(3):
                values[c, at] = runs.values[row, c, i]
        reach, rested = _weigh_at(near_squares, alike, runs.enough, weight)
        solve_plane(near_offset, weight, reach, values, runs.tailed, three, spreads)
        lacking = 0.0 if least == 1.0 else min(max(1.0 - rested, 0.0), 1.0)
        for c in range(3):
            mean[c, row], variance[c, row] = three[c], spreads[c] + lacking * _UNKNOWN[c] ** 2


@part()
def _expect(runs, point):
    """Mean and scatter of a single run (3, rows) at a point, and how far (n,) runs are from it."""
    rows, n = runs.least.shape[1], runs.charted.shape[2]
    mean, variance, distance = np.empty((3, rows)), np.empty((3, rows)), np.empty(n)
    if len(runs.charted) > 1:
        _by_row(runs, point, mean, variance, distance)
    else:
        _alike(runs, point, mean, variance, distance)
    std = np.empty((3, rows))
    for c in range(3):
        for row in range(rows):
            total = runs.least[c, row]
            for s in range(len(BLUR)):
                total += BLUR[s] * variance[c, runs.neighbours[row, s]]
            std[c, row] = np.sqrt(total)
    return mean, std, distance


@part(fastmath={"contract"})
def log_density(apart, std):
    """Student's t, but for a constant."""
    scale = TAIL_SCALE * std
    return -0.5 * (TAIL + 1.0) * np.log1p((apart / scale) ** 2 / TAIL) - np.log(scale)


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
                density[c, row] = log_density(left, std[c, row]) if known else 0.0
                # Of runs near the place so many do as was observed.
                density[c, row] += shares[row] if c == 2 else 0.0
                totals[at] += density[c, row] if seen[c * rows + row] else 0.0
    for c in range(3):
        for row in range(rows):
            if not readings.observed[c, row]:
                std[c, row] = np.nan
    return totals, residual, std, density, best
