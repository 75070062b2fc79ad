"""The engine: carries trajectories of a piecewise-linear system through driven stretches.

Owns time. It advances many trajectories (lanes) of one system side by side,
exact in the linear part, symmetric in time where play acts, with friction that
truly sticks, and returns the Fourier coefficients of every drive cycle. It
knows nothing of gears, units or sweeps.

How one step goes. Between switchings the system is linear, so its modes are
carried exactly (`sim.propagator`). Each law's force is held over the step at
the mean that the law has along it: with y0 and y1 what the law sees at both
ends, y1 = ahead + beta p(y0, y1) is one scalar equation, solved in closed form
(`sim.laws`). The scheme is second order, the same forwards and
backwards in time, and conserves the energy of springs and play; friction
stops the motion at the end of a step or turns where the velocity passes zero.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from daq.errors import AnalysisError
from sim.assembly import PiecewiseLinearSystem
from sim.kernel import MOST_VECTORS, step_cycles
from sim.layout import SUMS, Layout, Structure
from sim.propagator import Modes, Propagator, build_propagator, find_modes
from sim.solving import kinds_of, law_coefficients, order_of

__all__ = ["HARMONICS", "LONGEST_STEP_S", "Motion", "Stretch", "advance", "carry"]

HARMONICS = 4
"""Fourier coefficients kept per cycle: 0 (mean), 1, 2 and 3."""

LONGEST_STEP_S = 5e-6
"""Default bound of the step: a twentieth of the fastest mesh mode of the paper's units."""


_SELDOM = 0.1
"""Share of the stretches that may be gone through again before a shorter step is kept."""


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

    @property
    def duration_s(self) -> float:
        """How long it takes, s."""
        return (self.settle_cycles + self.integrate_cycles) / self.frequency_hz


@dataclass(frozen=True, slots=True)
class Motion:
    """What came of one stretch.

    `coefficients` (cycles, 4, lanes): V_o = Im(sum_k C_k exp(i k (2 pi f t + phase)))
    for harmonics k of 1 to 3; C_0 is the mean, in V. `peak` (lanes,): largest
    |V_o| in the kept cycles, V. `state` (n, lanes): the state at the end. `step_s`: its time step.
    """

    coefficients: NDArray[np.complex128]
    peak: NDArray[np.float64]
    state: NDArray[np.float64]
    step_s: float


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
    moving = _Moving(system, find_modes(system), single)
    for stretch in stretches:
        motion = _dwell(moving, parameters, state, stretch, longest_step_s)
        state = motion.state
        yield motion


def carry(
    system: PiecewiseLinearSystem,
    parameters: NDArray[np.float64],
    state: NDArray[np.float64],
    stretches: Sequence[Stretch],
    steps_s: Sequence[float],
    single: bool = False,
    done: Callable[[], None] = lambda: None,
) -> list[Motion]:
    """Carry trajectories through stretches, at shorter steps where they grow without bound.

    Parameters
    ----------
    steps_s
        Upper bounds of the time step, s. Each is taken where the one before lets a motion grow
        without bound, for that stretch and the one before it, as growth may have begun before it
        showed; and for all that follow where that happens often. All others keep the first.
    done
        Called after each stretch.

    Raises
    ------
    AnalysisError
        If a motion grew without bound, at the last of the steps.
    """
    longest, *shorter = steps_s
    motions: list[Motion] = []
    grew = 0
    while len(motions) < len(stretches):
        begin = motions[-1].state if motions else state
        if grew > _SELDOM * len(stretches):
            rest = stretches[len(motions) :]
            return motions + carry(system, parameters, begin, rest, shorter, single, done)
        for motion in advance(
            system, parameters, begin, stretches[len(motions) :], longest, single
        ):
            if not np.all(np.isfinite(motion.coefficients)):
                if not shorter:
                    raise AnalysisError(
                        f"the simulated motion at {stretches[len(motions)].frequency_hz:g} Hz grew "
                        "without bound; check the parameters, or take a shorter step"
                    )
                back = max(len(motions) - 1, 0)
                begin = motions[back - 1].state if back else state
                again = stretches[back : len(motions) + 1]
                motions[back:] = carry(system, parameters, begin, again, shorter, single)
                grew += 1
                done()
                break
            motions.append(motion)
            done()
    return motions


@dataclass(frozen=True, eq=False)
class _Moving:
    """A system and its modes, and what does not change with the drive."""

    system: PiecewiseLinearSystem
    modes: Modes
    single: bool

    @cached_property
    def kinds(self) -> tuple[int, ...]:
        """(m,): kinds of its laws."""
        return kinds_of(self.system.nonlinearities)

    @cached_property
    def rows(self) -> NDArray[np.float64]:
        """(m + 1, n): what each law and, last, the output see of the state."""
        outlets = [law.outlet for law in self.system.nonlinearities]
        return np.array([*outlets, self.system.o])

    @cached_property
    def through(self) -> NDArray[np.float64]:
        """(m + 1, 1): the same of the input."""
        feedthrough = [law.feedthrough for law in self.system.nonlinearities]
        return np.array([*feedthrough, 0.0])[:, None]

    @cached_property
    def look(self) -> NDArray[np.float64]:
        """(m + 1, p): the same of the coordinates."""
        return self.rows @ self.modes.shapes

    @cached_property
    def heard(self) -> tuple[bool, ...]:
        """(p,): which coordinates the laws see, or else the output alone."""
        return tuple(np.any(self.look[:-1] != 0.0, axis=0).tolist())


