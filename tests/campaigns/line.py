"""A production line of 50 simulated units, 10 of them bad, the program killed twice on the way.

    python tests/campaigns/line.py [--units 50] [--bad 10] [--seed 20007]

Every unit must be judged once, none wrongly, and the source be off at the end. Prints the outcome
as JSON; the exit code is 1 if a unit is missing, judged twice or judged wrongly.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from instruments.line_bench import BAD, GOOD, ended, line_bench


def run(units: int, bad: int, seed: int, folder: Path) -> dict:
    """Measure all units; what became of them."""
    rng = np.random.default_rng(seed)
    wrong = set(rng.choice(units, bad, replace=False).tolist())
    kills = set(rng.choice(np.arange(1, units), 2, replace=False).tolist())
    began_s = time.monotonic()
    with line_bench(folder) as bench:
        process = bench.start()
        for number in range(units):
            serial, inertia = f"SN{number:03}", BAD if number in wrong else GOOD
            if number in kills:
                bench.kill_in_mid_unit(process, serial, inertia)
                process = bench.start()
                label = process.stdout.readline()
            else:
                label = bench.scan(process, serial, inertia)
            print(f"{number + 1}/{units}  {label.strip()}", file=sys.stderr, flush=True)
        code, out, _ = ended(process)
        results, drives = bench.results(), bench.drives
    expected = {f"SN{n:03}": "FAIL" if n in wrong else "PASS" for n in range(units)}
    found = [(one["serial"], one["verdict"]) for one in results]
    return {
        "units": units,
        "bad": bad,
        "killed_at": sorted(kills),
        "judged": len(results),
        "judged_twice": len(found) - len({serial for serial, _ in found}),
        "lost": sorted(expected.keys() - {serial for serial, _ in found}),
        "wrong": [one for one in found if one[1] not in (expected.get(one[0]), "UNDECIDED")],
        "undecided": [serial for serial, verdict in found if verdict == "UNDECIDED"],
        "exit_code": code,
        "source_on": drives,
        "tally": out.strip().splitlines(),
        "elapsed_s": round(time.monotonic() - began_s),
    }


def main() -> int:
    """Run it and say how it went."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name, preset in (("--units", 50), ("--bad", 10), ("--seed", 20007)):
        parser.add_argument(name, type=int, default=preset)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        outcome = run(given.units, given.bad, given.seed, Path(folder))
    print(json.dumps(outcome, indent=1))
    failed = outcome["judged_twice"] or outcome["lost"] or outcome["wrong"] or outcome["source_on"]
    return 1 if failed or outcome["exit_code"] else 0


if __name__ == "__main__":
    sys.exit(main())
