"""ARF, RF and the half-power width of many simulated sweeps, read as the paper read its own.

Owns the sweep that is simulated for a diagnosis from features alone (its band,
cycles and start) and the reading: the valley and the hill after it that lie
furthest apart in gain. It knows nothing of causes and judges nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.machine import Machine
from analysis.resonance.half_power import measure_half_power
from daq.plan import Direction, SweepPlan
from sim.paper_scheme import PAPER_LEVEL_VPK
from sim.response import simulate_cycles
from sim.unit import Unit

__all__ = ["FEATURES", "Reading", "feature_sweeps", "plan_about", "read_feature_sweep"]

FEATURES = ("arf_hz", "arf_db", "rf_hz", "rf_db", "width_hz")
"""The numbers of one sweep, in the order of every array here: Hz, dB, Hz, dB, Hz.

``width_hz`` is the distance of the half-power points about ARF.
"""

LONGEST_STEP_S = 1e-5
"""Features read off runs at this step scatter as those at half of it do."""

LEAST_RISE_DB = 0.5
"""A hill that stands out of its valley by less is no feature."""

_BELOW, _ABOVE = 0.74, 1.4
"""The band from this share of ARF to this multiple of RF."""


@dataclass(frozen=True, slots=True)
class Reading:
    """Measured features of one unit with their reading errors, in the order of `FEATURES`.

    Parameters
    ----------
    values, std
        Shape (5,), Hz and dB. A number that is not known is NaN.
    """

    values: NDArray[np.float64]
    std: NDArray[np.float64]


def plan_about(
    reading: Reading,
    *,
    points: int,
    settle_cycles: int,
    integrate_cycles: int,
    from_rest: bool = True,
    direction: Direction = "up",
) -> SweepPlan:
    """A sweep over the band about measured features; by default every point from rest."""
    arf, rf = float(reading.values[0]), float(reading.values[2])
    return SweepPlan(
        tuple(np.geomspace(_BELOW * arf, _ABOVE * rf, points).tolist()),
        (PAPER_LEVEL_VPK,),
        direction=direction,
        settle_cycles=settle_cycles,
        integrate_cycles=integrate_cycles,
        from_rest=from_rest,
    )


def feature_sweeps(unit: Unit, machines: Sequence[Machine], plan: SweepPlan) -> NDArray[np.float64]:
    """Features of one run of each machine, shape (machines, 5); NaN where there is none.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    servos = [machine.servo(unit) for machine in machines]
    runs = simulate_cycles(servos, plan, longest_step_s=LONGEST_STEP_S)
    frequency_hz = np.asarray(plan.frequencies_hz)
    gains = np.array([run[0, :, :, 1].mean(axis=-1) for run in runs])
    with np.errstate(divide="ignore"):
        gain_db = 20.0 * np.log10(np.abs(gains))
    return np.array([read_feature_sweep(frequency_hz, one) for one in gain_db])


def read_feature_sweep(
    frequency_hz: NDArray[np.float64], gain_db: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Features of one sweep, shape (5,), in the order of `FEATURES`.

    The paper takes the least gain as ARF and the greatest above it as RF. A
    gain that falls off towards the end of the band would hide both, so of all
    valleys with a hill after them the pair that rises most is taken; where
    nothing falls off it is the paper's. Both are placed by a parabola through
    three points.
    """
    nothing = np.full(len(FEATURES), np.nan)
    if not np.all(np.isfinite(gain_db)):
        return nothing
    lowest = np.minimum.accumulate(gain_db[1:-1])
    hill = 1 + int(np.argmax(gain_db[1:-1] - lowest))
    valley = 1 + int(np.argmin(gain_db[1 : hill + 1]))
    if gain_db[hill] - gain_db[valley] < LEAST_RISE_DB:
        return nothing
    if gain_db[hill] < gain_db[hill + 1] or gain_db[valley] > gain_db[valley - 1]:
        return nothing  # still rising, or already rising, at an end of the band
    width = measure_half_power(frequency_hz, gain_db, valley, -1)
    arf, rf = (_summit(frequency_hz, gain_db, at) for at in (valley, hill))
    return np.array([*arf, *rf, width.high_hz - width.low_hz])


def _summit(
    frequency_hz: NDArray[np.float64], gain_db: NDArray[np.float64], at: int
) -> tuple[float, float]:
    """Place and height of the parabola through a reading and its neighbours."""
    x = frequency_hz[at - 1 : at + 2] - frequency_hz[at]
    y = gain_db[at - 1 : at + 2] - gain_db[at]
    curve, slope = np.linalg.solve([[x[0] ** 2, x[0]], [x[2] ** 2, x[2]]], [y[0], y[2]])
    if curve == 0.0:
        return float(frequency_hz[at]), float(gain_db[at])
    shift = float(np.clip(-0.5 * slope / curve, x[0], x[2]))
    # Between a point and its neighbours a parabola may place the summit, never make it higher
    # than the readings by more than they differ.
    height = float(np.clip(shift * (slope + curve * shift), -np.abs(y).max(), np.abs(y).max()))
    return float(frequency_hz[at] + shift), float(gain_db[at] + height)
