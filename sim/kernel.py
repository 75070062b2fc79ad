"""The compiled inner loop of the engine: many steps of many lanes.

Owns the scalar laws, the order of work in a step and the layout in memory; the
numbers it is given are the propagator's. It knows no physics beyond the laws.
(Laws and loop share a file because numba's cache on disk looks at this file
alone to tell whether it is stale.)

A law sees y at the start of the step (`y0`) and would see `ahead` at its end if
it did not act; with its own force p, held over the step, it sees
y1 = ahead + beta p. A force that comes from a potential W (play, a hardening
spring) takes its mean along the step, p = (W(y1) - W(y0)) / (y1 - y0). Held
over the step it does the work W(y1) - W(y0) whatever the motion inside the
step was: no energy appears or vanishes, at any step.

Lanes lie along the last axis everywhere, so that each loop over them is one
run of vector operations. Three things keep these loops fast: the compiler need
not test at run time whether rows overlap, because those of an array lie a fixed
distance apart (`MOST_LANES`), their numbers cannot be negative (`& _ROW`), and
it is told that the arrays of a part are different ones (`sim.compiling`); a loop over
lanes holds no branch and no call that is left after inlining; and the parts are
inlined by the machine's compiler, not by numba, which would rename arrays
inside the step loop and count references in every step.
"""

from __future__ import annotations

import numpy as np

from sim.compiling import law, loop, part

__all__ = ["FORCES_AT_ONCE", "MOST_LANES", "PAIR", "ROWS_AT_ONCE", "STRIBECK", "step_cycles"]

MOST_LANES = 64
"""Lanes that one call can step; a full call costs little more than one of eight."""

ROWS_AT_ONCE = 14
"""Coordinates that are looked at in one go: 13 states as modes; further ones come in pairs."""

FORCES_AT_ONCE = 4
"""Forces that act in one go, two meshes and two frictions; further ones come in pairs."""

STRIBECK = 4
"""Kind of a friction that peaks at rest; the other kinds are those of `sim.assembly.Law`."""

PAIR = 5
"""Kind of a hardening spring that is solved together with the law after it, another such spring."""

_PLAY, _FRICTION, _EXCESS = 0, 1, 2

_CORRECTIONS = 2
"""How often a play's share of the step is corrected; each leaves about 3 % of the error."""

_FIRST_SWEEPS = 8

_ROW = 1023
"""All bits that the number of a row can have."""


@law
def play_force(y0, ahead, d, k, c, beta):
    """Mean of k clip(y, -d, d) over the step, and the damper c taken out while inside the play.

    `c` is the damping over the step, c/h. With e = y - clip(y) the mean of
    clip is (clip0 + clip1)/2 + q (e0 + e1)/2, where q is the share of the step
    spent inside; q depends on y1, weakly.
    """
    half, damp = 0.5 * k * beta, c * beta
    inverse = 1.0 / (1.0 - half - damp)
    c0 = min(max(y0, -d), d)
    e0 = y0 - c0
    known = ahead + (half - damp) * c0
    guess = known * inverse if e0 == 0.0 else known + (half + damp) * c0
    moved = guess - y0
    per_moved = 1.0 / (moved if abs(moved) > 1e-30 else 1.0)
    q = (min(max(guess, -d), d) - c0) * per_moved
    c1, e1 = c0, e0
    for _ in range(_CORRECTIONS):
        share = half * q
        pulled = known + share * e0
        inside = pulled * inverse
        c1 = min(max(inside, -d), d)
        # (1 - share) e1 = pulled + ..., by the series of 1/(1 - share): share is 0.1 at most.
        series = 1.0 + share * (1.0 + share * (1.0 + share))
        e1 = (pulled + (half + damp - 1.0) * c1) * series if abs(inside) > d else 0.0
        # One Newton step carries the reciprocal over to the corrected motion.
        moved = c1 + e1 - y0
        per_moved *= 2.0 - moved * per_moved
        q = min(max((c1 - c0) * per_moved, 0.0), 1.0)
    return 0.5 * k * (c0 + c1 + q * (e0 + e1)) + c * (c1 - c0)


