"""The engine: carries trajectories of a piecewise-linear system through driven stretches.

Owns time. It advances many trajectories (lanes) of one system side by side,
exact in the linear part, symmetric in time where play acts, with friction that
truly sticks, and returns the Fourier coefficients of every drive cycle. It
knows nothing of gears, units or sweeps.

How one step goes. Between switchings the system is linear, so its modes are
carried exactly (`sim.engine.propagator`). Each law's force is held over the step at
the mean that the law has along it: with y0 and y1 what the law sees at both
ends, y1 = ahead + beta p(y0, y1) is one scalar equation, solved in closed form
(`sim.engine.laws`). The scheme is second order, the same forwards and
backwards in time, and conserves the energy of springs and play; friction
stops the motion at the end of a step or turns where the velocity passes zero.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import AnalysisError
from sim.engine.layout import STEPS_SEEN, Layout, Structure
from sim.engine.nonlinearity import Reading, held
from sim.engine.propagator import Modes, Propagator, build_propagator, find_modes
from sim.engine.solving import kinds_of, law_coefficients, law_parameters, order_of
from sim.engine.stepping import Asking, Steps, step_together
from sim.engine.system import PiecewiseLinearSystem

__all__ = [
    "HARMONICS",
    "LONGEST_STEP_S",
    "Motion",
    "Moving",
    "Stretch",
    "advance",
    "carry",
    "carry_each",
    "program_of",
    "times",
]

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
    for harmonics k of 1 to 3, as the bench records it; C_0 is the mean, in V. `peak` (lanes,):
    largest |V_o| in the kept cycles, V. `state` (n and 5 per sampled law, lanes): the state at the
    end. `step_s`: its time step.
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
    modes: Modes | None = None,
) -> Iterator[Motion]:
    """Carry trajectories through stretches, one after the other.

    Parameters
    ----------
    system
        The system shared by all lanes.
    parameters
        (m, 3, lanes): the parameters of each law in each lane.
    state
        (n and 5 per sampled law, lanes): physical state at the start, and what sampled laws hold
        (`sim.servo.states_at_start`); not changed.
    stretches
        What is driven, in order.
    longest_step_s
        Upper bound of the time step, s.
    single
        Step in single precision, at half of the cost; for what is judged by its distribution.
        A system without usable modes is stepped in double all the same.
    modes
        Coordinates to step in; those of `find_modes` if left out.

    Yields
    ------
    Motion
        One per stretch, as soon as it is done.
    """
    moving = Moving(system, find_modes(system) if modes is None else modes, single)
    for stretch in stretches:
        (motion,) = step_together([_dwell(moving, parameters, state, stretch, longest_step_s)])
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
) -> Asking[list[Motion]]:
    """Carry trajectories through stretches, at shorter steps where they grow without bound.

    It asks for what is to be stepped and goes on with what came of it; `step_together` of
    `sim.engine.stepping` sees to that, for several systems side by side.

    Parameters
    ----------
    steps_s
        Upper bounds of the time step, s. Each is taken where the one before lets a motion grow
        without bound, for that stretch and the one before it, as growth may have begun before it
        showed; and for all that follow where that happens often. All others keep the first.
    done
        Called after each stretch.

    Returns
    -------
    list of Motion
        One for each stretch.

    Raises
    ------
    AnalysisError
        If a motion grew without bound, at the last of the steps.
    """
    moving = Moving(system, find_modes(system), single)
    return _carry(moving, parameters, state, stretches, steps_s, done)


def carry_each(
    system: PiecewiseLinearSystem,
    parameters: NDArray[np.float64],
    state: NDArray[np.float64],
    stretches: Iterable[Stretch],
    steps_s: Sequence[float],
    single: bool = False,
    done: Callable[[], None] = lambda: None,
) -> Iterator[Asking[list[Motion]]]:
    """Carry trajectories through each of some stretches from the same state, see `carry`.

    Yields
    ------
    Asking
        One for each stretch, which gives a list of one motion.
    """
    moving = Moving(system, find_modes(system), single)
    for stretch in stretches:
        yield _carry(moving, parameters, state, [stretch], steps_s, done)


def _carry(
    moving: Moving,
    parameters: NDArray[np.float64],
    state: NDArray[np.float64],
    stretches: Sequence[Stretch],
    steps_s: Sequence[float],
    done: Callable[[], None],
) -> Asking[list[Motion]]:
    longest, *shorter = steps_s
    motions: list[Motion] = []
    grew = 0
    while len(motions) < len(stretches):
        begin = motions[-1].state if motions else state
        if grew > _SELDOM * len(stretches):
            rest = stretches[len(motions) :]
            return motions + (yield from _carry(moving, parameters, begin, rest, shorter, done))
        stretch = stretches[len(motions)]
        motion = yield from _dwell(moving, parameters, begin, stretch, longest)
        if np.all(np.isfinite(motion.coefficients)):
            motions.append(motion)
        elif shorter:
            back = max(len(motions) - 1, 0)
            begin = motions[back - 1].state if back else state
            some = stretches[back : len(motions) + 1]
            motions[back:] = yield from _carry(
                moving, parameters, begin, some, shorter, lambda: None
            )
            grew += 1
        else:
            raise AnalysisError(
                f"the simulated motion at {stretch.frequency_hz:g} Hz grew "
                "without bound; check the parameters, or take a shorter step"
            )
        done()
    return motions


@dataclass(frozen=True, eq=False)
class Moving:
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
    def direct(self) -> NDArray[np.float64]:
        """(m + 1, m): what laws and output see of forces without any state between."""
        laws = self.system.nonlinearities
        found = np.zeros((len(laws) + 1, len(laws)))
        for j, law in enumerate(laws):
            found[-1, j] = law.read
            for k, coefficient in law.hears:
                found[j, k] = coefficient
        return found

    @cached_property
    def look(self) -> NDArray[np.float64]:
        """(m + 1, p): the same of the coordinates."""
        return self.rows @ self.modes.shapes

    @cached_property
    def heard(self) -> tuple[bool, ...]:
        """(p,): which coordinates the laws see, or else the output alone."""
        return tuple(np.any(self.look[:-1] != 0.0, axis=0).tolist())


def _dwell(
    moving: Moving,
    parameters: NDArray[np.float64],
    state: NDArray[np.float64],
    stretch: Stretch,
    longest_step_s: float,
) -> Asking[Motion]:
    """What comes of one stretch; asks for its steps."""
    system, modes = moving.system, moving.modes
    propagator = build_propagator(system, modes, stretch.frequency_hz, longest_step_s)
    drift = propagator.drift[:, None] + propagator.offset_drift[:, None] * stretch.offset
    phasor = stretch.amplitude * np.exp(1j * stretch.phase)
    forced = propagator.drive[:, None] * phasor
    # Im(Y exp(i theta)) = Re(Y) sin(theta) + Im(Y) cos(theta), plus a constant.
    through = times(moving.rows, forced) + moving.through * phasor
    waves = np.stack([through.real, through.imag, moving.through * stretch.offset], axis=1)
    gain = moving.look @ propagator.push
    if moving.direct.any():
        gain = gain + moving.direct
    state, kept = state[: len(system.b)], state[len(system.b) :]
    layout, coefficients = program_of(
        moving, propagator, gain, bool(drift.any() or stretch.offset.any())
    )
    stepped = yield Steps(
        layout,
        coefficients,
        {
            "q": times(modes.weights, state - forced.imag),
            "seen": times(moving.rows, state) + moving.through * (phasor.imag + stretch.offset),
            "force": np.zeros((len(moving.kinds), state.shape[1])),
            "drift": drift,
            "waves": waves.reshape(-1, state.shape[1]),
            "parameters": law_parameters(moving.kinds, parameters, gain, propagator.step_s),
            "held": kept,
        },
        propagator.steps_per_cycle,
        stretch.settle_cycles,
        stretch.integrate_cycles,
    )
    turn = np.exp(-1j * np.outer(np.arange(HARMONICS), stretch.phase))
    turn[0] = 1.0
    if system.reading != Reading() or moving.direct[-1].any():
        turn = turn * _recorded(moving, propagator)[:, None]
    # The last forces push the coordinates in the step that is not made any more.
    end = stepped.q + times(propagator.push, stepped.force)
    # Motion that grew without bound is not finite: `carry` says so.
    with np.errstate(invalid="ignore"):
        # The kernel counts the phase from the start of the stretch; results count
        # it from the drive.
        return Motion(
            _coefficients(stepped.sums, propagator.steps_per_cycle) * turn,
            stepped.peak,
            np.concatenate([times(modes.shapes, end) + forced.imag, stepped.held]),
            propagator.step_s,
        )


def program_of(
    moving: Moving, propagator: Propagator, gain: NDArray[np.float64], steady: bool
) -> tuple[Layout, NDArray[np.float64]]:
    """What steps a system at one drive frequency, and with which numbers.

    `gain` (m + 1, m): what laws and output see of forces at the end of a step.
    """
    laws = moving.system.nonlinearities
    fixed = [(law.stiffness, law.damping / propagator.step_s) for law in laws]
    structure = Structure(
        kinds=moving.kinds,
        order=order_of(moving.kinds, gain, fixed),
        turning=tuple(moving.modes.turning.tolist()),
        heard=moving.heard,
        steady=steady,
        # The states of stiff springs hardly differ: their differences need all digits.
        single=moving.single and not propagator.whole,
        loads=tuple(law.loaded_by for law in laws),
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


def _recorded(moving: Moving, propagator: Propagator) -> NDArray[np.complex128]:
    """On each harmonic (4,): what is between the output and the bench's records."""
    omega = 2j * np.pi * propagator.frequency_hz * np.arange(HARMONICS)
    factor = moving.system.reading.factor(omega)
    if moving.direct[-1].any():
        # The kernel reads means over the steps since it last looked.
        factor = factor / held(omega * STEPS_SEEN * propagator.step_s)
    return factor


def times(matrix: NDArray[np.float64], columns: NDArray) -> NDArray:
    """Product in one order of additions; BLAS would choose it by the number of columns."""
    total = np.zeros((len(matrix), columns.shape[1]), dtype=columns.dtype)
    for row, column in enumerate(columns):
        total += np.multiply.outer(matrix[:, row], column)
    return total


def _coefficients(sums: NDArray[Any], steps: int) -> NDArray[Any]:
    """Sums over a cycle to amplitudes C_k with V = Im(C_k exp(i k theta)), C_0 the mean."""
    cosine, sine, seen = sums[:, 1::2], sums[:, 2::2], steps // STEPS_SEEN
    harmonics = (2.0 / seen) * (sine + 1j * cosine)
    return np.concatenate([sums[:, :1] / seen + 0j, harmonics], axis=1)
