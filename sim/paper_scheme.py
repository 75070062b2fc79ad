"""The paper's own simulation: fixed-step fourth-order Runge-Kutta at 10 microseconds.

Owns one procedure, kept so that the published numbers can be met on their own
ground. At this step the scheme takes a fifth and more of the amplitude of the
undamped mesh modes (5 to 9 kHz) out of every drive cycle, as if the meshes had
dampers, and that shifts both features by some hertz. So this module serves the
reproduction of the paper and must never serve a simulation, an estimate or a
diagnosis; those use the exact engine.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.engine.compiling import njit
from sim.unit import StageBacklash, Unit

__all__ = ["PAPER_LEVEL_VPK", "PAPER_STEP_S", "paper_gains"]

PAPER_STEP_S = 1e-5
"""Fixed step of the paper, s."""

PAPER_LEVEL_VPK = 2.5
"""Source level of the paper, V peak."""

_STATES = 13
# i_a, w_m, th_m, th_g1, w_g1, th_s1, w_s1, th_p2, w_p2, th_L, w_L, V_o, dV_o
_TH_G1, _TH_S1, _TH_P2, _TH_L, _V_O = 3, 5, 7, 9, 11


class _Numbers(NamedTuple):
    """The numbers in equations (1) to (20); symbols are the paper's."""

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


def paper_gains(
    unit: Unit,
    backlash: StageBacklash,
    frequencies_hz: Sequence[float],
    *,
    starts: int = 8,
    start_spread: float = 1e-3,
    seed: int = 0,
    source_vpk: float = PAPER_LEVEL_VPK,
    settle_cycles: int = 60,
    integrate_cycles: int = 40,
    step_s: float = PAPER_STEP_S,
    progress: Callable[[], None] | None = None,
) -> NDArray[np.complex128]:
    """Simulate the paper's measurement from several starts at rest.

    Each (start, frequency) is one run: from rest, settled, then the Fourier
    coefficient of V_o over V_i read off once. The first start is the plain
    one: source phase zero, every mesh in the middle of its play. The others
    stand off it by a source phase and, for each mesh, an angle, drawn evenly
    from `start_spread` of half a turn and of half the play. A small spread
    repeats one procedure and shows what chaos alone makes of it; a spread of
    1 lets the train stand anywhere in its play and the source come on at any
    phase, which also finds responses that exist side by side.

    Parameters
    ----------
    unit, backlash
        The servo and the play of both stages.
    frequencies_hz
        Drive frequencies, Hz.
    starts
        Number of runs per frequency.
    start_spread
        How far the starts lie apart, 0 to 1.
    seed
        Seed of the starts.
    source_vpk
        Source level, V peak.
    settle_cycles, integrate_cycles
        Drive cycles waited, then read.
    step_s
        Fixed step, s. The whole point of the scheme is the paper's own.
    progress
        Called after each frequency, from the thread that asked.

    Returns
    -------
    ndarray of complex, shape (starts, frequencies)
        V_o/V_i of every run.
    """
    numbers = _numbers(unit, backlash)
    frequencies = np.asarray(frequencies_hz, dtype=float)
    phases, states = _starts(numbers, starts, start_spread, np.random.default_rng(seed))
    gains = np.empty((starts, frequencies.size), dtype=np.complex128)

    def run(frequency: float) -> NDArray[np.complex128]:
        cycle = 1.0 / (frequency * step_s)
        settle, last = (round(n * cycle) for n in (settle_cycles, settle_cycles + integrate_cycles))
        sums = _drive(numbers, source_vpk, phases, frequency, step_s, settle, last, states.copy())
        return 2j * sums * np.exp(-1j * phases) / (source_vpk * (last - settle))

    # The kernel lets go of the interpreter, so plain threads fill the cores.
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        for column, of_starts in enumerate(pool.map(run, frequencies)):
            gains[:, column] = of_starts
            if progress is not None:
                progress()
    return gains


def _numbers(unit: Unit, backlash: StageBacklash) -> _Numbers:
    delta_1, delta_2 = backlash.half_plays_rad
    parameters = unit.parameters
    numerator, denominator = unit.electronics.filter_numerator, unit.electronics.filter_denominator
    # The paper's units have one.
    assert numerator is not None
    assert denominator is not None
    a2, a1, a0 = denominator
    parameters.update(
        filter_numerator=numerator / a2,
        filter_a1=a1 / a2,
        filter_a0=a0 / a2,
        delta_1=delta_1,
        delta_2=delta_2,
    )
    return _Numbers(**{name: parameters[name] for name in _Numbers._fields})


