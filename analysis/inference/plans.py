"""Prior over sweep plans: which sweeps the posterior of a unit must serve.

Owns the distribution of levels, band, points, spacing, direction, cycles and offset of training
sweeps, and the reference response that scales readings. It draws no machine.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.machine import Machine, safe_cycles
from daq.plan import SweepPlan, spaced_frequencies
from sim.drivetrain import paper_drivetrain
from sim.engine.linear import smooth_response
from sim.engine.system import PiecewiseLinearSystem
from sim.unit import Unit

__all__ = ["Landmarks", "draw_plan", "landmarks", "reference_response"]

_SMOOTHING = 0.15
"""Loss factor of the reference response: wide enough that no resonance is sharp."""

_USUAL_LEVELS = (0.3, 0.5, 0.8)
"""Usual source levels as shares of the highest that the unit may be given."""

_PILOT_HZ = (0.15, 1.3)
"""Band in which features are looked for, as multiples of the linear resonance."""

_WIDE_BAND = 10.0
"""Corner of a sensor that has none, over the highest frequency: it turns no feature there."""

_USUAL = 0.4
"""Share of training sweeps that are near the usual one: three levels, the band of both features."""

_LONGEST_S = 120.0
"""Longest training sweep of one machine, s of motion over all levels."""


@dataclass(frozen=True)
class Landmarks:
    """Where the features of a unit lie over contribution ratios and usual levels, Hz.

    `arf_hz`: the lowest anti-resonance. `rf_hz`: the median resonance.
    """

    arf_hz: float
    rf_hz: float


def linear_system(unit: Unit) -> PiecewiseLinearSystem:
    """The datasheet's drive; its linear part does not depend on the contribution ratio."""
    return paper_drivetrain(unit, 1.0 if unit.stages == 1 else 0.5).system()


def reference_response(unit: Unit, frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Smoothed linear response V_o/V_i of the datasheet, by which readings are scaled.

    The transfer function with every mesh closed, at s = 2 pi f (i + eta): no pole or zero is near.
    """
    s = 2.0 * np.pi * np.asarray(frequency_hz, dtype=float) * (1j + _SMOOTHING)
    return smooth_response(linear_system(unit), s)


def _seen_at_motor(unit: Unit) -> Unit:
    """The unit with an accelerometer on the motor in place of one on the load or of a current.

    There its features show: a load has no anti-resonance, and of a current it is a maximum.
    """
    sensor = unit.sensor
    if sensor is None or sensor.kind not in ("accelerometer", "current"):
        return unit
    changed = {"kind": "accelerometer", "reads": "acceleration", "at": "motor"}
    corner = sensor.low_pass_hz or _WIDE_BAND * unit.limits.stop_hz
    there = sensor.model_copy(update={**changed, "low_pass_hz": corner})
    return unit.model_copy(update={"sensor": there})


def landmarks(unit: Unit) -> Landmarks:
    """Simulate a few machines as the datasheet has them, and read where their features lie.

    Per machine and level: the deepest point relative to the reference, and the highest above it.
    """
    closed = np.geomspace(unit.limits.start_hz, unit.limits.stop_hz, 2000)
    unit = _seen_at_motor(unit)
    gain = np.abs(linear_system(unit).transfer(closed) / reference_response(unit, closed))
    highest = closed[int(np.argmax(gain))]
    grid = np.geomspace(
        max(_PILOT_HZ[0] * highest, unit.limits.start_hz),
        min(_PILOT_HZ[1] * highest, unit.limits.stop_hz),
        60,
    )
    levels = tuple(float(v) * unit.limits.source_vpk for v in _USUAL_LEVELS)
    plan = SweepPlan(tuple(grid.tolist()), levels, settle_cycles=15, integrate_cycles=15)
    ratios = [1.0] if unit.stages == 1 else np.linspace(0.05, 0.95, 5).tolist()
    servos = [Machine(ratio, seed).servo(unit) for seed, ratio in enumerate(ratios)]
    cycles = np.array(safe_cycles(servos, plan, workers=1))[..., 1].mean(axis=-1)
    excess = np.log(np.abs(cycles / reference_response(unit, grid))).reshape(-1, len(grid))
    valleys = np.argmin(excess, axis=1)
    peaks = [v + int(np.argmax(one[v:])) for v, one in zip(valleys, excess, strict=True)]
    return Landmarks(float(grid[valleys].min()), float(np.median(grid[peaks])))


def draw_plan(unit: Unit, marks: Landmarks, rng: np.random.Generator) -> SweepPlan:
    """Draw a training sweep."""
    while True:
        plan = _draw(unit, marks, rng)
        if plan.duration_s <= _LONGEST_S:
            return plan


def _draw(unit: Unit, marks: Landmarks, rng: np.random.Generator) -> SweepPlan:
    limits = unit.limits
    usual = rng.random() < _USUAL
    if usual:
        levels = np.array(_USUAL_LEVELS) * limits.source_vpk * rng.uniform(0.95, 1.05)
        low = marks.arf_hz * rng.uniform(0.7, 0.9)
        high = marks.rf_hz * rng.uniform(0.9, 1.2)
        points, settle, integrate = int(rng.integers(51, 65)), 20, 30
        spacing, direction, offset = "lin", "up", 0.0
    else:
        count = int(rng.choice([1, 2, 3, 4, 5], p=[0.1, 0.2, 0.4, 0.2, 0.1]))
        levels = _levels(count, limits.source_vpk, rng)
        low = marks.arf_hz * np.exp(rng.uniform(np.log(0.3), np.log(0.95)))
        high = marks.rf_hz * np.exp(rng.uniform(np.log(0.9), np.log(2.2)))
        points = int(np.exp(rng.uniform(np.log(15), np.log(130))))
        settle = int(np.exp(rng.uniform(np.log(5), np.log(40))))
        integrate = int(np.exp(rng.uniform(np.log(5), np.log(60))))
        spacing = str(rng.choice(["lin", "log"]))
        direction = str(rng.choice(["up", "down"], p=[0.75, 0.25]))
        offset = 0.0 if rng.random() < 0.8 else rng.uniform(-1, 1) * limits.source_offset_v
    low, high = max(low, limits.start_hz), min(high, limits.stop_hz)
    plan = SweepPlan(
        spaced_frequencies(low, high, points, spacing),  # type: ignore[arg-type]
        tuple(float(v) for v in levels),
        settle_cycles=settle,
        integrate_cycles=integrate,
        dc_offset_v=float(offset),
    )
    return replace(plan, direction=direction)  # type: ignore[arg-type]


def _levels(count: int, most_v: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Ascending levels, neighbours a sixth or more apart, V peak."""
    while True:
        levels = np.sort(most_v * np.exp(rng.uniform(np.log(0.1), 0.0, count)))
        if count == 1 or np.min(np.diff(np.log(levels))) > 0.15:
            return levels
