"""Published drives, measured by the independent plant and judged, with no cause or one hidden.

    python tests/studies/drives.py UNIT [CAUSE=FACTOR] [--points N] [--seed N] [--drawn]
    python tests/studies/drives.py --every FILE [--points N]
    python tests/studies/drives.py --table FILE

CAUSE is a number of the plant (J_L, k_s1, B_m, k_a ...) and is multiplied by FACTOR. Prints a line
of JSON: the verdict, what is named, ratio and total backlash with their errors, and what is true.
`--drawn` draws all values of the drive within their tolerance; without it they are the datasheet's.
`--every` adds what a file of such lines lacks of all published drives, each in a process of its
own, what costs least first; `--table` counts it. One takes minutes of a processor; it is no test.
"""

import argparse
import json
import math
import subprocess
import sys
import tomllib
import zlib
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from oracle import drive_plant

from analysis.diagnosis import diagnose_response
from analysis.estimate import estimate_response
from daq.configs import config_names, config_path
from daq.frf import (
    DB_PER_NEPER,
    GAIN_STD_COMPONENTS,
    GAIN_STD_IS,
    FrequencyResponse,
    error_words,
)
from sim.datasheet import natural_frequencies
from sim.unit import load_unit

PAPER = ("adss", "edss")
NOISE_V = 2e-4
"""Of the bench, per component of a reading."""


def measured(name, ratio, points, seed, changed, shares=(0.3, 0.5, 0.8), cycles=(12, 12)):
    """A sweep about ARF and RF as the plant shows it, at shares of the unit's highest level."""
    unit = load_unit(name)
    document = tomllib.loads(config_path("units", name).read_text(encoding="utf-8"))
    changed = dict(changed)
    document["backlash"]["b_t_deg"] = changed.pop("b_t_deg", unit.backlash.b_t_deg)
    if "b3_deg" in changed:
        document["stage3"]["b3_deg"] = changed.pop("b3_deg")
    modes = natural_frequencies(unit)
    hertz = np.geomspace(0.6 * modes.anti_resonances_hz[0], 1.3 * modes.resonances_hz[0], points)
    levels = [share * unit.limits.source_vpk for share in shares]
    rng = np.random.default_rng(seed)
    each = np.array(
        [
            drive_plant.sweep(document, ratio, hertz, v, *cycles, step_s=4e-6, seed=seed, **changed)
            for v in levels
        ]
    )
    settle, kept = cycles
    noise = rng.normal(size=(2, *each.shape)) * NOISE_V * np.sqrt(kept)
    each = each + (noise[0] + 1j * noise[1]) / np.array(levels)[:, None, None]
    mean = each.mean(axis=-1)
    along = ((each - mean[..., None]) * np.conj(mean / np.abs(mean))[..., None]).real
    std = along.std(axis=-1, ddof=1) / np.sqrt(kept)
    return unit, FrequencyResponse.from_arrays(
        np.tile(hertz, len(levels)),
        np.repeat(levels, points),
        mean.ravel(),
        unit=unit.name,
        gain_std_db=DB_PER_NEPER * (std / np.abs(mean)).ravel(),
        settle_cycles=settle,
        integrate_cycles=kept,
        # Scatter along the gain alone: taken for that of both components it tells another ratio.
        provenance={GAIN_STD_COMPONENTS: 1, GAIN_STD_IS: error_words(kept)},
    )


EFFECTS = {
    "J_L": "load-inertia",
    "k_s1": "shaft-stiffness",
    "B_m": "motor-viscous-friction",
    "T_f_m": "motor-coulomb-friction",
    "k_a": "amplifier-gain",
    "b_t_deg": "total-backlash",
}
"""What the catalogue calls a change of each number."""


def drawn_values(unit, rng):
    """A value for each number of the plant that has a tolerance, log-normal about the datasheet."""
    known = unit.parameters
    return {
        symbol: known[symbol] * math.exp(share * rng.standard_normal())
        for symbol, share in unit.tolerances.items()
        if share and known[symbol]
    }


def of_plant(values):
    """Values of a unit under the plant's names: its amplifier's bandwidth is a lag."""
    others = {symbol: value for symbol, value in values.items() if symbol != "bandwidth_hz"}
    if "bandwidth_hz" in values:
        others["L_a"] = 1.0 / (2.0 * math.pi * values["bandwidth_hz"])
    return others


def answered(name, cause, ratio, points, seed, tolerance=None, drawn=False):
    """What estimate and diagnosis say of one measured drive, and what is true."""
    unit = load_unit(name)
    ratio = 1.0 if unit.stages == 1 else ratio
    # Each drive has draws of its own.
    own = np.random.default_rng([seed, zlib.crc32(name.encode())])
    values = drawn_values(unit, own) if drawn else {}
    symbol, _, factor = cause.partition("=")
    hidden = {symbol: float(factor) * (unit.parameters | values)[symbol]} if symbol else {}
    unit, response = measured(name, ratio, points, seed, of_plant(values | hidden))
    if tolerance is not None:
        unit = unit.with_tolerance({"default": tolerance})
    estimate = None if cause else estimate_response(response, unit).to_json()
    found = diagnose_response(response, unit).to_json()
    return {
        "unit": name,
        "hidden": cause,
        "seed": seed,
        "true": {"ratio": ratio, "b_t_deg": unit.backlash.b_t_deg, **values},
        "estimate": estimate and {n: estimate[n] for n in ("contribution_ratio", "b_t_deg")},
        "verdict": found["verdict"],
        "causes": {c["effect"]: c["parameters"] for c in found["causes"]},
        "rivals": [[r["causes"], round(r["probability"], 3)] for r in found["rivals"][:4]],
        "ratio": found["contribution_ratio"],
        "datasheet": found.get("datasheet"),
        "elapsed_s": round(found["elapsed_s"]),
        "simulated_s": round(found["simulated_s"]),
    }


