"""The engine: carries trajectories of a piecewise-linear system through driven stretches.

Owns time. It advances many trajectories (lanes) of one system side by side,
exact in the linear part, symmetric in time where play acts, with friction that
truly sticks, and returns the Fourier coefficients of every drive cycle. It
knows nothing of gears, units or sweeps.

How one step goes. Between switchings the system is linear, so the state is
carried by matrix exponentials (`sim.propagator`). The laws close the loop at
the end of each step: law j sees y_j = y0_j + beta_jj p_j, where y0_j is what it
would see without its own newest force, and that scalar equation is solved in
closed form (`sim.kernel`). A play's force is interpolated linearly over the
step: second order, no numerical damping. Friction is constant over the step
and either stops the motion at the end of it or flips where the velocity passes
zero.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.assembly import Law, PiecewiseLinearSystem
from sim.kernel import COLUMNS_BEYOND, COLUMNS_FIRST, step_cycles
from sim.propagator import Propagator, build_propagator

__all__ = ["HARMONICS", "LONGEST_STEP_S", "Motion", "Stretch", "advance"]

HARMONICS = 4
"""Fourier coefficients kept per cycle: 0 (mean), 1, 2 and 3."""

LONGEST_STEP_S = 5e-6
"""Default bound of the step: a twentieth of the fastest mesh mode of the paper's units."""

_LANE_MULTIPLE = 8
_MOST_LANES = 64


@dataclass(frozen=True, slots=True)
class Stretch:
    """One dwell at one drive frequency; arrays have shape (lanes,).

    The input is amplitude sin(2 pi f t + phase) + offset in V, t counted from
    the start of the stretch. The first `settle_cycles` are stepped, not kept.
    """

    frequency_hz: float
    amplitude: NDArray[np.float64]
    phase: NDArray[np.float64]
    offset: NDArray[np.float64]
    settle_cycles: int
    integrate_cycles: int


@dataclass(frozen=True, slots=True)
class Motion:
    """What came of one stretch.

    `coefficients` (cycles, 4, lanes): V_o = Im(sum_k C_k exp(i k (2 pi f t + phase)))
    for harmonics k of 1 to 3; C_0 is the mean, in V. `peak` (lanes,): largest
    |V_o| in the kept cycles, V. `state` (n, lanes): the state at the end.
    """

    coefficients: NDArray[np.complex128]
    peak: NDArray[np.float64]
    state: NDArray[np.float64]


def advance(
    system: PiecewiseLinearSystem,
    parameters: NDArray[np.float64],
    state: NDArray[np.float64],
    stretches: Sequence[Stretch],
    longest_step_s: float = LONGEST_STEP_S,
) -> Iterator[Motion]:
    """Carry trajectories through stretches, one after the other.

    Parameters
    ----------
    system
        The system shared by all lanes.
    parameters
        (m, 3, lanes): the parameters of each law in each lane.
    state
        (n, lanes): physical state at the start; not changed.
    stretches
        What is driven, in order.
    longest_step_s
        Upper bound of the time step, s.

    Yields
    ------
    Motion
        One per stretch, as soon as it is done.
    """
    for stretch in stretches:
        propagator = build_propagator(system, stretch.frequency_hz, longest_step_s)
        motion = _dwell(system, propagator, parameters, state, stretch)
        state = motion.state
        yield motion