@law
def friction_force(w0, ahead, most, beta):
    """Force that opposes the motion w with `most`, stops it dead, or turns with it.

    Where w passes zero inside the step, either what drives it is below
    break-away and it stops there, or friction turns at the crossing and the
    force is its mean.
    """
    start = w0 if w0 != 0.0 else ahead
    sign = 1.0 if start > 0.0 else -1.0
    slid = sign * ahead - beta * most
    before = abs(w0)
    share = before / (before - min(slid, -1e-30))
    turned = most * sign * (1.0 - 2.0 * share)
    stopped = -ahead / beta
    crossing = stopped if abs(ahead - w0) <= beta * most else turned
    return -most * sign if slid >= 0.0 else crossing


@law
def peaked_friction(w, T, T_s, w_s):
    """Stribeck's curve T + T_s exp(-(w/w_s)^2), to 1e-5 of its peak."""
    u = w / w_s
    x = min(u * u, 40.0) / 64.0
    # exp(-64 x) as the 64th power of a Taylor series: a call to exp would break the vectors.
    power = 1.0 - x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x / 120.0))))
    power *= power
    power *= power
    power *= power
    power *= power
    power *= power
    power *= power
    return T + T_s * power


@law
def excess_force(y0, y1, limit):
    """Mean of clip(y, -limit, limit) - y over the step; y itself does not feel it."""
    c0, c1 = min(max(y0, -limit), limit), min(max(y1, -limit), limit)
    moved = y1 - y0
    q = (c1 - c0) / (moved if abs(moved) > 1e-30 else 1.0)
    return -0.5 * (1.0 - q) * (y0 - c0 + y1 - c1)


@law
def cubic_mean(y0, y1, quarter):
    """Mean of -k y^3 over the step; `quarter` is k/4."""
    return -quarter * (y0 * y0 + y1 * y1) * (y0 + y1)


@law
def cubic_slope(y0, y1, quarter):
    """How fast that mean falls with y1."""
    return quarter * (y0 * y0 + 2.0 * y0 * y1 + 3.0 * y1 * y1)


@law
def cubic_force(y0, ahead, last, k, beta):
    """Mean of -k y^3 over the step, by two Newton steps from the last force."""
    quarter = 0.25 * k
    y1 = ahead + beta * last
    for _ in range(2):
        miss = y1 - ahead - beta * cubic_mean(y0, y1, quarter)
        y1 -= miss / (1.0 + beta * cubic_slope(y0, y1, quarter))
    return cubic_mean(y0, y1, quarter)


@law
def cubic_pair(y0, z0, y_ahead, z_ahead, p, r, k_y, k_z, yy, yz, zy, zz):
    """Forces of two hardening springs, by one Newton step for both from the last, p and r.

    y sees yy p + yz r of them, z sees zy p + zz r. In turn they would settle slowly: two halves
    of a shaft push the tiny inertia between them, and each nearly undoes what the other did.
    """
    k, n = 0.25 * k_y, 0.25 * k_z
    y, z = y_ahead + yy * p + yz * r, z_ahead + zy * p + zz * r
    p, r = cubic_mean(y0, y, k), cubic_mean(z0, z, n)
    s, t = cubic_slope(y0, y, k), cubic_slope(z0, z, n)
    y_miss, z_miss = y - y_ahead - yy * p - yz * r, z - z_ahead - zy * p - zz * r
    inverse = 1.0 / ((1.0 + yy * s) * (1.0 + zz * t) - yz * t * zy * s)
    y -= ((1.0 + zz * t) * y_miss - yz * t * z_miss) * inverse
    z -= ((1.0 + yy * s) * z_miss - zy * s * y_miss) * inverse
    return cubic_mean(y0, y, k), cubic_mean(z0, z, n)


