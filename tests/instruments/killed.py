"""Killing a measuring program outright, and going on: for the test and for the count of thirty."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from daq.analyser import SourceState
from daq.drivers import open_analyser
from daq.store import Store

PROGRAM = """
import sys
from pathlib import Path
from daq.control import SessionControl
from daq.session_events import PointStored
from sim.unit import load_unit
from tui.bench import bench_session
from tui.measure_options import PlanOptions, session_request
url, db, resume, *plan = sys.argv[1:]
start, stop, points, settle, integrate, *levels = map(float, plan)
options = PlanOptions(
    tuple(levels), start, stop, int(points),
    settle_cycles=int(settle), integrate_cycles=int(integrate),
) if resume == "0" else PlanOptions()
unit = load_unit("adss")
request = session_request(
    options, "adss", unit, url, Path(db), recipe=None, bench="default",
    resume=int(resume) or None, remeasure=None, run_in=None,
    remarks={"serial": "", "operator": "", "notes": ""},
)
print("ready", flush=True)
for event in bench_session(url, unit, Path(db), request, SessionControl()):
    if isinstance(event, PointStored):
        print(event.stored.id, event.stored.point.gain, flush=True)
print("done", flush=True)
"""


@dataclass(frozen=True)
class Killed:
    """What one killed run left: what it had told, and whether it got to its end."""

    told: tuple[tuple[int, complex], ...]
    done: bool


def start(url: str, db: Path, resume: int, plan: tuple[float, ...]) -> subprocess.Popen:
    """Start the measuring program; returns once it is about to begin."""
    words = [url, str(db), str(resume), *(str(number) for number in plan)]
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *words], stdout=subprocess.PIPE, text=True
    )
    line = process.stdout.readline()
    assert line == "ready\n", line
    return process


def end(process: subprocess.Popen, lines: Sequence[str] = ()) -> Killed:
    """Read what was told, to the end of the program; some lines were read before."""
    told, done = [], False
    for line in [*lines, *process.stdout]:
        if line == "done\n":
            done = True
        elif line.endswith("\n"):
            number, gain = line.split()
            told.append((int(number), complex(gain)))
    process.stdout.close()
    process.wait(60)
    return Killed(tuple(told), done)


def killed_after(
    points: int, seconds: float, url: str, db: Path, resume: int, plan: tuple[float, ...]
) -> Killed:
    """Run, and kill with SIGKILL some time after a number of points was told."""
    process = start(url, db, resume, plan)
    lines = [process.stdout.readline() for _ in range(points)]
    time.sleep(seconds)
    os.kill(process.pid, signal.SIGKILL)
    return end(process, lines)


def check_kept(db: Path, measurement: int, told) -> None:
    """Every point that was told is in the history, with the value that was told."""
    with Store(db) as store:
        kept = {point.id: point.point.gain for point in store.points(measurement, superseded=True)}
    for number, gain in told:
        assert kept[number] == gain


def begun(db: Path, measurement: int) -> int:
    """The measurement if it is in the history, 0 if its program was killed before it began."""
    with Store(db) as store:
        return measurement if measurement in [m.id for m in store.measurements()] else 0


def wait_for_watchdog(db: Path, measurement: int, seconds: float = 30.0) -> str:
    """What the watchdog wrote into the journal."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        with Store(db) as store:
            lines = [e.text for e in store.events(measurement) if e.kind == "watchdog"]
        if lines:
            return lines[-1]
        time.sleep(0.05)
    raise AssertionError("the watchdog wrote nothing")


def source_state(url: str) -> SourceState:
    """What the instrument says of its source now."""
    analyser = open_analyser(url)
    try:
        return analyser.source_state()
    finally:
        analyser.close()
