"""The many runs behind the reproduction: the paper's procedure on both integrators.

Owns the procedure (grid, level, cycles, starts) and gives gains, run by run.
It reads nothing off them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.paper.published import UnitName
from daq.plan import SweepPlan
from sim.paper_scheme import PAPER_LEVEL_VPK, paper_gains
from sim.response import Servo, simulate_cycles
from sim.unit import load_unit

__all__ = ["exact_runs_db", "grid_hz", "paper_runs_db"]

BANDS_HZ: dict[UnitName, tuple[float, float]] = {"ADSS": (115.0, 160.0), "EDSS": (40.0, 110.0)}
"""The 1 Hz grid's ends: every ARF and RF of Table 2 and of the measurement with room around."""
SETTLE_CYCLES, INTEGRATE_CYCLES = 60, 40
"""Cycles waited and read; the paper does not print its own."""
START_SPREAD = 1e-3
"""Starts are the paper's own, at rest in mid-play, and as near to it as to make no matter."""
EXACT_STEP_S = 1e-5
"""Step of the exact engine. Where the motion repeats, gains are within 0.02 dB of those at a
quarter of it; where it does not, runs scatter about the same features (docs/paper.md)."""
_LOT = 8

Tick = Callable[[float], None]


def grid_hz(unit: UnitName) -> NDArray[np.float64]:
    """The drive frequencies, ascending, shape (points,), Hz."""
    start, stop = BANDS_HZ[unit]
    return np.arange(start, stop + 0.5)


def paper_runs_db(
    unit_name: UnitName,
    ratio_percent: int,
    runs: int,
    seed: int,
    start_spread: float = START_SPREAD,
) -> NDArray[np.float64]:
    """Gain of every run by the paper's scheme, shape (runs, points), dB."""
    unit = load_unit(unit_name)
    gains = paper_gains(
        unit,
        unit.split(ratio_percent / 100.0),
        grid_hz(unit_name).tolist(),
        starts=runs,
        start_spread=start_spread,
        seed=seed,
        settle_cycles=SETTLE_CYCLES,
        integrate_cycles=INTEGRATE_CYCLES,
    )
    return 20.0 * np.log10(np.abs(gains))


def exact_runs_db(
    unit_name: UnitName,
    ratios_percent: Sequence[int],
    runs: int,
    seed: int,
    tick: Tick,
    start_spread: float = START_SPREAD,
) -> NDArray[np.float64]:
    """Gain of every run by the exact engine, shape (ratios, runs, points), dB.

    `tick` is called with the share done, 0 to 1. All ratios are stepped side by
    side, which is what the engine does best.
    """
    unit = load_unit(unit_name)
    servos = [
        Servo.of(unit, ratio / 100.0, seed=seed + run, start_spread=start_spread)
        for ratio in ratios_percent
        for run in range(runs)
    ]
    grid = grid_hz(unit_name)
    parts = []
    for lot in _lots(grid):
        plan = SweepPlan(
            frequencies_hz=tuple(lot.tolist()),
            levels_vpk=(PAPER_LEVEL_VPK,),
            settle_cycles=SETTLE_CYCLES,
            integrate_cycles=INTEGRATE_CYCLES,
            from_rest=True,
        )
        # (servos, levels, points, cycles, harmonics): one level, the drive's own harmonic.
        cycles = np.array(simulate_cycles(servos, plan, longest_step_s=EXACT_STEP_S))[:, 0, ..., 1]
        parts.append(cycles.mean(axis=-1))
        tick(float((lot[-1] - grid[0] + 1.0) / grid.size))
    gains = np.concatenate(parts, axis=-1).reshape(len(ratios_percent), runs, grid.size)
    return 20.0 * np.log10(np.abs(gains))


def _lots(grid: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    # Every point starts from rest, so the grid may be cut anywhere to show progress.
    for first in range(0, grid.size, _LOT):
        yield grid[first : first + _LOT]