@part
def _turn(carry, push, drift, q, force, lanes):
    """Coordinates in pairs of rows: the forces of the last step push them, then they turn."""
    for row in range(0, carry.shape[0], 2):
        i = row & _ROW
        _push_further(push, i, q, force, lanes)
        a0, a1, a2, a3 = push[i, 0], push[i, 1], push[i, 2], push[i, 3]
        b0, b1, b2, b3 = push[i + 1, 0], push[i + 1, 1], push[i + 1, 2], push[i + 1, 3]
        c00, c01, c10, c11 = carry[i, 0], carry[i, 1], carry[i + 1, 0], carry[i + 1, 1]
        for s in range(lanes):
            p0, p1, p2, p3 = force[0, s], force[1, s], force[2, s], force[3, s]
            one = q[i, s] + a0 * p0 + a1 * p1 + a2 * p2 + a3 * p3
            other = q[i + 1, s] + b0 * p0 + b1 * p1 + b2 * p2 + b3 * p3
            q[i, s] = drift[i, s] + c00 * one + c01 * other
            q[i + 1, s] = drift[i + 1, s] + c10 * one + c11 * other


@part
def _push_further(push, i, q, force, lanes):
    for column in range(FORCES_AT_ONCE, push.shape[1], 2):
        k = column & _ROW
        a0, a1, b0, b1 = push[i, k], push[i, k + 1], push[i + 1, k], push[i + 1, k + 1]
        for s in range(lanes):
            q[i, s] += a0 * force[k, s] + a1 * force[k + 1, s]
            q[i + 1, s] += b0 * force[k, s] + b1 * force[k + 1, s]


@part
def _push(push, q, force, lanes):
    for row in range(0, push.shape[0], 2):
        i = row & _ROW
        a0, a1, a2, a3 = push[i, 0], push[i, 1], push[i, 2], push[i, 3]
        b0, b1, b2, b3 = push[i + 1, 0], push[i + 1, 1], push[i + 1, 2], push[i + 1, 3]
        for s in range(lanes):
            p0, p1, p2, p3 = force[0, s], force[1, s], force[2, s], force[3, s]
            q[i, s] += a0 * p0 + a1 * p1 + a2 * p2 + a3 * p3
            q[i + 1, s] += b0 * p0 + b1 * p1 + b2 * p2 + b3 * p3
        _push_further(push, i, q, force, lanes)


@part
def _multiply(carry, push, drift, q, force, spare, lanes):
    """The same where every coordinate feels every other; slower, and rarely needed."""
    p = carry.shape[0]
    _push(push, q, force, lanes)
    for i in range(p):
        for s in range(lanes):
            spare[i, s] = drift[i, s]
        for k in range(0, p, 2):
            c0, c1 = carry[i, k], carry[i, k + 1]
            for s in range(lanes):
                spare[i, s] += c0 * q[k, s] + c1 * q[k + 1, s]
    for i in range(p):
        for s in range(lanes):
            q[i, s] = spare[i, s]


@part
def _look(look, rows, waves, cosine, sine, q, free, lanes):
    """What the laws, and the output in the last row, would see at the end without any force."""
    for row in range(rows):
        j = row & _ROW
        l0, l1, l2, l3 = look[j, 0], look[j, 1], look[j, 2], look[j, 3]
        l4, l5, l6, l7 = look[j, 4], look[j, 5], look[j, 6], look[j, 7]
        l8, l9, l10, l11 = look[j, 8], look[j, 9], look[j, 10], look[j, 11]
        l12, l13 = look[j, 12], look[j, 13]
        at = 3 * j
        for s in range(lanes):
            free[j, s] = (
                waves[at, s] * sine + waves[at + 1, s] * cosine + waves[at + 2, s]
                + l0 * q[0, s] + l1 * q[1, s] + l2 * q[2, s] + l3 * q[3, s]
                + l4 * q[4, s] + l5 * q[5, s] + l6 * q[6, s] + l7 * q[7, s]
                + l8 * q[8, s] + l9 * q[9, s] + l10 * q[10, s] + l11 * q[11, s]
                + l12 * q[12, s] + l13 * q[13, s]
            )  # fmt: skip
        for column in range(ROWS_AT_ONCE, look.shape[1], 2):
            k = column & _ROW
            l0, l1 = look[j, k], look[j, k + 1]
            for s in range(lanes):
                free[j, s] += l0 * q[k, s] + l1 * q[k + 1, s]


