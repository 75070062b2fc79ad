"""The engine: carries trajectories of a piecewise-linear system through driven stretches.

Owns time. It advances many trajectories (lanes) of one system side by side,
exact in the linear part, symmetric in time where play acts, with friction that
truly sticks, and returns the Fourier coefficients of every drive cycle. It
knows nothing of gears, units or sweeps.

How one step goes. Between switchings the system is linear, so its modes are
carried exactly (`sim.propagator`). Each law's force is held over the step at
the mean that the law has along it: with y0 and y1 what the law sees at both
ends, y1 = ahead + beta p(y0, y1) is one scalar equation, solved in closed form
(`sim.kernel`). The scheme is second order, the same forwards and
backwards in time, and conserves the energy of springs and play; friction
stops the motion at the end of a step or turns where the velocity passes zero.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sim.assembly import Law, PiecewiseLinearSystem
from sim.kernel import FORCES_AT_ONCE, MOST_LANES, PAIR, ROWS_AT_ONCE, STRIBECK, step_cycles
from sim.propagator import Modes, Propagator, build_propagator, find_modes

__all__ = ["HARMONICS", "LONGEST_STEP_S", "Motion", "Stretch", "advance"]

HARMONICS = 4
"""Fourier coefficients kept per cycle: 0 (mean), 1, 2 and 3."""

LONGEST_STEP_S = 5e-6
"""Default bound of the step: a twentieth of the fastest mesh mode of the paper's units."""

_LANE_MULTIPLE = 8

_HARDENING_SWEEPS = 3
"""Passes where a hardening shaft and a play push one tiny inertia; the shaft goes once more."""

_COUPLED_SWEEPS = 4
"""Passes where one play pushes another within a step, as through a heavily damped shaft."""

