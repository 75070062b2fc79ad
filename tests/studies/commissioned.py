"""Drives whose values are off their datasheet, commissioned, and measured again after a change.

    python tests/studies/commissioned.py --every FILE [--drives N]
    python tests/studies/commissioned.py --table FILE

Each drive of several kinds has all values drawn with a standard deviation of 8 %, and is measured
by the independent plant. `lashbench commission` identifies it; the record says how far each value
and each independent combination is off. Then one value changes by 10 %, or none in every fourth
drive, and a further sweep is judged by the unit file that commissioning wrote. A line of JSON a
drive and step, all drives being commissioned before the first is judged; `--every` adds what the
file lacks, each line in a process of its own. It is no test.
"""

import argparse
import json
import subprocess
import sys
from datetime import date
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from studies.drives import drawn_values, interval, measured, of_plant, put_down

from analysis.commissioning import commission_drive, commissioned_unit_text
from analysis.commissioning.commission import DETERMINED
from analysis.diagnosis import diagnose_response
from daq.configs import config_path
from daq.errors import LashbenchError
from daq.untrusted.bounded_text import parse_toml
from sim.catalogue import not_of_unit
from sim.unit import load_unit, unit_from_mapping

KINDS = ("adss", "walkman-b11", "edss", "r3-1", "feed-axis")
TOLERANCE, CHANGE = 0.08, 0.10
POINTS, SHARES, CYCLES = 40, (0.3, 0.55, 0.8), (12, 12)
VISIBLE = CHANGE / 3.0
"""Standard deviation, the other values known, up to which a change is asked for: three of it."""

NAMES = {
    "J_L": "load-inertia",
    "J_m": "motor-inertia",
    "k_s1": "shaft-stiffness",
    "k_g1": "mesh1-stiffness",
    "k_a": "amplifier-gain",
    "k_ts": "tachometer-gain",
    "R_m": "motor-resistance",
    "B_m": "motor-viscous-friction",
    "T_f_m": "motor-coulomb-friction",
    "T_f_L": "load-coulomb-friction",
}
"""What the catalogue calls a change of each value."""


def commissioned(number):
    """The record of one drive."""
    rng = np.random.default_rng([number, 8])
    name = KINDS[number % len(KINDS)]
    unit = load_unit(name).with_tolerance({"default": TOLERANCE})
    ratio = float(rng.uniform(0.1, 0.9)) if unit.stages == 2 else 1.0
    values = drawn_values(unit, rng)
    response = measured(name, ratio, POINTS, number, of_plant(values), SHARES, CYCLES)[1]
    record = {"number": number, "unit": name, "true": {"ratio": ratio, **values}}
    try:
        found = commission_drive([response], unit)
    except LashbenchError as error:
        return record | {"refused": str(error)}
    true = np.array([ratio if p.datasheet is None else values[p.symbol] for p in found.parameters])
    off = np.array([
        t - p.value if p.datasheet is None else np.log(t / p.value)
        for t, p in zip(true, found.parameters, strict=True)
    ])  # fmt: skip
    wide, ways = np.linalg.eigh(found.covariance)
    text = commissioned_unit_text(
        config_path("units", name).read_text(encoding="utf-8"), found, name.upper(), date.today()
    )
    return record | {
        "parameters": {
            p.symbol: {"off": float(o), "std": p.std, "alone": p.conditional,
                       "determined": bool(p.determined)}
            for p, o in zip(found.parameters, off, strict=True)
        },
        "off_by_combination": (ways.T @ off / np.sqrt(wide)).tolist(),
        "std_of_combination": np.sqrt(wide).tolist(),
        "misfit": found.misfit,
        "unit_file": text,
        "elapsed_s": round(found.elapsed_s),
    }  # fmt: skip