@part
def _feel(gain, j, force, free, y, to, lanes):
    """Row `to` of y: what row j sees with the forces as they stand."""
    j, to = j & _ROW, to & _ROW
    g0, g1, g2, g3 = gain[j, 0], gain[j, 1], gain[j, 2], gain[j, 3]
    for s in range(lanes):
        y[to, s] = (
            free[j, s] + g0 * force[0, s] + g1 * force[1, s] + g2 * force[2, s] + g3 * force[3, s]
        )
    for column in range(FORCES_AT_ONCE, gain.shape[1], 2):
        k = column & _ROW
        g0, g1 = gain[j, k], gain[j, k + 1]
        for s in range(lanes):
            y[to, s] += g0 * force[k, s] + g1 * force[k + 1, s]


@part
def _solve(kind, stiffness, damping, own, parameters, j, y, ahead, force, lanes):
    """The force of law j, from what it saw at the start and would see ahead."""
    j &= _ROW
    at = 3 * j
    if kind == _PLAY:
        for s in range(lanes):
            force[j, s] = play_force(
                y[j, s], ahead[0, s], parameters[at, s], stiffness, damping, own
            )
    elif kind == _FRICTION:
        for s in range(lanes):
            force[j, s] = friction_force(y[j, s], ahead[0, s], parameters[at, s], own)
    elif kind == STRIBECK:
        for s in range(lanes):
            w = 0.5 * (y[j, s] + ahead[0, s] + own * force[j, s])
            most = peaked_friction(
                w, parameters[at, s], parameters[at + 1, s], parameters[at + 2, s]
            )
            force[j, s] = friction_force(y[j, s], ahead[0, s], most, own)
    elif kind == _EXCESS:
        for s in range(lanes):
            centre = parameters[at + 1, s]
            force[j, s] = excess_force(y[j, s] - centre, ahead[0, s] - centre, parameters[at, s])
    else:
        for s in range(lanes):
            force[j, s] = cubic_force(y[j, s], ahead[0, s], force[j, s], parameters[at, s], own)


@part
def _solve_pair(gain, parameters, j, y, ahead, force, lanes):
    """The forces of laws j and j + 1, two hardening springs."""
    j &= _ROW
    at, yy, yz, zy, zz = 3 * j, gain[j, j], gain[j, j + 1], gain[j + 1, j], gain[j + 1, j + 1]
    for s in range(lanes):
        force[j, s], force[j + 1, s] = cubic_pair(
            y[j, s], y[j + 1, s], ahead[0, s], ahead[1, s], force[j, s], force[j + 1, s],
            parameters[at, s], parameters[at + 3, s], yy, yz, zy, zz,
        )  # fmt: skip


@part
def _accumulate(table, tick, y, m, total, lanes):
    """Add the output, row m of y, to the Fourier sums and keep its largest magnitude."""
    m &= _ROW
    c1, s1, c2 = table[tick, 0], table[tick, 1], table[tick, 2]
    s2, c3, s3 = table[tick, 3], table[tick, 4], table[tick, 5]
    for s in range(lanes):
        output = y[m, s]
        total[0, s] += output
        total[1, s] += c1 * output
        total[2, s] += s1 * output
        total[3, s] += c2 * output
        total[4, s] += s2 * output
        total[5, s] += c3 * output
        total[6, s] += s3 * output
        total[7, s] = max(total[7, s], abs(output))