LATER = {"irb": 2, "srv02-torsion": 4}
"""Units whose lines cost minutes more, and by how many rounds of the others they come later."""

HIDDEN = (("J_L", 1.4), ("k_s1", 0.7), ("T_f_m", 2.5), ("B_m", 2.5), ("b_t_deg", 2.0))


def cases():
    """Unit, cause, ratio, seed and whether values are drawn, of each line of the study.

    In rounds: nothing hidden, one cause each, nothing hidden with drawn values, the other causes;
    then each cause and nothing once more, with other values drawn for each.
    """
    found = []
    for place, name in enumerate(name for name in config_names("units") if name not in PAPER):
        known = load_unit(name).parameters
        causes = [f"{symbol}={factor}" for symbol, factor in HIDDEN
                  if known[symbol] and (symbol != "B_m" or not known["T_f_m"])]  # fmt: skip
        first = place % len(causes)
        one, *others = causes[first:] + causes[:first]
        rounds = [("", 0.3, 1, False), (one, 0.3, 1, False), ("", 0.6, 2, True)]
        rounds += [(cause, 0.3, 1, False) for cause in others]
        rounds += [(cause, 0.6, 3 + i, True) for i, cause in enumerate([*causes, ""])]
        found += [(LATER.get(name, 0) + at, (name, *case)) for at, case in enumerate(rounds)]
    return [case for _, case in sorted(found, key=lambda one: one[0])]


def every(path, points):
    """Add to a file the lines that it lacks."""
    path.touch()
    for name, cause, ratio, seed, drawn in cases():
        known = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
        if any((k["unit"], k["hidden"], k["seed"]) == (name, cause, seed) for k in known):
            continue
        own = [sys.executable, __file__, name, *([cause] if cause else []), "--seed", str(seed)]
        own += ["--ratio", str(ratio), "--points", str(points), "--out", str(path)]
        own += ["--drawn"] if drawn else []
        subprocess.run(own, check=False)


def interval(hits, count):
    """A share with its 95 % interval (Wilson), in words."""
    z, share = 1.96, hits / count
    middle = (share + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z * math.sqrt(share * (1 - share) / count + z**2 / (4 * count**2)) / (1 + z**2 / count)
    return f"{hits} of {count} ({100 * (middle - half):.0f} to {100 * (middle + half):.0f} %)"


def table(path):
    """Lines of text: how often each answer is right."""
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    counted = {}
    for one in lines:
        named = list(one["causes"])
        drawn = len(one["true"]) > 2
        if not one["hidden"]:
            which = "nothing hidden, values drawn" if drawn else "nothing hidden"
            counted.setdefault(f"{which}: consistent", []).append(one["verdict"] == "consistent")
        else:
            true = EFFECTS[one["hidden"].partition("=")[0]]
            which = "hidden, values drawn" if drawn else "hidden"
            counted.setdefault(f"{which}: named first", []).append(named[:1] == [true])
            counted.setdefault(f"{which}: named alone", []).append(named == [true])
            if one["verdict"] == "explained":
                counted.setdefault(f"{which}, a sure answer: right", []).append(named == [true])
        if one["true"]["ratio"] == 1.0 and not one["hidden"]:
            low, high = one["estimate"]["b_t_deg"]["interval95"]
            inside = low <= one["true"]["b_t_deg"] <= high
            counted.setdefault("backlash of one stage within its 95 % interval", []).append(inside)
        if one["true"]["ratio"] < 1.0:
            told = one["ratio"]["extended"]
            off = abs(told["value"] - one["true"]["ratio"])
            low, high = told.get("interval95", (0.0, 0.0))
            inside = low <= one["true"]["ratio"] <= high or off <= 1.96 * told["std"]
            counted.setdefault("ratio within its 95 % interval", []).append(inside)
    return [f"{what}: {interval(sum(hits), len(hits))}" for what, hits in counted.items()]


def put_down(one, path):
    """Print a record, and add it to a file, if one is given."""
    line = json.dumps(one)
    print(line)  # noqa: T201
    if path:
        with path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")


def main():
    """Measure, estimate, diagnose, and say what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("unit", nargs="?")
    parser.add_argument("cause", nargs="?", default="")
    parser.add_argument("--ratio", type=float, default=0.3)
    parser.add_argument("--points", type=int, default=25)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tolerance", type=float)
    parser.add_argument("--drawn", action="store_true")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--every", type=Path)
    parser.add_argument("--table", type=Path)
    told = parser.parse_args()
    if told.table:
        print("\n".join(table(told.table)))  # noqa: T201
        return
    if told.every:
        every(told.every, told.points)
        return
    one = answered(
        told.unit, told.cause, told.ratio, told.points, told.seed, told.tolerance, told.drawn
    )
    put_down(one, told.out)


if __name__ == "__main__":
    main()
