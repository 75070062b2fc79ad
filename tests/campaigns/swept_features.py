"""ARF and RF of the paper's model when it is swept, beside the paper's procedure from rest.

Run as ``python tests/campaigns/swept_features.py``; prints the rows of the table in
docs/paper.md. Two minutes of processor time.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from analysis.paper.published import UnitName  # noqa: E402
from analysis.paper.runs import EXACT_STEP_S, START_SPREAD, exact_runs_db, grid_hz  # noqa: E402
from analysis.paper.table2 import read_grid  # noqa: E402
from daq.plan import Direction, SweepPlan  # noqa: E402
from sim.paper_scheme import PAPER_LEVEL_VPK  # noqa: E402
from sim.response import Servo, simulate_cycles  # noqa: E402
from sim.unit import load_unit  # noqa: E402

ROWS: tuple[tuple[UnitName, int], ...] = (("ADSS", 0), ("ADSS", 25), ("EDSS", 0), ("EDSS", 25))
RUNS = 6
LEAST_RISE_DB = 1.0
"""A sweep whose greatest gain above its least rises by less shows no pair of features."""


def swept_runs_db(unit_name: UnitName, ratio_percent: int, way: Direction) -> NDArray[np.float64]:
    """Gain of every run with the state carried on from point to point, (runs, points), dB."""
    unit, ratio = load_unit(unit_name), ratio_percent / 100.0
    servos = [Servo.of(unit, ratio, seed=run, start_spread=START_SPREAD) for run in range(RUNS)]
    plan = SweepPlan(
        tuple(grid_hz(unit_name).tolist()),
        (PAPER_LEVEL_VPK,),
        direction=way,
        settle_cycles=20,
        integrate_cycles=30,
    )
    runs = simulate_cycles(servos, plan, longest_step_s=EXACT_STEP_S)
    return 20.0 * np.log10([np.abs(run[0, :, :, 1].mean(axis=-1)) for run in runs])


def told(unit_name: UnitName, gain_db: NDArray[np.float64]) -> str:
    """Ranges of ARF and RF over the runs that show both, and how many do not."""
    read = read_grid(grid_hz(unit_name), gain_db)
    shown = read.rf_db - read.arf_db >= LEAST_RISE_DB
    if not shown.any():
        return "neither"
    parts = [_range(read.arf_hz[shown]), _range(read.rf_hz[shown])]
    missing = np.count_nonzero(~shown)
    return ", ".join(parts) + (f" (neither in {missing} of {len(shown)})" if missing else "")


def _range(hz: NDArray[np.float64]) -> str:
    low, high = hz.min(), hz.max()
    return f"{low:.0f}" if low == high else f"{low:.0f}-{high:.0f}"


def main() -> None:
    """Print the rows."""
    for unit_name, ratio in ROWS:
        (at_rest,) = exact_runs_db(unit_name, [ratio], RUNS, 0, lambda share: None)
        cells = [at_rest, *(swept_runs_db(unit_name, ratio, way) for way in ("up", "down"))]
        texts = " | ".join(told(unit_name, gain_db) for gain_db in cells)
        print(f"| {unit_name} {ratio} % | {texts} |", flush=True)


if __name__ == "__main__":
    main()
