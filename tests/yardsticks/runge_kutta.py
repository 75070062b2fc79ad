"""What an explicit scheme can do at best: the bare servo, Runge-Kutta, lanes side by side.

Owns a lean fourth-order Runge-Kutta of the paper's 13 states with true sign()
friction and no extras, as fast as plain numba makes it. The oracle answers
whether a result is right; this one what a fine step costs.
"""

from __future__ import annotations

import math

import numpy as np
from worlds.side_by_side import half_plays
from yardsticks.matrices import OUTPUT, STATES

from sim.engine.compiling import njit


def constants(unit, ratio: float, c_s1: float = 0.0) -> tuple[float, ...]:
    """The numbers in the equations, in the order in which `_rates` takes them apart."""
    p, (d1, d2) = unit.parameters, half_plays(unit, ratio)
    return (
        1.0 / p["L_a"], p["R_m"], p["k_b"], p["k_a"], p["k_t"], 1.0 / p["J_m"], p["B_m"],
        p["T_f_m"], 1.0 / p["N_1"], p["k_g1"], d1, 1.0 / p["J_g1"], 2.0 * p["k_s1"], 2.0 * c_s1,
        1.0 / p["J_s1"], 1.0 / p["J_p2"], 1.0 / p["N"], p["k_2"], d2, 1.0 / p["J_L"], p["T_f_L"],
        723439.0 * p["k_ts"],
    )  # fmt: skip


_inlined = njit(inline="always", fastmath={"contract"}, error_model="numpy")


@_inlined
def _sign(x):
    return (1.0 if x > 0.0 else 0.0) - (1.0 if x < 0.0 else 0.0)


@_inlined
def _rates(m, V_i, i_a, th_m, w_m, th_g1, w_g1, th_s1, w_s1, th_p2, w_p2, th_L, w_L, V_o, dV_o):
    (iL_a, R_m, k_b, k_a, k_t, iJ_m, B_m, T_f_m, iN_1, k_g1, d1, iJ_g1, k_s, c_s, iJ_s1, iJ_p2,
     iN, k_2, d2, iJ_L, T_f_L, filtered) = m  # fmt: skip
    y1 = th_m * iN_1 - th_g1
    y2 = th_p2 * iN - th_L
    T_g1 = k_g1 * (y1 - min(max(y1, -d1), d1))
    T_L = k_2 * (y2 - min(max(y2, -d2), d2))
    T_a = k_s * (th_g1 - th_s1) + c_s * (w_g1 - w_s1)
    T_c = k_s * (th_s1 - th_p2) + c_s * (w_s1 - w_p2)
    return (
        (k_a * V_i - R_m * i_a - k_b * w_m) * iL_a,
        w_m,
        (k_t * i_a - T_g1 * iN_1 - B_m * w_m - T_f_m * _sign(w_m)) * iJ_m,
        w_g1,
        (T_g1 - T_a) * iJ_g1,
        w_s1,
        (T_a - T_c) * iJ_s1,
        w_p2,
        (T_c - T_L * iN) * iJ_p2,
        w_L,
        (T_L - T_f_L * _sign(w_L)) * iJ_L,
        dV_o,
        filtered * w_m - 1710.0 * dV_o - 723439.0 * V_o,
    )


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def _run(m, source, h, cycles, x, sums):
    ticks, lanes = (len(source) - 1) // 2, x.shape[1]
    half, sixth = 0.5 * h, h / 6.0
    for cycle in range(cycles):
        for tick in range(ticks):
            V0, V1, V2 = source[2 * tick], source[2 * tick + 1], source[2 * tick + 2]
            angle = 2.0 * math.pi * tick / ticks
            cosine, sine = math.cos(angle), math.sin(angle)
            for s in range(lanes):
                a0, a1, a2, a3, a4 = x[0, s], x[1, s], x[2, s], x[3, s], x[4, s]
                a5, a6, a7, a8 = x[5, s], x[6, s], x[7, s], x[8, s]
                a9, a10, a11, a12 = x[9, s], x[10, s], x[11, s], x[12, s]
                sums[cycle, 0, s] += cosine * a11
                sums[cycle, 1, s] += sine * a11
                k = _rates(m, V0, a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12)
                p = _rates(m, V1, a0 + half * k[0], a1 + half * k[1], a2 + half * k[2],
                           a3 + half * k[3], a4 + half * k[4], a5 + half * k[5], a6 + half * k[6],
                           a7 + half * k[7], a8 + half * k[8], a9 + half * k[9],
                           a10 + half * k[10], a11 + half * k[11],
                           a12 + half * k[12])  # fmt: skip
                q = _rates(m, V1, a0 + half * p[0], a1 + half * p[1], a2 + half * p[2],
                           a3 + half * p[3], a4 + half * p[4], a5 + half * p[5], a6 + half * p[6],
                           a7 + half * p[7], a8 + half * p[8], a9 + half * p[9],
                           a10 + half * p[10], a11 + half * p[11],
                           a12 + half * p[12])  # fmt: skip
                r = _rates(m, V2, a0 + h * q[0], a1 + h * q[1], a2 + h * q[2], a3 + h * q[3],
                           a4 + h * q[4], a5 + h * q[5], a6 + h * q[6], a7 + h * q[7],
                           a8 + h * q[8], a9 + h * q[9], a10 + h * q[10], a11 + h * q[11],
                           a12 + h * q[12])  # fmt: skip
                x[0, s] = a0 + sixth * (k[0] + 2.0 * (p[0] + q[0]) + r[0])
                x[1, s] = a1 + sixth * (k[1] + 2.0 * (p[1] + q[1]) + r[1])
                x[2, s] = a2 + sixth * (k[2] + 2.0 * (p[2] + q[2]) + r[2])
                x[3, s] = a3 + sixth * (k[3] + 2.0 * (p[3] + q[3]) + r[3])
                x[4, s] = a4 + sixth * (k[4] + 2.0 * (p[4] + q[4]) + r[4])
                x[5, s] = a5 + sixth * (k[5] + 2.0 * (p[5] + q[5]) + r[5])
                x[6, s] = a6 + sixth * (k[6] + 2.0 * (p[6] + q[6]) + r[6])
                x[7, s] = a7 + sixth * (k[7] + 2.0 * (p[7] + q[7]) + r[7])
                x[8, s] = a8 + sixth * (k[8] + 2.0 * (p[8] + q[8]) + r[8])
                x[9, s] = a9 + sixth * (k[9] + 2.0 * (p[9] + q[9]) + r[9])
                x[10, s] = a10 + sixth * (k[10] + 2.0 * (p[10] + q[10]) + r[10])
                x[11, s] = a11 + sixth * (k[11] + 2.0 * (p[11] + q[11]) + r[11])
                x[12, s] = a12 + sixth * (k[12] + 2.0 * (p[12] + q[12]) + r[12])


def drive(m, state, frequency_hz: float, cycles: int, source_vpk: float, step_s: float):
    """V_o/V_i of each cycle, (cycles, lanes), from a state (13, lanes) that is not changed."""
    steps = math.ceil(1.0 / (frequency_hz * step_s) - 1e-9)
    source = source_vpk * np.sin(np.pi * np.arange(2 * steps + 1) / steps)
    x = np.array(state, dtype=float)
    assert x.shape[0] == STATES > OUTPUT
    sums = np.zeros((cycles, 2, x.shape[1]))
    _run(m, source, 1.0 / (frequency_hz * steps), cycles, x, sums)
    return 2.0 * (sums[:, 1] + 1j * sums[:, 0]) / steps / source_vpk
