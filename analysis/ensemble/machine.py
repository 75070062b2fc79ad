"""Ensembles of simulated sweeps: many machines through the plan of one observation.

Owns the draws that judgement rests on: which machines were simulated, and what
a bench would have read from each. Every draw is one run, as a measurement is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.observation.observation import Observation, channels_of_readings
from daq.plan import SweepPlan
from sim.effects import EffectSetting
from sim.engine.system import PiecewiseLinearSystem
from sim.response import START_SPREAD, Servo, simulate_cycles
from sim.unit import Unit

__all__ = ["LEAST_SHARE", "Draws", "Machine", "safe_cycles"]

LEAST_SHARE = 0.1
"""Of a datasheet value that is left at least, however wide its tolerance."""


@dataclass(frozen=True, slots=True)
class Machine:
    """One machine of an ensemble.

    `deviations` are relative departures of datasheet values, by symbol. The ratio of a unit with
    one stage is 1, whatever is said here.
    """

    ratio: float
    seed: int = 0
    b_t_deg: float | None = None
    deviations: tuple[tuple[str, float], ...] = ()
    effects: tuple[EffectSetting, ...] = ()
    start_spread: float = START_SPREAD

    def servo(self, unit: Unit) -> Servo:
        """The machine as something that can be simulated."""
        known = unit.parameters
        changes = {
            symbol: known[symbol] * max(1.0 + d, LEAST_SHARE) for symbol, d in self.deviations
        }
        if self.b_t_deg is not None:
            changes["b_t_deg"] = self.b_t_deg
        if changes:
            unit = unit.with_parameters(**changes)
        ratio = 1.0 if unit.stages == 1 else self.ratio
        return Servo.of(unit, ratio, self.effects, self.seed, self.start_spread)


@dataclass(frozen=True, slots=True, eq=False)
class Draws:
    """One run of each machine, free of any bench's noise.

    `mean`, `variance` (draws, rows): see `analysis.observation.observation.readings_of_cycles`.
    """

    machines: tuple[Machine, ...]
    mean: NDArray[np.complex128]
    variance: NDArray[np.float64]

    def channels(self, observation: Observation) -> NDArray[np.float64]:
        """Channels (draws, 3, rows) as the bench of an observation would read them."""
        return channels_of_readings(self.mean, self.variance, observation.noise, observation.floor)

    def joined(self, other: Draws) -> Draws:
        """Both sets of draws."""
        return Draws(
            self.machines + other.machines,
            np.concatenate([self.mean, other.mean]),
            np.concatenate([self.variance, other.variance]),
        )


def safe_cycles(
    servos: Sequence[Servo], plan: SweepPlan, workers: int | None = None
) -> list[NDArray[np.complex128]]:
    """`sim.response.simulate_cycles` at the longest step that shows the same distribution.

    Readings at 10 us scatter about the same means as those at 5 us, by the same amounts, at half
    the cost; a heavily damped or stiffened shaft may need less, and a drive whose fastest motion is
    slow stands more.

    Raises
    ------
    AnalysisError
        If a motion grew without bound even at the shortest step.
    """
    by_step: dict[float, list[int]] = {}
    for i, servo in enumerate(servos):
        by_step.setdefault(_longest_step_s(servo.system), []).append(i)
    found: dict[int, NDArray[np.complex128]] = {}
    for longest, members in by_step.items():
        cycles = simulate_cycles(
            [servos[i] for i in members], plan, longest_step_s=longest,
            shorter_steps_s=[step for step in _STEPS_S if step < longest], single=True,
            workers=workers,
        )  # fmt: skip
        found |= dict(zip(members, cycles, strict=True))
    return [found[i] for i in range(len(servos))]


_STEPS_S = (8e-5, 4e-5, 2e-5, 1e-5, 5e-6, 2.5e-6)
_USUAL_S = 1e-5
"""No machine starts with less: some of the paper's units turn by a seventh in it."""

_TURN = 0.05
"""Of the fastest mode, or of half of a clock's rate, that a longer step may last. Gains of the
published drives are then within 0.0005 of those at 5 us, and at twice as much within 0.0015."""


def _longest_step_s(system: PiecewiseLinearSystem) -> float:
    """The longest step, s, that follows the fastest motion of a system."""
    rate = max([0.0, *(law.parameters[0] for law in system.sampled)])
    modes = np.linalg.eigvals(system.A)
    turning = np.abs(modes[modes.imag > 0.0])
    fastest_hz = max(float(np.max(turning, initial=0.0)) / (2.0 * np.pi), rate / 2.0)
    longer = (step for step in _STEPS_S if step > _USUAL_S and step * fastest_hz <= _TURN)
    return next(longer, _USUAL_S)