@loop
def step_cycles(carry, push, drift_in, look, gain, kinds, fixed, parameters, waves, table,
                order, settle_cycles, start, seen, sums, peak):  # fmt: skip
    """Step coordinates through settle and kept cycles.

    Parameters
    ----------
    carry, push, drift_in
        (p, 2) or (p, p); (p, f); (p, lanes): one step of coordinates q, p of
        them, see `sim.propagator.Propagator`. f is the number of laws, padded.
    look, gain
        (m + 1, rows), (m + 1, f): what each law and, last, the output see of
        the coordinates and of the forces.
    kinds, fixed, parameters
        (m,); (m, 2) stiffness and damping over the step; (3 m, lanes).
    waves
        (3 (m + 1), lanes): sine, cosine and constant part of what the drive
        alone makes each of them see.
    table
        (steps, 6): cosine and sine of harmonics 1 to 3 over a cycle.
    order
        Laws in the order in which each step solves them, with the newest forces of the others.
    start, seen
        (p, lanes), (m, lanes): coordinates and what the laws see at the start;
        overwritten by those at the end.
    sums, peak
        (cycles, 7, lanes), (lanes,): the sum, then the products of the output with each
        column of `table` summed over each kept cycle; the largest magnitude.
    """
    p, lanes = start.shape
    m = kinds.shape[0]
    others = gain.copy()
    for j in range(m):
        others[j, j] = 0.0
        if kinds[j] == PAIR:
            others[j, j + 1] = 0.0
            others[j + 1, j] = 0.0
    ticks = table.shape[0]
    q = np.zeros((look.shape[1], MOST_LANES), start.dtype)
    spare = np.zeros((look.shape[1], MOST_LANES), start.dtype)
    drift = np.zeros((p, MOST_LANES), start.dtype)
    force = np.zeros((push.shape[1], MOST_LANES), start.dtype)
    free = np.zeros((m + 1, MOST_LANES), start.dtype)
    y = np.zeros((m + 1, MOST_LANES), start.dtype)
    ahead = np.zeros((2, MOST_LANES), start.dtype)
    wave = np.zeros((3 * (m + 1), MOST_LANES), start.dtype)
    constant = np.zeros((3 * m, MOST_LANES), start.dtype)
    total = np.zeros((8, MOST_LANES), start.dtype)
    for s in range(lanes):
        for i in range(p):
            q[i, s] = start[i, s]
            drift[i, s] = drift_in[i, s]
        for j in range(m):
            y[j, s] = seen[j, s]
        for j in range(3 * m):
            constant[j, s] = parameters[j, s]
        for j in range(3 * m + 3):
            wave[j, s] = waves[j, s]
    for cycle in range(settle_cycles + sums.shape[0]):
        rows = m + 1 if cycle >= settle_cycles else m
        for step in range(ticks):
            tick = step + 1 if step + 1 < ticks else 0
            if carry.shape[1] == 2:
                _turn(carry, push, drift, q, force, lanes)
            else:
                _multiply(carry, push, drift, q, force, spare, lanes)
            _look(look, rows, wave, table[tick, 0], table[tick, 1], q, free, lanes)
            # The first step knows no last forces to start from.
            turns = len(order) if cycle + step > 0 else _FIRST_SWEEPS * len(order)
            for turn in range(turns):
                j = order[turn % len(order)]
                _feel(others, j, force, free, ahead, 0, lanes)
                if kinds[j] == PAIR:
                    _feel(others, j + 1, force, free, ahead, 1, lanes)
                    _solve_pair(gain, constant, j, y, ahead, force, lanes)
                else:
                    _solve(kinds[j], fixed[j, 0], fixed[j, 1], gain[j, j], constant, j, y, ahead,
                           force, lanes)  # fmt: skip
            for j in range(rows):
                _feel(gain, j, force, free, y, j, lanes)
            if cycle >= settle_cycles:
                _accumulate(table, tick, y, m, total, lanes)
        if cycle >= settle_cycles:
            for k in range(7):
                for s in range(lanes):
                    sums[cycle - settle_cycles, k, s] = total[k, s]
                    total[k, s] = 0.0
    _push(push, q, force, lanes)
    for s in range(lanes):
        peak[s] = total[7, s]
        for j in range(m):
            seen[j, s] = y[j, s]
        for i in range(p):
            start[i, s] = q[i, s]
