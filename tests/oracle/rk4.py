"""The oracle: the paper's equations of motion written out by hand and stepped by explicit RK4.

Owns an independent answer to "what does this servo do", for the tests alone.
It knows nothing of elements, assemblies, regimes or matrix exponentials, and
must never import a module of the project: parameters come as a plain mapping
of the paper's symbols, so that a mistake in the engine cannot be shared here.

Friction is a true sign(), with sign(0) = 0; play is a dead zone. The step is
the caller's: 2 microseconds or finer resolves the undamped mesh modes (5 to
9 kHz) almost without numerical damping.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from sim.engine.compiling import njit

STATES = (
    "i_a", "th_m", "w_m", "th_g1", "w_g1", "th_s1", "w_s1", "th_p2", "w_p2",
    "th_L", "w_L", "V_o", "dV_o", "u_a", "th_p", "w_p", "z_L",
)  # fmt: skip
"""Order of the state vector; u_a is the lagged amplifier voltage, th_p, w_p the payload, z_L how
far the load's friction is bent before it slips."""

HARMONICS = 4


class Machine(NamedTuple):
    """Every number in the equations; the paper's symbols, SI, half plays in rad.

    The last six are causes that the project itself knows nothing of, for studies of what it says
    then: `V_d`, a dead zone of the amplifier about 0 (V at the motor); `u_p`, the share by which it
    gives more where its output is positive; `i_max`, a limit of the current that makes torque;
    `T_cog`, amplitude of a cogging torque on the motor, 24 times a turn; `D_L`, drag of air on the
    load, N.m.s2/rad2; `s_L`, stiffness of the load's friction before it slips, N.m/rad
    (P. R. Dahl, 1968).
    """

    L_a: float
    R_m: float
    k_b: float
    k_t: float
    J_m: float
    B_m: float
    T_f_m: float
    k_a: float
    k_ts: float
    filter_numerator: float
    filter_a1: float
    filter_a0: float
    N_1: float
    k_g1: float
    J_g1: float
    k_s1: float
    J_s1: float
    J_p2: float
    N: float
    k_2: float
    J_L: float
    T_f_L: float
    delta_1: float
    delta_2: float
    B_L: float = 0.0
    c_s1: float = 0.0
    c_g1: float = 0.0
    c_2: float = 0.0
    T_s_L: float = 0.0
    omega_s: float = 1.0
    h: float = 0.0
    K_c: float = 0.0
    T_b: float = 0.0
    J_p: float = 0.0
    f_p: float = 0.0
    zeta_p: float = 0.0
    V_sat: float = math.inf
    tau_a: float = 0.0
    V_d: float = 0.0
    u_p: float = 0.0
    i_max: float = math.inf
    T_cog: float = 0.0
    D_L: float = 0.0
    s_L: float = 0.0


PAPER_FILTER = {"filter_numerator": 723439.0, "filter_a1": 1710.0, "filter_a0": 723439.0}
"""Equation (4)."""


def machine(
    parameters: Mapping[str, float],
    delta1: float,
    delta2: float,
    extras: Mapping[str, float] | None = None,
) -> Machine:
    """Gather parameters, half plays (rad) and extras; an unknown extra is a KeyError."""
    numbers: dict[str, float] = {**PAPER_FILTER, **parameters, **(extras or {})}
    numbers.update(delta_1=delta1, delta_2=delta2)
    unknown = set(extras or {}) - set(Machine._fields)
    if unknown:
        raise KeyError(f"the oracle has no parameter {sorted(unknown)}")
    return Machine(**{k: float(v) for k, v in numbers.items() if k in Machine._fields})


@njit(cache=True)
def _sign(x):
    if x > 0.0:
        return 1.0
    if x < 0.0:
        return -1.0
    return 0.0


@njit(cache=True)
def _mesh_torque(k, c, angle, rate, delta):
    # Equation (6) with a damper that acts while the teeth touch.
    if angle > delta:
        return k * (angle - delta) + c * rate
    if angle < -delta:
        return k * (angle + delta) + c * rate
    return 0.0


@njit(cache=True)
def _shaft_torque(m, angle, rate):
    # Half of shaft 1: stiffness 2 k_s1, hardening h, damper 2 c_s1.
    return 2.0 * m.k_s1 * angle * (1.0 + m.h * angle * angle) + 2.0 * m.c_s1 * rate