def _dwell(
    system: PiecewiseLinearSystem,
    propagator: Propagator,
    parameters: NDArray[np.float64],
    state: NDArray[np.float64],
    stretch: Stretch,
) -> Motion:
    lanes = state.shape[1]
    cycles = stretch.integrate_cycles
    coefficients = np.empty((cycles, HARMONICS, lanes), dtype=complex)
    peak = np.empty(lanes)
    final = np.empty_like(state)
    tables = _tables(system, propagator)
    for start in range(0, lanes, _MOST_LANES):
        kept = np.arange(start, min(start + _MOST_LANES, lanes))
        # Padding repeats a lane: an idle lane of zeros would run into denormals.
        picked = np.resize(kept, -(-len(kept) // _LANE_MULTIPLE) * _LANE_MULTIPLE)
        sums, tops, ends = _run_block(
            system, propagator, tables, parameters[..., picked], state[:, picked],
            stretch, picked,
        )  # fmt: skip
        width = len(kept)
        coefficients[..., kept] = _coefficients(sums, propagator.steps_per_cycle)[..., :width]
        peak[kept] = tops[:width]
        final[:, kept] = ends[:, :width]
    turn = np.exp(-1j * np.outer(np.arange(HARMONICS), stretch.phase))
    turn[0] = 1.0
    # The kernel counts the phase from the start of the stretch; results count
    # it from the drive.
    return Motion(coefficients * turn, peak, final)


@dataclass(frozen=True, slots=True)
class _Tables:
    """What the kernel needs of the laws, fixed for one system and step."""

    kinds: NDArray[np.int64]
    fixed: NDArray[np.float64]
    rows: NDArray[np.float64]
    rates: NDArray[np.float64]
    beta: NDArray[np.float64]
    beta_rate: NDArray[np.float64]
    feedthrough: NDArray[np.float64]
    matrix: NDArray[np.float64]
    waves: NDArray[np.float64]


def _tables(system: PiecewiseLinearSystem, propagator: Propagator) -> _Tables:
    laws = system.nonlinearities
    n, m = len(system.b), len(laws)
    rows = np.array([law.outlet for law in laws]).reshape(m, n)
    rates = np.array([law.rate for law in laws]).reshape(m, n)
    fixed = np.array(
        [
            (law.stiffness, law.damping, float(law.law is Law.FRICTION and law.parameters[1] != 0))
            for law in laws
        ]
    ).reshape(m, 3)
    beyond = -(-max(n + m - COLUMNS_FIRST, 0) // COLUMNS_BEYOND) * COLUMNS_BEYOND
    matrix = np.zeros((n, COLUMNS_FIRST + beyond))
    matrix[:, :n] = propagator.carry
    matrix[:, n : n + m] = propagator.kick.T
    angle = 2.0 * np.pi * np.arange(propagator.steps_per_cycle) / propagator.steps_per_cycle
    waves = np.stack([wave(k * angle) for k in (1, 2, 3) for wave in (np.cos, np.sin)], axis=1)
    return _Tables(
        kinds=np.array([int(law.law) for law in laws], dtype=np.int64),
        fixed=fixed,
        rows=rows,
        rates=rates,
        beta=rows @ propagator.end.T,
        beta_rate=rates @ propagator.end.T,
        feedthrough=np.array([law.feedthrough for law in laws]),
        matrix=matrix,
        waves=waves,
    )


def _run_block(
    system: PiecewiseLinearSystem,
    propagator: Propagator,
    tables: _Tables,
    parameters: NDArray[np.float64],
    state: NDArray[np.float64],
    stretch: Stretch,
    picked: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    n, m, lanes = len(system.b), len(tables.kinds), len(picked)
    offset = stretch.offset[picked]
    phasor = stretch.amplitude[picked] * np.exp(1j * stretch.phase[picked])
    forced = propagator.drive[:, None] * phasor
    direct = tables.feedthrough[:, None]
    # Im(Y exp(i theta)) = Re(Y) sin(theta) + Im(Y) cos(theta), plus a constant.
    drives = _sine_cosine_mean(tables.rows @ forced + direct * phasor, direct * offset)
    rate_drives = _sine_cosine_mean(tables.rates @ forced, np.zeros((m, lanes)))
    out_drive = _sine_cosine_mean((system.o @ forced)[None, :], np.zeros((1, lanes)))

    columns = np.zeros((tables.matrix.shape[1], lanes))
    seen = np.ascontiguousarray(tables.rows @ state + direct * (phasor.imag + offset))
    p = _initial_forces(tables, parameters, seen, tables.rates @ state)
    columns[:n] = state - forced.imag - propagator.end.T @ p
    columns[n : n + m] = p
    drift = propagator.drift[:, None] + propagator.offset_drift[:, None] * offset
    sums = np.zeros((stretch.integrate_cycles, 7, lanes))
    peak = np.zeros(lanes)
    step_cycles(
        tables.matrix, drift, columns, tables.kinds, tables.fixed,
        np.ascontiguousarray(parameters), tables.rows,
        tables.rates, tables.beta, tables.beta_rate, drives, rate_drives, system.o[None, :],
        (system.o @ propagator.end.T)[None, :], out_drive, tables.waves, seen,
        stretch.settle_cycles, sums, peak,
    )  # fmt: skip
    end = columns[:n] + forced.imag + propagator.end.T @ columns[n : n + m]
    return sums, peak, end


def _sine_cosine_mean(
    phasor: NDArray[np.complex128], mean: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.ascontiguousarray(np.stack([phasor.real, phasor.imag, mean], axis=1))


def _initial_forces(
    tables: _Tables,
    parameters: NDArray[np.float64],
    seen: NDArray[np.float64],
    rate: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Each law's force at the very start; friction has not acted yet."""
    p = np.zeros_like(seen)
    for j, kind in enumerate(tables.kinds):
        limit = parameters[j, 0]
        if kind == Law.PLAY:
            k, c = tables.fixed[j, 0], tables.fixed[j, 1]
            p[j] = k * np.clip(seen[j], -limit, limit) + np.where(
                np.abs(seen[j]) < limit, c * rate[j], 0.0
            )
        elif kind == Law.EXCESS:
            p[j] = np.clip(seen[j], -limit, limit) - seen[j]
        elif kind == Law.CUBIC:
            p[j] = -limit * seen[j] ** 3
    return p


def _coefficients(sums: NDArray[np.float64], steps: int) -> NDArray[np.complex128]:
    """Sums over a cycle to amplitudes C_k with V = Im(C_k exp(i k theta)), C_0 the mean."""
    cosine, sine = sums[:, 1::2], sums[:, 2::2]
    harmonics = (2.0 / steps) * (sine + 1j * cosine)
    return np.concatenate([sums[:, :1] / steps + 0j, harmonics], axis=1)
