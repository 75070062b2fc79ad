"""What a million units a day would take: tasks, bytes, cores, from what one of each costs here.

    python tests/benchmarks/scale.py

Measures one family of machines (a task of a cluster) and one estimate whose machines are kept,
both on one core, and writes the plan into docs/scale.md.
"""

from __future__ import annotations

import pickle
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from yardsticks.page import DOCS, machine, replace_block  # noqa: E402

from analysis.ensemble.batch import Family, read_family  # noqa: E402
from analysis.ensemble.datasheet_spread import spread_of  # noqa: E402
from analysis.ensemble.run_cache import run_families  # noqa: E402
from analysis.estimate import estimate_response  # noqa: E402
from analysis.estimate.design import RATIO, every_family, near_families, wide_families  # noqa: E402
from analysis.observation.observation import observe  # noqa: E402
from daq.plan import SweepPlan, spaced_frequencies  # noqa: E402
from sim.response import simulate  # noqa: E402
from sim.unit import load_unit  # noqa: E402

UNITS = 1e6
DAY_S = 86400.0
BUSY = 0.7
"""Share of a day that a core is worth: the rest goes to starts, stragglers and repairs."""


class Instant:
    """An executor whose tasks give noise: what is left is what an estimate costs without runs."""

    def each(self, work, tasks, progress=None):
        """Readings of the right shape that follow the ratio."""
        rng = np.random.default_rng(0)
        parts = []
        for family in tasks:
            rows = sum(len(at) for _, at in family.plans)
            ratio = np.array([machine.ratio for machine in family.machines])[:, None]
            slope = np.linspace(-1.0, 1.0, rows)
            noise = 0.1 * rng.standard_normal((2, len(ratio), rows))
            mean = 0.1 * np.exp(ratio * slope + noise[0] + 1j * noise[1])
            parts.append((mean, np.full(mean.shape, 1e-4)))
        return parts


def processor_s(work: Callable[[], object], repeats: int) -> float:
    """Least processor time of some repeats."""
    times = []
    for _ in range(repeats):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return min(times)


def main() -> None:
    """Measure, print, and write the page."""
    unit = load_unit("adss")
    plan = SweepPlan(spaced_frequencies(100.0, 180.0, 61), (1.4, 2.4, 3.8))
    response = simulate(unit, 0.4, plan)
    seen, spread = observe(response), spread_of(unit)
    every = every_family([RATIO], seen, spread, 0)
    near = near_families([RATIO], np.array([0.4]), np.array([0.04]), seen, spread, 0)
    each, shared = len(wide_families([RATIO], seen, spread, 0)) + len(near), len(every)
    family = Family(unit, near[0], seen.plans)
    readings = read_family(family)
    family_s = processor_s(lambda: read_family(family), 2)
    sent, returned = len(pickle.dumps(family)), len(pickle.dumps(readings))
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder)
        run_families(unit, every, seen, cache=cache, executor=Instant())

        def estimate() -> None:
            estimate_response(response, unit, cache=cache, executor=Instant())

        estimate()
        regression_s = processor_s(estimate, 3)
        kept = sum(file.stat().st_size for file in cache.iterdir())
    simulated = len(family.machines) * plan.duration_s
    day = DAY_S * BUSY
    lines = [
        f"Measured on {machine()}; processor times of one core.",
        "",
        "| one of each | |",
        "| --- | --- |",
        f"| a family of {len(near[0])} machines "
        f"| {simulated:.0f} s of motion in {family_s:.2f} s |",
        f"| its task and its result | {sent / 1e3:.1f} kB out, {returned / 1e3:.0f} kB back |",
        f"| an estimate whose machines are kept | {regression_s:.2f} s |",
        f"| families of a plan, at every place of the lattice | {shared}, once |",
        f"| families of an estimate that shares nothing | {each} |",
        f"| kept of a plan | {kept / 1e6:.1f} MB |",
        "",
        "With cost = families x family + estimates x regression, and a core worth "
        f"{100 * BUSY:.0f} % of a day:",
        "",
        "| 10^6 units a day | one plan for all | a plan for each |",
        "| --- | --- | --- |",
        f"| tasks (families) | {shared} | {UNITS * each:.1e} |",
        f"| simulation | {shared * family_s:.0f} core s, once "
        f"| {UNITS * each * family_s / DAY_S:.0f} core days |",
        f"| regression | {UNITS * regression_s / DAY_S:.1f} core days "
        f"| {UNITS * regression_s / DAY_S:.1f} core days |",
        f"| cores | {np.ceil(UNITS * regression_s / day):.0f} "
        f"| {np.ceil(UNITS * (each * family_s + regression_s) / day):.0f} |",
        f"| bytes to and from workers | {shared * (sent + returned) / 1e6:.0f} MB, once "
        f"| {UNITS * each * (sent + returned) / 1e12:.1f} TB, "
        f"{8 * UNITS * each * (sent + returned) / DAY_S / 1e9:.1f} Gbit/s |",
        f"| tasks a second | 0 | {UNITS * each / DAY_S:.0f} |",
    ]
    print("\n".join(lines))
    replace_block("scale", lines, DOCS / "scale.md")


if __name__ == "__main__":
    main()
