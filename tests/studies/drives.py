"""Published drives, measured by the independent plant and judged, with no cause or one hidden.

    python tests/studies/drives.py UNIT [CAUSE=FACTOR] [--points N] [--seed N]

CAUSE is a number of the plant (J_L, k_s1, B_m, k_a ...) and is multiplied by FACTOR. Prints a line
of JSON: the verdict, what is named, ratio and total backlash with their errors, and what is true.
Takes a minute or more of a processor; it is no test.
"""

import argparse
import json
import sys
import tomllib
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from oracle import drive_plant

from analysis.diagnosis import diagnose_response
from analysis.estimate import estimate_response
from daq.configs import config_path
from daq.frf import (
    DB_PER_NEPER,
    GAIN_STD_COMPONENTS,
    GAIN_STD_IS,
    FrequencyResponse,
    error_words,
)
from sim.datasheet import natural_frequencies
from sim.unit import load_unit

CYCLES = 12, 12
NOISE_V = 2e-4
"""Of the bench, per component of a reading."""


def measured(name, ratio, points, seed, changed):
    """A sweep of three levels about ARF and RF, as the plant shows it."""
    unit = load_unit(name)
    document = tomllib.loads(config_path("units", name).read_text(encoding="utf-8"))
    modes = natural_frequencies(unit)
    hertz = np.geomspace(0.6 * modes.anti_resonances_hz[0], 1.3 * modes.resonances_hz[0], points)
    levels = [share * unit.limits.source_vpk for share in (0.3, 0.5, 0.8)]
    rng = np.random.default_rng(seed)
    cycles = np.array(
        [
            drive_plant.sweep(document, ratio, hertz, v, *CYCLES, step_s=4e-6, seed=seed, **changed)
            for v in levels
        ]
    )
    noise = rng.normal(size=(2, *cycles.shape)) * NOISE_V * np.sqrt(CYCLES[1])
    cycles = cycles + (noise[0] + 1j * noise[1]) / np.array(levels)[:, None, None]
    mean = cycles.mean(axis=-1)
    along = ((cycles - mean[..., None]) * np.conj(mean / np.abs(mean))[..., None]).real
    std = along.std(axis=-1, ddof=1) / np.sqrt(CYCLES[1])
    return unit, FrequencyResponse.from_arrays(
        np.tile(hertz, len(levels)),
        np.repeat(levels, points),
        mean.ravel(),
        unit=unit.name,
        gain_std_db=DB_PER_NEPER * (std / np.abs(mean)).ravel(),
        settle_cycles=CYCLES[0],
        integrate_cycles=CYCLES[1],
        # Scatter along the gain alone: taken for that of both components it tells another ratio.
        provenance={GAIN_STD_COMPONENTS: 1, GAIN_STD_IS: error_words(CYCLES[1])},
    )


def main():
    """Measure, estimate, diagnose, and say what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("unit")
    parser.add_argument("cause", nargs="?", default="")
    parser.add_argument("--ratio", type=float, default=0.3)
    parser.add_argument("--points", type=int, default=25)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tolerance", type=float)
    told = parser.parse_args()
    unit = load_unit(told.unit)
    ratio = 1.0 if unit.stages == 1 else told.ratio
    symbol, _, factor = told.cause.partition("=")
    changed = {symbol: float(factor) * unit.parameters[symbol]} if symbol else {}
    unit, response = measured(told.unit, ratio, told.points, told.seed, changed)
    if told.tolerance is not None:
        unit = unit.with_tolerance({"default": told.tolerance})
    estimate = estimate_response(response, unit).to_json()
    found = diagnose_response(response, unit).to_json()
    line = {
        "unit": told.unit,
        "hidden": told.cause,
        "seed": told.seed,
        "true": {"ratio": ratio, "b_t_deg": unit.backlash.b_t_deg},
        "estimate": {name: estimate[name] for name in ("contribution_ratio", "b_t_deg")},
        "verdict": found["verdict"],
        "causes": {c["effect"]: c["parameters"] for c in found["causes"]},
        "rivals": [[r["causes"], round(r["probability"], 3)] for r in found["rivals"][:4]],
        "ratio": found["contribution_ratio"],
    }
    print(json.dumps(line))  # noqa: T201


if __name__ == "__main__":
    main()
