"""The compiled inner loop of the engine: many steps of many lanes.

Owns nothing but arithmetic: the arrays it is given are the propagator's and
the laws'. Lanes lie along the last axis everywhere, so that every loop over
them is one run of vector operations; the shape of these loops is what makes it
fast. A loop over lanes may hold no call and no branch that cannot become a
select, and no function takes a slice: making one costs more than using it.
"""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ["COLUMNS_BEYOND", "COLUMNS_FIRST", "step_cycles"]

COLUMNS_FIRST = 18
"""Columns of the step matrix multiplied in one go: 13 states and 4 laws fit."""

COLUMNS_BEYOND = 6
"""Further columns come in lots of this size."""

_PLAY, _FRICTION, _EXCESS, _CUBIC = 0, 1, 2, 3

_inlined = njit(inline="always", fastmath=True, error_model="numpy")


@_inlined
def _multiply(matrix, drift, columns, rows):
    """rows[i] = drift[i] + sum_j matrix[i, j] columns[j] over all lanes, unrolled over j."""
    n, width = matrix.shape
    lanes = rows.shape[1]
    for i in range(n):
        a0, a1, a2, a3, a4, a5 = (
            matrix[i, 0],
            matrix[i, 1],
            matrix[i, 2],
            matrix[i, 3],
            matrix[i, 4],
            matrix[i, 5],
        )
        a6, a7, a8, a9, a10, a11 = (
            matrix[i, 6],
            matrix[i, 7],
            matrix[i, 8],
            matrix[i, 9],
            matrix[i, 10],
            matrix[i, 11],
        )
        a12, a13, a14, a15, a16, a17 = (
            matrix[i, 12],
            matrix[i, 13],
            matrix[i, 14],
            matrix[i, 15],
            matrix[i, 16],
            matrix[i, 17],
        )
        for s in range(lanes):
            rows[i, s] = (
                drift[i, s]
                + a0 * columns[0, s]
                + a1 * columns[1, s]
                + a2 * columns[2, s]
                + a3 * columns[3, s]
                + a4 * columns[4, s]
                + a5 * columns[5, s]
                + a6 * columns[6, s]
                + a7 * columns[7, s]
                + a8 * columns[8, s]
                + a9 * columns[9, s]
                + a10 * columns[10, s]
                + a11 * columns[11, s]
                + a12 * columns[12, s]
                + a13 * columns[13, s]
                + a14 * columns[14, s]
                + a15 * columns[15, s]
                + a16 * columns[16, s]
                + a17 * columns[17, s]
            )
        for j in range(COLUMNS_FIRST, width, COLUMNS_BEYOND):
            b0, b1, b2 = matrix[i, j], matrix[i, j + 1], matrix[i, j + 2]
            b3, b4, b5 = matrix[i, j + 3], matrix[i, j + 4], matrix[i, j + 5]
            for s in range(lanes):
                rows[i, s] += (
                    b0 * columns[j, s]
                    + b1 * columns[j + 1, s]
                    + b2 * columns[j + 2, s]
                    + b3 * columns[j + 3, s]
                    + b4 * columns[j + 4, s]
                    + b5 * columns[j + 5, s]
                )


@_inlined
def _play(y0, columns, at, stiffness, beta, parameters, j):
    """Solve y = y0 + beta p with p = k clip(y, -d, d)."""
    gain = stiffness / (1.0 - stiffness * beta)
    for s in range(y0.shape[1]):
        bound = stiffness * parameters[j, 0, s]
        columns[at, s] = min(max(gain * y0[0, s], -bound), bound)


@_inlined
def _damped_play(y0, columns, at, stiffness, damping, beta, beta_rate, parameters, j):
    """Solve y = y0 + beta p, v = v0 + beta_rate p; p = k y + c v inside, k d sign(y) outside."""
    inverse = 1.0 / (1.0 - stiffness * beta - damping * beta_rate)
    for s in range(y0.shape[1]):
        limit = parameters[j, 0, s]
        inside = (stiffness * y0[0, s] + damping * y0[1, s]) * inverse
        y = y0[0, s] + beta * inside
        bound = stiffness * limit
        outside = bound if y > 0.0 else -bound
        columns[at, s] = inside if abs(y) < limit else outside


@_inlined
def _friction(y0, columns, at, seen, j, beta, torque):
    """Solve w = w0 + beta p with -p in torque * sign(w), p constant over the step.

    `seen[j]` is w at the start of the step. Where w passes zero inside the
    step, either what drives it is below break-away and it stops there, or
    friction flips at the crossing and p is its mean over the step.
    """
    for s in range(y0.shape[1]):
        w0, w, most = y0[0, s], seen[j, s], torque[2, s]
        reach = beta * most
        ahead = w if w != 0.0 else w0
        sign = 1.0 if ahead > 0.0 else -1.0
        slid = (w0 - sign * reach) * sign
        start = abs(w)
        share = start / max(start - slid, 1e-300)
        flipped = -most * sign * (2.0 * share - 1.0)
        stopped = -w0 / beta
        turned = stopped if abs(w0 - w) <= reach else flipped
        columns[at, s] = -most * sign if slid >= 0.0 else turned


@_inlined
def _friction_torque(torque, seen, j, parameters, stribeck):
    """The most that friction can hold, with the Stribeck peak where there is one."""
    for s in range(torque.shape[1]):
        torque[2, s] = parameters[j, 0, s]
    if stribeck:
        for s in range(torque.shape[1]):
            u = seen[j, s] / parameters[j, 2, s]
            torque[2, s] += parameters[j, 1, s] * np.exp(-u * u)