@njit(cache=True)
def _derivative(m, V_i, y, dy):
    i_a, th_m, w_m, th_g1, w_g1 = y[0], y[1], y[2], y[3], y[4]
    th_s1, w_s1, th_p2, w_p2, th_L, w_L = y[5], y[6], y[7], y[8], y[9], y[10]
    V_o, dV_o, u_a, th_p, w_p, z_L = y[11], y[12], y[13], y[14], y[15], y[16]

    # (1), with a lag, a dead zone and a clip of the motor voltage; (2a), (2b)
    V_m = m.k_a * V_i
    dy[13] = 0.0
    if m.tau_a > 0.0:
        dy[13] = (V_m - u_a) / m.tau_a
        V_m = u_a
    V_m = max(V_m - m.V_d, 0.0) + min(V_m + m.V_d, 0.0)
    if V_m > 0.0:
        V_m *= 1.0 + m.u_p
    V_m = min(max(V_m, -m.V_sat), m.V_sat)
    dy[0] = (V_m - m.R_m * i_a - m.k_b * w_m) / m.L_a
    T_m = m.k_t * min(max(i_a, -m.i_max), m.i_max)
    if m.T_cog != 0.0:
        T_m += m.T_cog * math.sin(24.0 * th_m)

    # (6), (7) and (11), (12)
    T_g1 = _mesh_torque(m.k_g1, m.c_g1, th_m / m.N_1 - th_g1, w_m / m.N_1 - w_g1, m.delta_1)
    T_L = _mesh_torque(m.k_2, m.c_2, th_p2 / m.N - th_L, w_p2 / m.N - w_L, m.delta_2)
    T_a = _shaft_torque(m, th_g1 - th_s1, w_g1 - w_s1)
    T_c = _shaft_torque(m, th_s1 - th_p2, w_s1 - w_p2)

    # (5)
    dy[1] = w_m
    dy[2] = (T_m - T_g1 / m.N_1 - m.B_m * w_m - m.T_f_m * _sign(w_m)) / m.J_m
    # (8), (9), (10)
    dy[3] = w_g1
    dy[4] = (T_g1 - T_a) / m.J_g1
    dy[5] = w_s1
    dy[6] = (T_a - T_c) / m.J_s1
    dy[7] = w_p2
    dy[8] = (T_c - T_L / m.N) / m.J_p2

    # (14) with everything that may hang on the load
    T_f = m.T_f_L
    if m.T_s_L != 0.0:
        T_f += m.T_s_L * math.exp(-((w_L / m.omega_s) ** 2))
    held = T_f * _sign(w_L)
    dy[16] = 0.0
    if m.s_L > 0.0:
        held = m.s_L * z_L
        dy[16] = w_L - abs(w_L) * held / T_f
    torque = T_L - held - m.B_L * w_L - m.D_L * w_L * abs(w_L) - m.K_c * th_L + m.T_b
    dy[14] = 0.0
    dy[15] = 0.0
    if m.J_p > 0.0:
        w_0 = 2.0 * math.pi * m.f_p
        T_p = m.J_p * w_0 * (w_0 * (th_L - th_p) + 2.0 * m.zeta_p * (w_L - w_p))
        torque -= T_p
        dy[14] = w_p
        dy[15] = T_p / m.J_p
    dy[9] = w_L
    dy[10] = torque / m.J_L

    # (3), (4)
    dy[11] = dV_o
    dy[12] = m.filter_numerator * m.k_ts * w_m - m.filter_a1 * dV_o - m.filter_a0 * V_o


@njit(cache=True)
def _step(m, V_0, V_half, V_1, dt, y, k, trial):
    n = y.size
    _derivative(m, V_0, y, k[0])
    for j in range(n):
        trial[j] = y[j] + 0.5 * dt * k[0, j]
    _derivative(m, V_half, trial, k[1])
    for j in range(n):
        trial[j] = y[j] + 0.5 * dt * k[1, j]
    _derivative(m, V_half, trial, k[2])
    for j in range(n):
        trial[j] = y[j] + dt * k[2, j]
    _derivative(m, V_1, trial, k[3])
    for j in range(n):
        y[j] += dt / 6.0 * (k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j])


@njit(cache=True)
def _source_table(amplitude, offset, half_steps):
    # One cycle at twice the step rate: RK4 needs the source at mid-step as well.
    source = np.empty(half_steps + 1)
    for j in range(half_steps + 1):
        source[j] = offset + amplitude * math.sin(2.0 * math.pi * j / half_steps)
    return source


