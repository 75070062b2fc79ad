"""How often the estimate's 95 % interval holds the truth, and how far the estimate is off.

Draws machines off their datasheet at several contribution ratios, sweeps them
as a bench would, estimates, and prints a table per unit. Truths, deviations
and noise are drawn anew with the seed printed; nothing is tuned to them. The
machines that are simulated are kept from draw to draw, as on a bench.

    python tests/benchmarks/estimate_coverage.py [draws per ratio] [seed] [unit]
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from worlds.hidden import BANDS_HZ, LEVELS_VPK, off_datasheet, reading  # noqa: E402

from analysis.estimate import estimate_response  # noqa: E402
from daq.plan import SweepPlan, spaced_frequencies  # noqa: E402
from sim.response import simulate  # noqa: E402
from sim.unit import load_unit  # noqa: E402

RATIOS = (0.1, 0.3, 0.5, 0.7, 0.9)


def main(draws: int = 4, seed: int | None = None, only: str = "") -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as cache:
        run(draws, seed, only, Path(cache))


def run(draws: int, seed: int | None, only: str, cache: Path) -> None:
    """Draw, sweep, estimate and compare."""
    seed = int(np.random.SeedSequence().entropy % 2**32) if seed is None else seed
    print(f"seed {seed}, {draws} draws per ratio")
    print("unit  ratio  covered  rms error  median std  s each")
    rng = np.random.default_rng(seed)
    total, inside = 0, 0
    for name, band in BANDS_HZ.items():
        if only and name != only:
            continue
        unit = load_unit(name)
        plan = SweepPlan(spaced_frequencies(*band, 61), LEVELS_VPK)
        for ratio in RATIOS:
            started = time.perf_counter()
            errors, stds, hits = [], [], 0
            for _ in range(draws):
                swept = simulate(
                    off_datasheet(unit, rng), ratio, plan, seed=int(rng.integers(2**31))
                )
                found = estimate_response(reading(swept, rng), unit, cache=cache)
                low, high = found.contribution_ratio.interval95
                hits += low <= ratio <= high
                errors.append(found.contribution_ratio.value - ratio)
                stds.append(found.contribution_ratio.std)
            each = (time.perf_counter() - started) / draws
            rms = np.sqrt(np.mean(np.square(errors)))
            print(
                f"{name}  {ratio:5.2f}  {hits:3d}/{draws:<3d}  {rms:9.3f}  "
                f"{np.median(stds):10.3f}  {each:6.1f}",
                flush=True,
            )
            total, inside = total + draws, inside + hits
    print(f"covered {inside} of {total}")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:3]), *sys.argv[3:4])