_LOOSE = 1e-4
"""Share of its motion that a play may take over from another before that counts."""


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
    single: bool = False,
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
    single
        Step in single precision, at half of the cost; for what is judged by its distribution.
        A system without usable modes is stepped in double all the same.

    Yields
    ------
    Motion
        One per stretch, as soon as it is done.
    """
    modes = find_modes(system)
    # The states of stiff springs hardly differ: their differences need all digits.
    precision = np.float32 if single and modes.rates.size else np.float64
    for stretch in stretches:
        propagator = build_propagator(system, modes, stretch.frequency_hz, longest_step_s)
        motion = _dwell(system, modes, propagator, parameters, state, stretch, precision)
        state = motion.state
        yield motion


def _dwell(
    system: PiecewiseLinearSystem,
    modes: Modes,
    propagator: Propagator,
    parameters: NDArray[np.float64],
    state: NDArray[np.float64],
    stretch: Stretch,
    precision: type[np.floating],
) -> Motion:
    lanes = state.shape[1]
    coefficients = np.empty((stretch.integrate_cycles, HARMONICS, lanes), dtype=complex)
    peak = np.empty(lanes)
    final = np.empty_like(state)
    tables = _tables(system, modes, propagator)
    for start in range(0, lanes, MOST_LANES):
        kept = np.arange(start, min(start + MOST_LANES, lanes))
        # Whole vectors cost less than three lanes one by one. Padding repeats a lane: an idle
        # lane of zeros would run into denormals.
        width = -(-len(kept) // _LANE_MULTIPLE) * _LANE_MULTIPLE if len(kept) > 2 else len(kept)
        picked = np.resize(kept, width)
        sums, tops, ends = _run_block(
            system, modes, propagator, tables, parameters[..., picked], state[:, picked],
            stretch, picked, precision,
        )  # fmt: skip
        own = slice(0, len(kept))
        coefficients[..., kept] = _coefficients(sums, propagator.steps_per_cycle)[..., own]
        peak[kept], final[:, kept] = tops[own], ends[:, own]
    turn = np.exp(-1j * np.outer(np.arange(HARMONICS), stretch.phase))
    turn[0] = 1.0
    # The kernel counts the phase from the start of the stretch; results count
    # it from the drive.
    return Motion(coefficients * turn, peak, final)


@dataclass(frozen=True, slots=True)
class _Tables:
    """What the kernel needs of the laws, fixed for one system and step.

    `rows` (m, n), `feedthrough` (m,): what each law sees of state and input.
    `look`, `gain`, `push`, `kinds`, `fixed`, `waves`, `order`: see `sim.kernel`.
    """

    rows: NDArray[np.float64]
    feedthrough: NDArray[np.float64]
    look: NDArray[np.float64]
    gain: NDArray[np.float64]
    push: NDArray[np.float64]
    kinds: NDArray[np.int64]
    fixed: NDArray[np.float64]
    waves: NDArray[np.float64]
    order: NDArray[np.int64]


def _tables(system: PiecewiseLinearSystem, modes: Modes, propagator: Propagator) -> _Tables:
    laws = system.nonlinearities
    n, m, p = len(system.b), len(laws), modes.shapes.shape[1]
    rows = np.array([law.outlet for law in laws]).reshape(m, n)
    push = np.pad(propagator.push, ((0, 0), (0, max(FORCES_AT_ONCE - m, m % 2))))
    look = np.vstack([rows, system.o]) @ modes.shapes
    gain = look @ push
    kinds = _in_pairs(
        [
            STRIBECK if law.law is Law.FRICTION and law.parameters[1] != 0.0 else int(law.law)
            for law in laws
        ]
    )
    fixed = [(law.stiffness, law.damping / propagator.step_s) for law in laws]
    angle = 2.0 * np.pi * np.arange(propagator.steps_per_cycle) / propagator.steps_per_cycle
    waves = np.stack([wave(k * angle) for k in (1, 2, 3) for wave in (np.cos, np.sin)], axis=1)
    return _Tables(
        rows=rows,
        feedthrough=np.array([law.feedthrough for law in laws]),
        look=np.pad(look, ((0, 0), (0, max(ROWS_AT_ONCE - p, 0)))),
        gain=gain,
        push=push,
        kinds=np.array(kinds, dtype=np.int64),
        fixed=np.array(fixed).reshape(m, 2),
        waves=waves,
        order=np.array(_order(kinds, gain, fixed), dtype=np.int64),
    )


def _in_pairs(kinds: list[int]) -> list[int]:
    """Mark the first of two hardening springs in a row, so that they are solved together."""
    kinds = kinds.copy()
    for j in range(len(kinds) - 1):
        led = j > 0 and kinds[j - 1] == PAIR
        if kinds[j] == kinds[j + 1] == Law.CUBIC and not led:
            kinds[j] = PAIR
    return kinds


def _order(
    kinds: list[int], gain: NDArray[np.float64], fixed: list[tuple[float, float]]
) -> list[int]:
    """Laws in an order that settles what they do to each other within one step.

    Where springs harden, they and the plays are gone through until they agree; what acts on
    the heavy inertias alone follows once.
    """
    followers = [j + 1 for j, kind in enumerate(kinds) if kind == PAIR]
    once = [j for j in range(len(kinds)) if j not in followers]
    springs = [j for j in once if kinds[j] in (Law.CUBIC, PAIR)]
    plays = [j for j in once if kinds[j] == Law.PLAY]
    slope = np.array([fixed[j][0] + 2.0 * fixed[j][1] for j in plays])
    taken_over = np.abs(gain[np.ix_(plays, plays)]) * slope
    np.fill_diagonal(taken_over, 0.0)
    sweeps = _COUPLED_SWEEPS if taken_over.max(initial=0.0) > _LOOSE else 1
    if not springs:
        return once * sweeps
    rest = [j for j in once if j not in springs and j not in plays]
    return (springs + plays) * max(sweeps, _HARDENING_SWEEPS) + springs + rest


def _run_block(
    system: PiecewiseLinearSystem,
    modes: Modes,
    propagator: Propagator,
    tables: _Tables,
    parameters: NDArray[np.float64],
    state: NDArray[np.float64],
    stretch: Stretch,
    picked: NDArray[np.int64],
    precision: type[np.floating],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    offset = stretch.offset[picked]
    phasor = stretch.amplitude[picked] * np.exp(1j * stretch.phase[picked])
    forced = propagator.drive[:, None] * phasor
    direct = tables.feedthrough[:, None]
    seen = _times(tables.rows, state) + direct * (phasor.imag + offset)
    # Im(Y exp(i theta)) = Re(Y) sin(theta) + Im(Y) cos(theta), plus a constant.
    through = _times(np.vstack([tables.rows, system.o]), forced)
    through[:-1] += direct * phasor
    constant = np.vstack([direct * offset, np.zeros_like(offset)])
    coordinates = _times(modes.weights, state - forced.imag)
    waves = np.stack([through.real, through.imag, constant], axis=1)
    drift = propagator.drift[:, None] + propagator.offset_drift[:, None] * offset
    own = partial(np.ascontiguousarray, dtype=precision)
    q, y = own(coordinates), own(seen)
    sums = np.zeros((stretch.integrate_cycles, 7, len(picked)), precision)
    peak = np.zeros(len(picked), precision)
    step_cycles(
        own(propagator.carry), own(tables.push), own(drift), own(tables.look), own(tables.gain),
        tables.kinds, own(tables.fixed), own(parameters.reshape(-1, len(picked))),
        own(waves.reshape(-1, len(picked))), own(tables.waves), tables.order,
        stretch.settle_cycles, q, y, sums, peak,
    )  # fmt: skip
    end = _times(modes.shapes, q.astype(float)) + forced.imag
    return sums.astype(float), peak.astype(float), end


def _times(matrix: NDArray[np.float64], columns: NDArray) -> NDArray:
    """Product in one order of additions; BLAS would choose it by the number of columns."""
    total = np.zeros((len(matrix), columns.shape[1]), dtype=columns.dtype)
    for row, column in enumerate(columns):
        total += np.multiply.outer(matrix[:, row], column)
    return total


def _coefficients(sums: NDArray[np.float64], steps: int) -> NDArray[np.complex128]:
    """Sums over a cycle to amplitudes C_k with V = Im(C_k exp(i k theta)), C_0 the mean."""
    cosine, sine = sums[:, 1::2], sums[:, 2::2]
    harmonics = (2.0 / steps) * (sine + 1j * cosine)
    return np.concatenate([sums[:, :1] / steps + 0j, harmonics], axis=1)
