"""What whole pieces of work cost, beside their goals, and how the cost grows.

    python tests/benchmarks/totals.py [--only NAME ...] [--no-growth]

Writes its tables into docs/performance.md and the growth plot beside it. Wall times are the least
of some repeats where a repeat is cheap; processor times count all threads. On a machine that
others use a wall time says little: divide the processor time by the cores for a bound.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from yardsticks.growth import draw_growth, measure_growth  # noqa: E402
from yardsticks.page import machine, replace_block  # noqa: E402

COMMAND = str(Path(sys.executable).with_name("lashbench"))
COMPILE = """
import sys, time
sys.path[:0] = [{tests!r}]
import numpy as np
from worlds.side_by_side import ADSS, drive
from sim.drivetrain import paper_drivetrain
system = paper_drivetrain(ADSS, 0.25).system()
began, used = time.perf_counter(), time.process_time()
for single in (False, True):
    drive(system, np.zeros(len(system.states)), 1000.0, 1, amplitude=1.0, single=single)
print(time.perf_counter() - began, time.process_time() - used)
"""
ARITHMETIC = """
import time
from analysis.emulation.kernel_data import compile_all
began, used = time.perf_counter(), time.process_time()
compile_all()
print(time.perf_counter() - began, time.process_time() - used)
"""
TABLE2 = """
import time
from analysis.paper.table2 import read_grid
from analysis.paper.published import load_paper
from analysis.paper.runs import exact_runs_db, grid_hz
from sim.unit import load_unit
from sim.response import simulate
from daq.plan import SweepPlan
simulate(load_unit("adss"), 0.5, SweepPlan((500.0,), (1.0,), settle_cycles=1, integrate_cycles=1))
began, used = time.perf_counter(), time.process_time()
paper = load_paper()
for unit in ("ADSS", "EDSS"):
    ratios = [row.ratio_percent for row in paper.simulated if row.unit == unit]
    for gains in exact_runs_db(unit, ratios, 1, 0, lambda share: None):
        read_grid(grid_hz(unit), gains)
