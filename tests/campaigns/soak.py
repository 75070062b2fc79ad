"""The soak: a bench that measures back to back for an hour, and what it holds on to.

Run as ``python tests/campaigns/soak.py [--minutes M] [--write]``, or as
``make soak``. A server process is the simulated analyser with the gimbal behind
it, as fast as it goes; this process is the bench and measures over TCP, one
session after the other into one history, each with its lock and its watchdog.
After each session it notes memory, file handles and threads of both processes,
bytes of history per point, and pace, as a line of JSON in ``build/soak.jsonl``:
a run that is cut short loses nothing, and ``--report`` tells what that file
holds. It ends with 1 if any of them grows. Needs /proc, so Linux.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from instruments.bench_server import serving  # noqa: E402

from daq.control import SessionControl  # noqa: E402
from daq.session_events import Finished  # noqa: E402
from sim.unit import load_unit  # noqa: E402
from tui.bench import bench_session  # noqa: E402
from tui.measure_options import PlanOptions, session_request  # noqa: E402

PAGE = ROOT / "docs" / "reliability.md"
SAMPLES = ROOT / "build" / "soak.jsonl"
PICTURE = ROOT / "docs" / "pictures" / "soak.png"
BEGIN, END = "<!-- soak begins -->", "<!-- soak ends -->"
LEVELS_VPK, POINTS = (1.5, 2.5), 6
WARM = 0.1
"""Share of the samples at the beginning that is not judged: caches fill."""
BOUNDS = {
    "bench_mib": 5.0,
    "server_mib": 5.0,
    "bench_handles": 0.0,
    "server_handles": 0.0,
    "bench_threads": 0.0,
    "server_threads": 0.0,
    "bytes_per_point": 50.0,
}
"""How far the last tenth may lie above the first one that is judged."""
NAMES = {
    "bench_mib": "memory of the bench, MiB",
    "server_mib": "memory of the server, MiB",
    "bench_handles": "file handles of the bench",
    "server_handles": "file handles of the server",
    "bench_threads": "threads of the bench",
    "server_threads": "threads of the server",
    "bytes_per_point": "history, bytes per point",
    "session_s": "time of a session, s",
}


@dataclass(frozen=True)
class Sample:
    """What was held after one session."""

    elapsed_s: float
    points: int
    bench_mib: float
    server_mib: float
    bench_handles: int
    server_handles: int
    bench_threads: int
    server_threads: int
    bytes_per_point: float
    session_s: float


def soak(seconds: float, db: Path, url: str, server: int) -> Iterator[Sample]:
    """Measure until the time is over, a sample after each session."""
    began, points = time.monotonic(), 0
    while (start_s := time.monotonic()) - began < seconds:
        points += measure(db, url)
        end_s = time.monotonic()
        sizes = (path.stat().st_size for path in db.parent.iterdir())
        yield Sample(
            end_s - began,
            points,
            *(held(process, mib_of) for process in (os.getpid(), server)),
            *(held(process, handles_of) for process in (os.getpid(), server)),
            *(held(process, threads_of) for process in (os.getpid(), server)),
            sum(sizes) / points,
            end_s - start_s,
        )


def measure(db: Path, url: str) -> int:
    """One complete session; returns its points."""
    unit = load_unit("adss")
    options = PlanOptions(LEVELS_VPK, 130.0, 160.0, POINTS, settle_cycles=3, integrate_cycles=4)
    request = session_request(
        options, "adss", unit, url, db,
        recipe=None, bench="default", resume=None, remeasure=None, run_in=None,
        remarks={"serial": "soak", "operator": "", "notes": ""},
    )  # fmt: skip
    *_, last = bench_session(url, unit, db, request, SessionControl())
    assert isinstance(last, Finished)
    assert last.state == "complete"
    assert last.source_state == "confirmed-off"
    assert last.points == len(LEVELS_VPK) * POINTS
    return last.points


def held(process: int, what) -> float:
    """One of the three below."""
    return what(Path("/proc") / str(process))


def mib_of(place: Path) -> float:
    """Memory in use, MiB."""
    lines = (place / "status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024.0


def handles_of(place: Path) -> int:
    """Open files, sockets and pipes."""
    return len(list((place / "fd").iterdir()))


def threads_of(place: Path) -> int:
    """Threads that run."""
    return len(list((place / "task").iterdir()))


def growth(samples: list[Sample], name: str) -> tuple[float, float]:
    """Median of the first judged tenth, and of the last."""
    values = np.array([getattr(sample, name) for sample in samples], dtype=float)
    tenth = max(1, len(values) // 10)
    begin = int(WARM * len(values))
    return float(np.median(values[begin : begin + tenth])), float(np.median(values[-tenth:]))


def grown(samples: list[Sample]) -> list[str]:
    """What grew beyond its bound."""
    found = []
    for name, bound in BOUNDS.items():
        first, last = growth(samples, name)
        if last - first > bound:
            found.append(f"{NAMES[name]} grew from {first:.4g} to {last:.4g}")
    return found


def table(samples: list[Sample]) -> list[str]:
    """The result in words."""
    end, sessions = samples[-1], len(samples)
    longest_s = max(sample.session_s for sample in samples)
    lines = [
        f"{end.elapsed_s / 60:.0f} minutes, {sessions} sessions, "
        f"{sessions * len(LEVELS_VPK)} sweeps, {end.points} points into one history. A sample "
        f"is taken after every session, at the latest after {longest_s:.0f} s. The first tenth of "
        "the sessions is left out; the medians are of the next tenth and of the last:",
        "",
        "| | at the beginning | at the end |",
        "| --- | --- | --- |",
    ]
    for name, title in NAMES.items():
        first, last = growth(samples, name)
        lines.append(f"| {title} | {first:.4g} | {last:.4g} |")
    return lines


def draw(samples: list[Sample], path: Path) -> None:
    """Everything over the number of sweeps."""
    from matplotlib.figure import Figure

    sweeps = np.array([sample.points for sample in samples]) // POINTS
    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    counted = ("bench_handles", "server_handles", "bench_threads", "server_threads")
    panels = (
        ("memory, MiB", ("bench_mib", "server_mib")),
        ("file handles and threads", counted),
        ("history, bytes per point", ("bytes_per_point",)),
        ("time of a session, s", ("session_s",)),
    )
    for axes, (title, names) in zip(figure.subplots(2, 2, sharex=True).flat, panels, strict=True):
        for name, dashes in zip(names, ("-", "--", "-.", ":"), strict=False):
            values = [getattr(sample, name) for sample in samples]
            label = NAMES[name] if names is counted else name.partition("_")[0]
            # Dashed, since some lie on each other.
            axes.plot(sweeps, values, dashes, linewidth=1.2, label=label)
        axes.set_ylim(0.0, 1.1 * float(axes.dataLim.ymax))
        axes.set_title(title, fontsize=10)
        axes.grid(alpha=0.3)
        if len(names) > 1:
            axes.legend(fontsize=8, loc="lower right")
        if names == ("bytes_per_point",):
            # The file that a first session makes is nearly empty, and far above all others.
            axes.set_ylim(0.0, 1.5 * float(np.median(values)))
    figure.supxlabel("sweeps", fontsize=10)
    figure.savefig(path, dpi=110)


def report(samples: list[Sample], *, write: bool) -> list[str]:
    """Print, and perhaps write, the result; what grew."""
    lines, found = table(samples), grown(samples)
    print("\n".join([*lines, *found]), flush=True)
    if write:
        draw(samples, PICTURE)
        text = PAGE.read_text(encoding="utf-8")
        before, after = text[: text.index(BEGIN)], text[text.index(END) :]
        PAGE.write_text(f"{before}{BEGIN}\n\n" + "\n".join(lines) + f"\n\n{after}", "utf-8")
    return found


def run(seconds: float) -> None:
    """Measure for that long; every sample is on the disk before the next session begins."""
    serve = ("--unit", "adss", "--ratio", "0.3", "--tcp", "0", "--speed", "fast")
    SAMPLES.parent.mkdir(exist_ok=True)
    with (
        tempfile.TemporaryDirectory(prefix="soak-") as folder,
        serving(*serve) as served,
        SAMPLES.open("w", encoding="ascii", buffering=1) as lines,
    ):
        db, url = Path(folder) / "bench.db", served["tcp"]
        children = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children")
        server = int(children.read_text(encoding="ascii").split()[0])
        for number, sample in enumerate(soak(seconds, db, url, server)):
            lines.write(json.dumps(asdict(sample)) + "\n")
            if number % 100 == 0:
                print(sample, flush=True)


def recorded() -> list[Sample]:
    """The samples of the last run, whether or not it came to its end."""
    lines = SAMPLES.read_text(encoding="ascii").splitlines()
    return [Sample(**json.loads(line)) for line in lines]


def main() -> int:
    """Run, print, and perhaps write."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("--minutes", type=float, default=60.0)
    words.add_argument("--report", action="store_true", help="no run, only the last one's samples")
    words.add_argument("--write", action="store_true", help="write table and picture into the docs")
    given = words.parse_args()
    if not given.report:
        run(given.minutes * 60.0)
    return 1 if report(recorded(), write=given.write) else 0


if __name__ == "__main__":
    sys.exit(main())