def _dwell(
    moving: _Moving,
    parameters: NDArray[np.float64],
    state: NDArray[np.float64],
    stretch: Stretch,
    longest_step_s: float,
) -> Motion:
    system, modes = moving.system, moving.modes
    propagator = build_propagator(system, modes, stretch.frequency_hz, longest_step_s)
    drift = propagator.drift[:, None] + propagator.offset_drift[:, None] * stretch.offset
    phasor = stretch.amplitude * np.exp(1j * stretch.phase)
    forced = propagator.drive[:, None] * phasor
    # Im(Y exp(i theta)) = Re(Y) sin(theta) + Im(Y) cos(theta), plus a constant.
    through = _times(moving.rows, forced) + moving.through * phasor
    waves = np.stack([through.real, through.imag, moving.through * stretch.offset], axis=1)
    values = {
        "q": _times(modes.weights, state - forced.imag),
        "seen": _times(moving.rows, state) + moving.through * (phasor.imag + stretch.offset),
        "force": np.zeros((len(moving.kinds), state.shape[1])),
        "drift": drift,
        "waves": waves.reshape(-1, state.shape[1]),
        "parameters": parameters.reshape(-1, state.shape[1]),
    }
    layout, coefficients = _program(moving, propagator, bool(drift.any() or stretch.offset.any()))
    sums, peak = _step(layout, coefficients, values, propagator.steps_per_cycle, stretch)
    turn = np.exp(-1j * np.outer(np.arange(HARMONICS), stretch.phase))
    turn[0] = 1.0
    # The last forces push the coordinates in the step that is not made any more.
    end = values["q"] + _times(propagator.push, values["force"])
    # The kernel counts the phase from the start of the stretch; results count
    # it from the drive.
    return Motion(
        _coefficients(sums, propagator.steps_per_cycle) * turn,
        peak,
        _times(modes.shapes, end) + forced.imag,
        propagator.step_s,
    )


def _program(
    moving: _Moving, propagator: Propagator, steady: bool
) -> tuple[Layout, NDArray[np.float64]]:
    """What steps a system at one drive frequency, and with which numbers."""
    laws, gain = moving.system.nonlinearities, moving.look @ propagator.push
    fixed = [(law.stiffness, law.damping / propagator.step_s) for law in laws]
    structure = Structure(
        kinds=moving.kinds,
        order=order_of(moving.kinds, gain, fixed),
        turning=tuple(moving.modes.turning.tolist()),
        heard=moving.heard,
        steady=steady,
        # The states of stiff springs hardly differ: their differences need all digits.
        single=moving.single and not propagator.whole,
    )
    parts = [
        propagator.carry,
        # The forces of a step push the coordinates before these are carried on.
        propagator.carried(propagator.push),
        moving.look,
        gain,
        law_coefficients(moving.kinds, gain, fixed),
    ]
    return Layout(structure), np.concatenate([part.ravel() for part in parts])


def _step(
    layout: Layout,
    coefficients: NDArray[np.float64],
    values: dict[str, NDArray[np.float64]],
    steps: int,
    stretch: Stretch,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sums (cycles, 7, lanes) and largest magnitude (lanes,) of the output over a stretch.

    `values`: the rows of the lanes by name; they are overwritten by how they end.
    """
    count, rows = stretch.amplitude.size, layout.lanes
    sums, peak = np.empty((stretch.integrate_cycles, SUMS, count)), np.empty(count)
    for of in _calls(count, layout.width):
        lanes = layout.blank(rows["peak"].stop, of.size)
        for name, known in values.items():
            lanes[rows[name]] = known[:, of]
        sums[..., of] = step_cycles(
            layout, coefficients, lanes, _waves(steps), stretch.settle_cycles,
            stretch.integrate_cycles,
        )  # fmt: skip
        # Lanes that are repeated end alike, and are written twice.
        peak[of] = lanes[rows["peak"][0]]
        for name in ("q", "force"):
            values[name][:, of] = lanes[rows[name]]
    return sums, peak


def _calls(count: int, width: int) -> Iterator[NDArray[np.intp]]:
    """Lanes of each call: four vectors of them, and what is left in two and one.

    A vector that is not full repeats a lane: idle lanes of zeros would run into denormals.
    """
    at, vectors = 0, -(-count // width)
    while vectors:
        taken = min(MOST_VECTORS, 1 << (vectors.bit_length() - 1))
        yield np.resize(np.arange(at, min(at + taken * width, count)), taken * width)
        at, vectors = at + taken * width, vectors - taken


@lru_cache(maxsize=256)
def _waves(steps: int) -> NDArray[np.float64]:
    """(steps, 6): cosine and sine of harmonics 1 to 3 over a cycle."""
    angle = 2.0 * np.pi * np.arange(steps) / steps
    return np.stack([wave(k * angle) for k in (1, 2, 3) for wave in (np.cos, np.sin)], axis=1)


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
