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

from analysis.ensemble import TOLERANCES
from analysis.estimate import estimate_response
from daq.frf import DB_PER_NEPER, FrequencyResponse
from daq.plan import SweepPlan, spaced_frequencies
from sim.response import simulate
from sim.unit import Unit, load_unit

RATIOS = (0.1, 0.3, 0.5, 0.7, 0.9)
LEVELS_VPK = (1.5, 2.5, 4.0)
BANDS_HZ = {"adss": (100.0, 180.0), "edss": (30.0, 110.0)}
NOISE_V = 5e-4


def machine(unit: Unit, rng: np.random.Generator) -> Unit:
    """A unit off its datasheet within tolerance."""
    known = unit.parameters
    changed = {s: known[s] * (1.0 + rng.normal(0.0, share)) for s, share in TOLERANCES.items()}
    return unit.with_parameters(**changed)


def reading(response: FrequencyResponse, rng: np.random.Generator) -> FrequencyResponse:
    """What a bench reads of a response: noise added and counted in the stated error."""
    noise = NOISE_V / response.source_vpk
    added = rng.standard_normal((2, len(response))) * noise
    gain = response.gain + added[0] + 1j * added[1]
    along = response.gain_std_db / DB_PER_NEPER
    across = np.radians(response.phase_std_deg)
    total = np.sqrt(along**2 + across**2 + 2.0 * (noise / np.abs(gain)) ** 2)
    return FrequencyResponse.from_arrays(
        response.frequency_hz,
        response.source_vpk,
        gain,
        unit=response.unit,
        gain_std_db=DB_PER_NEPER * total,
        direction=response.direction,
        settle_cycles=response.settle_cycles,
        integrate_cycles=response.integrate_cycles,
    )


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
                swept = simulate(machine(unit, rng), ratio, plan, seed=int(rng.integers(2**31)))
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