@njit(cache=True)
def _run_cycles(m, amplitude, offset, frequency, steps, cycles, y):
    k = np.empty((4, y.size))
    trial = np.empty(y.size)
    dt = 1.0 / (frequency * steps)
    source = _source_table(amplitude, offset, 2 * steps)
    turn = np.exp(-2j * math.pi * np.arange(steps) / steps)
    sums = np.zeros((cycles, 4), np.complex128)
    for cycle in range(cycles):
        for j in range(steps):
            V_o = y[11]
            for harmonic in range(4):
                sums[cycle, harmonic] += V_o * turn[(harmonic * j) % steps]
            _step(m, source[2 * j], source[2 * j + 1], source[2 * j + 2], dt, y, k, trial)
    return sums / steps


@njit(cache=True)
def _record(m, amplitude, offset, frequency, steps, cycles, y, every):
    k = np.empty((4, y.size))
    trial = np.empty(y.size)
    dt = 1.0 / (frequency * steps)
    source = _source_table(amplitude, offset, 2 * steps)
    kept = np.empty((cycles * steps // every + 1, y.size))
    kept[0] = y
    row = 1
    for n in range(cycles * steps):
        j = n % steps
        _step(m, source[2 * j], source[2 * j + 1], source[2 * j + 2], dt, y, k, trial)
        if (n + 1) % every == 0:
            kept[row] = y
            row += 1
    return kept


def _start(state: Any) -> np.ndarray:
    return np.zeros(len(STATES)) if state is None else np.array(state, dtype=float)


def steps_per_cycle(frequency_hz: float, step_s: float) -> int:
    """Steps that make up one drive cycle, none longer than `step_s`."""
    return math.ceil(1.0 / (frequency_hz * step_s) - 1e-9)


def simulate_cycles(
    parameters: Mapping[str, float],
    delta1: float,
    delta2: float,
    source_vpk: float,
    frequency_hz: float,
    cycles: int,
    step_s: float = 2e-6,
    state: Any = None,
    extras: Mapping[str, float] | None = None,
    dc_offset_v: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Drive with V_i = offset + A sin(2 pi f t) for whole cycles, phase 0 first.

    Returns coefficients, shape (cycles, 4), and the state at the end, shape
    (17,) in the order of `STATES`. Column 0 is the mean of V_o over A, column
    1 the gain V_o/V_i, columns 2 and 3 the phasor of that harmonic of V_o, on
    the source's phasor like the gain: column h is the c in
    V_o = A |c| sin(h w t + arg c).
    """
    m = machine(parameters, delta1, delta2, extras)
    y = _start(state)
    steps = steps_per_cycle(frequency_hz, step_s)
    mean = _run_cycles(m, source_vpk, dc_offset_v, frequency_hz, steps, cycles, y)
    # A sin(wt) has the mean product -jA/2 with exp(-jwt); mean 0 is a mean as it stands.
    return mean / source_vpk * np.array([1.0, 2j, 2j, 2j]), y


def record(
    parameters: Mapping[str, float],
    delta1: float,
    delta2: float,
    source_vpk: float,
    frequency_hz: float,
    cycles: int,
    step_s: float = 2e-6,
    state: Any = None,
    extras: Mapping[str, float] | None = None,
    dc_offset_v: float = 0.0,
    every: int = 1,
) -> tuple[np.ndarray, np.ndarray]:
    """Times (s), shape (rows,), and states, shape (rows, 17), at each `every`-th step."""
    m = machine(parameters, delta1, delta2, extras)
    steps = steps_per_cycle(frequency_hz, step_s)
    kept = _record(m, source_vpk, dc_offset_v, frequency_hz, steps, cycles, _start(state), every)
    return np.arange(len(kept)) * every / (frequency_hz * steps), kept


def sweep(
    parameters: Mapping[str, float],
    delta1: float,
    delta2: float,
    source_vpk: float,
    frequencies_hz: Sequence[float],
    settle_cycles: int = 20,
    integrate_cycles: int = 30,
    step_s: float = 2e-6,
    from_rest: bool = False,
    extras: Mapping[str, float] | None = None,
    dc_offset_v: float = 0.0,
) -> np.ndarray:
    """Per-cycle coefficients of a stepped sweep, shape (points, integrate_cycles, 4).

    Frequencies are visited in the order given; the state carries on from point
    to point unless `from_rest`.
    """
    state = None
    kept = []
    for frequency in frequencies_hz:
        coefficients, state = simulate_cycles(
            parameters,
            delta1,
            delta2,
            source_vpk,
            float(frequency),
            settle_cycles + integrate_cycles,
            step_s,
            None if from_rest else state,
            extras,
            dc_offset_v,
        )
        kept.append(coefficients[settle_cycles:])
    return np.array(kept)