def _starts(
    numbers: _Numbers, starts: int, spread: float, generator: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Source phases (starts,) in rad, and states at rest (13, starts)."""
    phases, in_mesh_1, in_mesh_2 = generator.uniform(-spread, spread, (3, starts))
    phases[0] = in_mesh_1[0] = in_mesh_2[0] = 0.0
    states = np.zeros((_STATES, starts))
    # th_m stays 0, so th_d1 = -th_g1 (7); shaft 1 is relaxed; th_d2 = th_p2/N - th_L (12).
    at_shaft = -in_mesh_1 * numbers.delta_1
    states[[_TH_G1, _TH_S1, _TH_P2]] = at_shaft
    states[_TH_L] = at_shaft / numbers.N - in_mesh_2 * numbers.delta_2
    return math.pi * phases, states


@njit(cache=True, nogil=True, fastmath=True)
def _derivative(m, V_i, y, dy):
    """Equations (1) to (20) for all starts at once; arrays (13, starts), V_i (starts,)."""
    for n in range(V_i.size):
        i_a, w_m, th_m, th_g1, w_g1 = y[0, n], y[1, n], y[2, n], y[3, n], y[4, n]
        th_s1, w_s1, th_p2, w_p2 = y[5, n], y[6, n], y[7, n], y[8, n]
        th_L, w_L, V_o, dV_o = y[9, n], y[10, n], y[11, n], y[12, n]
        th_d1 = th_m / m.N_1 - th_g1
        th_d2 = th_p2 / m.N - th_L
        # A dead zone is its argument less the part that the play swallows.
        T_g1 = m.k_g1 * (th_d1 - min(max(th_d1, -m.delta_1), m.delta_1))
        T_L = m.k_2 * (th_d2 - min(max(th_d2, -m.delta_2), m.delta_2))
        sign_m = 1.0 * (w_m > 0.0) - 1.0 * (w_m < 0.0)
        sign_L = 1.0 * (w_L > 0.0) - 1.0 * (w_L < 0.0)
        dy[0, n] = (m.k_a * V_i[n] - m.R_m * i_a - m.k_b * w_m) / m.L_a
        dy[1, n] = (m.k_t * i_a - T_g1 / m.N_1 - m.B_m * w_m - m.T_f_m * sign_m) / m.J_m
        dy[2, n] = w_m
        dy[3, n] = w_g1
        dy[4, n] = (T_g1 - 2.0 * m.k_s1 * (th_g1 - th_s1)) / m.J_g1
        dy[5, n] = w_s1
        dy[6, n] = (2.0 * m.k_s1 * (th_g1 + th_p2) - 4.0 * m.k_s1 * th_s1) / m.J_s1
        dy[7, n] = w_p2
        dy[8, n] = (2.0 * m.k_s1 * (th_s1 - th_p2) - T_L / m.N) / m.J_p2
        dy[9, n] = w_L
        dy[10, n] = (T_L - m.T_f_L * sign_L) / m.J_L
        dy[11, n] = dV_o
        dy[12, n] = m.filter_numerator * m.k_ts * w_m - m.filter_a1 * dV_o - m.filter_a0 * V_o


@njit(cache=True, nogil=True, fastmath=True)
def _source(amplitude, cos_phase, sin_phase, turn, V_i):
    # A sin(wt + phase) with turn = exp(jwt).
    for n in range(V_i.size):
        V_i[n] = amplitude * (turn.imag * cos_phase[n] + turn.real * sin_phase[n])


@njit(cache=True, nogil=True, fastmath=True)
def _ahead(y, slope, dt, out):
    for state in range(y.shape[0]):
        for n in range(y.shape[1]):
            out[state, n] = y[state, n] + dt * slope[state, n]


@njit(cache=True, nogil=True, fastmath=True)
def _drive(m, amplitude, phases, frequency, dt, settle, last, y):
    """Step `y` from 0 to `last`; sum V_o exp(-jwt) from step `settle` on, shape (starts,)."""
    cos_phase, sin_phase = np.cos(phases), np.sin(phases)
    sums = np.zeros(phases.size, np.complex128)
    V_i = np.empty(phases.size)
    k1, k2, k3, k4 = (np.empty_like(y), np.empty_like(y), np.empty_like(y), np.empty_like(y))
    trial = np.empty_like(y)
    half_turn = np.exp(1j * math.pi * frequency * dt)
    turn = 1.0 + 0.0j
    for step in range(last):
        if step >= settle:
            for n in range(phases.size):
                sums[n] += y[_V_O, n] * turn.conjugate()
        _source(amplitude, cos_phase, sin_phase, turn, V_i)
        _derivative(m, V_i, y, k1)
        _ahead(y, k1, 0.5 * dt, trial)
        turn *= half_turn
        _source(amplitude, cos_phase, sin_phase, turn, V_i)
        _derivative(m, V_i, trial, k2)
        _ahead(y, k2, 0.5 * dt, trial)
        _derivative(m, V_i, trial, k3)
        _ahead(y, k3, dt, trial)
        turn *= half_turn
        _source(amplitude, cos_phase, sin_phase, turn, V_i)
        _derivative(m, V_i, trial, k4)
        for state in range(y.shape[0]):
            for n in range(phases.size):
                slope = k1[state, n] + 2.0 * (k2[state, n] + k3[state, n]) + k4[state, n]
                y[state, n] += dt / 6.0 * slope
    return sums