def judged(known):
    """What a diagnosis by the unit file of a commissioned drive says, after a change or none."""
    number, name, values = known["number"], known["unit"], dict(known["true"])
    rng = np.random.default_rng([number, 9])
    unit = unit_from_mapping(parse_toml(known["unit_file"]), name)
    ratio = values.pop("ratio")
    alone = {symbol: one["alone"] for symbol, one in known["parameters"].items()}
    named = [s for s in NAMES if s in alone and NAMES[s] not in not_of_unit(unit)]
    shown = [s for s in named if alone[s] <= VISIBLE]
    changed = str(rng.choice(shown)) if number % 4 != 3 and shown else ""
    factor = 1.0 + CHANGE * float(rng.choice([-1.0, 1.0]))
    after = values | ({changed: factor * values[changed]} if changed else {})
    later = measured(name, ratio, POINTS, 1000 + number, of_plant(after), SHARES, CYCLES)[1]
    found = diagnose_response(later, unit).to_json()
    return {
        "number": number,
        "unit": name,
        "could_change": named,
        "visible": shown,
        "changed": changed,
        "factor": factor if changed else 1.0,
        "verdict": found["verdict"],
        "causes": {c["effect"]: [c["probability"], c["parameters"]] for c in found["causes"]},
        "rivals": [[r["causes"], round(r["probability"], 3), r["remark"]]
                   for r in found["rivals"][:4]],
        "true_ratio": ratio,
        "ratio": found["contribution_ratio"],
        "warnings": found["warnings"],
        "elapsed_s": round(found["elapsed_s"]),
    }  # fmt: skip


def lines_of(path):
    """The lines of a file: commissioned drives by number, and those judged after a change."""
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    return tuple(
        {one["number"]: one for one in lines if ("verdict" in one) == late}
        for late in (False, True)
    )


def every(path, drives):
    """Add to a file the lines that it lacks."""
    path.touch()
    for late in (False, True):
        for number in range(drives):
            known, after = lines_of(path)
            refused = late and "refused" in known.get(number, {"refused": ""})
            if number not in (after if late else known) and not refused:
                own = [sys.executable, __file__, "--one", str(number), "--out", str(path)]
                subprocess.run([*own, "--judge"] if late else own, check=False)


def table(path):
    """Lines of text: how often intervals hold the truth, and changes are named."""
    known, after = lines_of(path)
    counted = {}
    for one in known.values():
        counted.setdefault("commissioned, not refused", []).append("refused" not in one)
        if "refused" in one:
            continue
        for told in one["parameters"].values():
            held = abs(told["off"]) <= 1.96 * told["std"]
            which = "determined" if told["determined"] else "not determined"
            for what in ("all parameters", which):
                counted.setdefault(f"{what}: within the 95 % interval", []).append(held)
        for off, std in zip(one["off_by_combination"], one["std_of_combination"], strict=True):
            if std < DETERMINED * TOLERANCE:
                what = "determined combinations: within the 95 % interval"
                counted.setdefault(what, []).append(abs(off) <= 1.96)
    for one in after.values():
        named, true = list(one["causes"]), [NAMES[one["changed"]]] if one["changed"] else []
        if true:
            counted.setdefault("changed: named first", []).append(named[:1] == true)
            counted.setdefault("changed: named alone", []).append(named == true)
        else:
            counted.setdefault("unchanged: consistent", []).append(one["verdict"] == "consistent")
        if one["verdict"] == "explained":
            counted.setdefault("a sure answer: right", []).append(named == true)
    return [f"{what}: {interval(sum(hits), len(hits))}" for what, hits in counted.items()]


def main():
    """Commission, change, judge, and say what came of it; `--one` and `--judge` are a step."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=Path)
    parser.add_argument("--drives", type=int, default=20)
    parser.add_argument("--one", type=int)
    parser.add_argument("--judge", action="store_true")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--table", type=Path)
    told = parser.parse_args()
    if told.table:
        print("\n".join(table(told.table)))  # noqa: T201
    elif told.every:
        every(told.every, told.drives)
    else:
        judge = told.judge
        one = judged(lines_of(told.out)[0][told.one]) if judge else commissioned(told.one)
        put_down(one, told.out)


if __name__ == "__main__":
    main()