@_inlined
def _excess(y0, columns, at, parameters, j):
    """Set p = clip(y, -limit, limit) - y; what is clipped off does not act on y itself."""
    for s in range(y0.shape[1]):
        limit = parameters[j, 0, s]
        columns[at, s] = min(max(y0[0, s], -limit), limit) - y0[0, s]


@_inlined
def _cubic(y0, columns, at, beta, parameters, j):
    """Solve p = -k (y0 + beta p)^3 by two Newton steps from the last value."""
    for s in range(y0.shape[1]):
        k = parameters[j, 0, s]
        p = columns[at, s]
        y = y0[0, s] + beta * p
        p -= (p + k * y * y * y) / (1.0 + 3.0 * beta * k * y * y)
        y = y0[0, s] + beta * p
        columns[at, s] = p - (p + k * y * y * y) / (1.0 + 3.0 * beta * k * y * y)


@_inlined
def _look(y0, to, rows, j, columns, n, drives, sine, cosine):
    """y0[to] = rows[j] . z plus what the drive alone makes of it."""
    for s in range(y0.shape[1]):
        y0[to, s] = drives[j, 0, s] * sine + drives[j, 1, s] * cosine + drives[j, 2, s]
    for i in range(n):
        c = rows[j, i]
        if c != 0.0:
            for s in range(y0.shape[1]):
                y0[to, s] += c * columns[i, s]


@_inlined
def _add_forces(y0, to, coupling, j, columns, n, but):
    """Add what the newest forces, all but one, do to row j at the end of the step."""
    for i in range(coupling.shape[1]):
        c = coupling[j, i]
        if i != but and c != 0.0:
            for s in range(y0.shape[1]):
                y0[to, s] += c * columns[n + i, s]


@_inlined
def _close_laws(kinds, fixed, parameters, rows, rates, beta, beta_rate, drives, rate_drives,
                columns, n, sine, cosine, seen, work):  # fmt: skip
    """Solve every law once at the end of a step; the forces p lie in columns[n:]."""
    for j in range(kinds.shape[0]):
        at = n + j
        own = beta[j, j]
        _look(work, 0, rows, j, columns, n, drives, sine, cosine)
        _add_forces(work, 0, beta, j, columns, n, j)
        if kinds[j] == _PLAY:
            if fixed[j, 1] == 0.0:
                _play(work, columns, at, fixed[j, 0], own, parameters, j)
            else:
                _look(work, 1, rates, j, columns, n, rate_drives, sine, cosine)
                _add_forces(work, 1, beta_rate, j, columns, n, j)
                _damped_play(work, columns, at, fixed[j, 0], fixed[j, 1], own,
                             beta_rate[j, j], parameters, j)  # fmt: skip
        elif kinds[j] == _FRICTION:
            _friction_torque(work, seen, j, parameters, fixed[j, 2] != 0.0)
            _friction(work, columns, at, seen, j, own, work)
            for s in range(work.shape[1]):
                seen[j, s] = work[0, s] + own * columns[at, s]
        elif kinds[j] == _EXCESS:
            _excess(work, columns, at, parameters, j)
        else:
            _cubic(work, columns, at, own, parameters, j)


@_inlined
def _accumulate(columns, n, out_row, out_end, table, tick, out_drive, sums, kept, peak, work):
    """Add V_o at one step to the Fourier sums of the cycle."""
    _look(work, 0, out_row, 0, columns, n, out_drive, table[tick, 1], table[tick, 0])
    _add_forces(work, 0, out_end, 0, columns, n, -1)
    for s in range(work.shape[1]):
        peak[s] = max(peak[s], abs(work[0, s]))
        sums[kept, 0, s] += work[0, s]
    for k in range(table.shape[1]):
        c = table[tick, k]
        for s in range(work.shape[1]):
            sums[kept, k + 1, s] += c * work[0, s]


@njit(cache=True, fastmath=True, error_model="numpy", nogil=True)
def step_cycles(matrix, drift, columns, kinds, fixed, parameters, rows, rates, beta, beta_rate,
                drives, rate_drives, out_row, out_end, out_drive, table, seen, settle_cycles,
                sums, peak):  # fmt: skip
    """Step `columns` (z and p, (n + m padded, lanes)) in place through settle and kept cycles.

    `sums` is (cycles, 7, lanes): the sum, then cosine and sine sums of harmonics
    1 to 3 of V_o over each kept cycle, not normalised.
    """
    n, lanes = drift.shape
    ticks = table.shape[0]
    now, then = columns, np.zeros_like(columns)
    work = np.empty((3, lanes))
    for cycle in range(settle_cycles + sums.shape[0]):
        kept = cycle - settle_cycles
        for step in range(ticks):
            tick = step + 1 if step + 1 < ticks else 0
            now, then = then, now
            _multiply(matrix, drift, then, now)
            for i in range(n, n + kinds.shape[0]):
                for s in range(lanes):
                    now[i, s] = then[i, s]
            _close_laws(kinds, fixed, parameters, rows, rates, beta, beta_rate, drives,
                        rate_drives, now, n, table[tick, 1], table[tick, 0], seen,
                        work)  # fmt: skip
            if kept >= 0:
                _accumulate(now, n, out_row, out_end, table, tick, out_drive, sums, kept,
                            peak, work)  # fmt: skip
    columns[:] = now