print(time.perf_counter() - began, time.process_time() - used)
"""


class Cost(NamedTuple):
    """Seconds on the clock and of the processor, and memory held at most, MB (NaN: not asked)."""

    wall_s: float
    cpu_s: float
    peak_mb: float = float("nan")


def run(words: list[str], **environment: str) -> Cost:
    """A program from start to end."""
    began = time.perf_counter()
    child = subprocess.Popen(
        words, env={**os.environ, **environment}, stdout=subprocess.DEVNULL
    )  # fmt: skip
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{' '.join(words)} ended with {child.returncode}")
    wall = time.perf_counter() - began
    # A child begins as a copy of this process: less than that says nothing about it.
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    peak_mb = used.ru_maxrss / 1024.0 if used.ru_maxrss > own else float("nan")
    return Cost(wall, used.ru_utime + used.ru_stime, peak_mb)


def inside(code: str, **environment: str) -> Cost:
    """What a program says of the part that matters: its last two words, wall and processor s."""
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **environment}, check=True,
        capture_output=True, text=True,
    )  # fmt: skip
    wall, cpu = map(float, done.stdout.split()[-2:])
    return Cost(wall, cpu)


def least(repeats: int, work) -> Cost:
    """The least of each number over repeats."""
    return Cost(*np.min([work() for _ in range(repeats)], axis=0).tolist())


USUAL, OWN = ("1.5", "2.5", "4"), ("1.4", "2.4", "3.8")
"""Levels: for the usual ones the runs of an estimate come with lashbench."""


def sweep(folder: Path, levels: tuple[str, ...]) -> Path:
    """A simulated sweep of ADSS at 3 levels and 61 points, as a bench reads it."""
    file = folder / f"sweep-{levels[0]}.csv"
    words = ["simulate", "--unit", "adss", "--ratio", "0.4", "--start", "100", "--stop", "180",
             "--points", "61", "--out", str(file)]  # fmt: skip
    run([COMMAND, *words, *(word for level in levels for word in ("--level", level))])
    return file


def measure(folder: Path, only: list[str]) -> list[tuple[str, str, Cost]]:
    """Name, goal and cost of every piece of work."""
    tests = str(Path(__file__).resolve().parents[1])
    rows: list[tuple[str, str, Cost]] = []

    def add(key: str, name: str, goal: str, work, repeats: int = 1) -> None:
        if only and key not in only:
            return
        rows.append((name, goal, least(repeats, work)))
        cost = rows[-1][2]
        print(f"{name:52}{cost.wall_s:9.2f} s {cost.cpu_s:9.2f} s {cost.peak_mb:7.0f} MB"
              f"   goal {goal}", flush=True)  # fmt: skip

    places = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    compiled = {place: str(folder / "compiled") for place in places}
    add("help", "lashbench --help", "0.25 s", lambda: run([COMMAND, "--help"]), 7)
    for what, work in (
        ("the engine in both precisions, a servo", COMPILE.format(tests=tests)),
        ("the arithmetic of a diagnosis", ARITHMETIC),
    ):

        def compiling(work: str = work) -> Cost:
            return inside(work, **compiled)

        add("compile", f"compiling {what}, once", "10 s", compiling)
        add("compile", f"loading {what.split(',')[0]}", "", compiling, 3)
    add("table2", "Table 2, exact engine, 100 cycles, one draw", "3 s", lambda: inside(TABLE2), 2)
    if only and not {"estimate", "diagnose"} & set(only):
        return rows
    kept, ahead = ({"XDG_CACHE_HOME": str(folder / name)} for name in ("cache", "ahead"))
    files = {levels: str(sweep(folder, levels)) for levels in (USUAL, OWN)}

    def working(verb: str, levels: tuple[str, ...], place: dict[str, str]) -> Cost:
        return run([COMMAND, verb, files[levels], "--unit", "adss", "--json"], **place)

    what = "3 levels x 61 points"
    row = f"prepare, another plan of {what}, once"
    rows.append((row, "", working("prepare", OWN, ahead)))
    for verb, goal in (("estimate", "3 s"), ("diagnose", "30 s")):
        for levels, place, name in (
            (USUAL, kept, f"{what}, the usual sweep"),
            (OWN, ahead, f"{what}, first of another plan, prepared"),
            (OWN, kept, f"{what}, first of another plan, not prepared"),
            (OWN, kept, "another measurement of that plan"),
        ):

            def work(verb=verb, levels=levels, place=place) -> Cost:
                return working(verb, levels, place)

            add(verb, f"{verb}, {name}", goal, work)
    return rows


def table(rows: list[tuple[str, str, Cost]]) -> list[str]:
    """The rows for the page; a goal is judged by the clock."""
    lines = [
        "| what | goal | clock, as measured | processor | memory | reached |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, goal, cost in rows:
        memory = "" if np.isnan(cost.peak_mb) else f"{cost.peak_mb:.0f} MB"
        lines.append(
            f"| {name} | {goal} | {cost.wall_s:.2f} s | {cost.cpu_s:.2f} s | {memory} "
            f"| {judged(goal, cost)} |"
        )
    return lines


def judged(goal: str, cost: Cost) -> str:
    """Whether a goal in seconds is reached, and by how much not."""
    if not goal:
        return ""
    bound = float(goal.split()[0])
    if cost.wall_s <= bound:
        return "yes"
    return f"missed {cost.wall_s / bound:.1f}-fold by the clock"


def main() -> None:
    """Measure, print, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", default=[],
                        choices=["help", "compile", "table2", "estimate", "diagnose"])  # fmt: skip
    parser.add_argument("--no-growth", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = measure(Path(folder), options.only)
    if not options.only:
        replace_block("totals", [f"Measured on {machine()}.", "", *table(rows)])
    if not options.no_growth:
        curves = measure_growth()
        draw_growth(curves)
        for curve in curves:
            print(curve.summary())
        lines = [f"- {curve.summary()}" for curve in curves]
        replace_block("growth", [f"Measured on {machine()}.", "", *lines])


if __name__ == "__main__":
    main()
