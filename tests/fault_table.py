"""What every fault leads to, found out by provoking it; the table of docs/faults.md is made here.

Run as ``python tests/fault_table.py`` it provokes all of them with the
driver's own time limits and writes the table into the page. The tests provoke
them with shorter limits and compare.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from instruments.bench_server import served, simulated  # noqa: E402

from daq.control import SessionControl
from daq.errors import LashbenchError
from daq.hp35670a.setup import Timing
from daq.session_events import Finished
from sim.faults import CATALOGUE
from sim.instrument.plant import LinearPlant
from sim.models import model_of
from sim.unit import load_unit
from tui.bench import bench_session
from tui.measure_options import PlanOptions, session_request

PAGE = Path(__file__).parents[1] / "docs" / "faults.md"
MARKS = {
    "": ("<!-- table begins -->", "<!-- table ends -->"),
    "sr785": ("<!-- sr785 begins -->", "<!-- sr785 ends -->"),
}
"""Where the table of a driver's instrument stands."""
WIRES = ("tcp", "prologix_tcp")
WIRES_OF = {"": WIRES, "sr785": ("prologix_tcp", "serial_pty")}
POINTS = 6
POINTS_OF = {"": POINTS, "sr785": 11}
OWN = tuple(name for name in model_of("sr785").faults if name not in CATALOGUE)
"""Faults that the SR785 has alone."""

DEADLINES_S = {"silence": 75, "stuck-measuring-bit": 60, "stuck-parser": 45}
"""Bound of the whole session with the driver's own limits, s; 30 s for all others."""
DEADLINE_S = 30


IN_MID_SWEEP = ("slow-reply", "garbage-bytes", "truncated-block", "wrong-length", "missing-eoi")
"""Faults of a reply, which strike at the first one unless told otherwise."""

FOR_A_MOMENT = ("lost-power", "adapter-reset")
"""Faults that last for a while, kept short of any time limit."""


def ordered(name: str) -> str:
    """The fault as it is ordered: all that can do so strike in the sweep, not in the checks."""
    if name in IN_MID_SWEEP:
        return f"{name}:point=4,phase=read-out"
    if name in OWN:
        return f"{name}:point=16"  # behind the points of the trial
    return f"{name}:point=3,seconds=0.3" if name in FOR_A_MOMENT else name


@dataclass(frozen=True)
class Outcome:
    """How a session with a fault in it ended."""

    code: int
    state: str
    points: int
    flagged: int
    source: str
    elapsed_s: float
    said: str
    planned: int = POINTS

    def __str__(self) -> str:
        flagged = f", {self.flagged} flagged" if self.flagged else ""
        return f"{self.code}, {self.points}/{self.planned}{flagged}, {self.source}"


def provoke(fault: str, wire: str, folder: Path, driver: str = "") -> Outcome:
    """Measure on a simulated analyser with one fault."""
    unit, history = load_unit("adss"), folder / f"{fault.partition(':')[0]}-{wire}.db"
    points = POINTS_OF[driver]
    options = PlanOptions((2.5,), 130.0, 170.0, points, settle_cycles=3, integrate_cycles=4)
    began, finished, error = time.monotonic(), None, None
    instrument = simulated(driver, LinearPlant(lambda hz: 0.3), [fault])
    with served(instrument, wire, driver) as url:
        remarks = {"serial": "", "operator": "", "notes": ""}
        request = session_request(
            options, "adss", unit, url, history,
            recipe=None, bench="default", resume=None, remeasure=None, run_in=None,
            remarks=remarks,
        )  # fmt: skip
        try:
            for event in bench_session(url, unit, history, request, SessionControl()):
                finished = event if isinstance(event, Finished) else finished
        except LashbenchError as fault_told:
            error = fault_told
    assert finished is not None, error
    assert finished.error is error
    return Outcome(
        0 if error is None else error.exit_code,
        finished.state,
        finished.points,
        finished.flagged,
        finished.source_state.value,
        time.monotonic() - began,
        "" if error is None else str(error),
        points,
    )


def every_job(faults: Iterable[str], driver: str = "") -> list[tuple[str, str]]:
    """Every fault on every wire."""
    return [(name, wire) for name in faults for wire in WIRES_OF[driver]]


def provoke_all(
    folder: Path, faults: dict[str, str], jobs: list[tuple[str, str]], driver: str = ""
) -> dict[tuple[str, str], Outcome]:
    """Faults on wires, side by side: most of the time is waiting."""
    with ThreadPoolExecutor(8) as pool:
        outcomes = pool.map(lambda job: provoke(faults[job[0]], job[1], folder, driver), jobs)
        return dict(zip(jobs, outcomes, strict=True))


def provoke_again(
    made: dict[tuple[str, str], Outcome], folder: Path, faults: dict[str, str], driver: str = ""
) -> dict[tuple[str, str], Outcome]:
    """The same outcomes; what is not as the page has it is provoked once more, one by one.

    Limits are short, and on a machine that is busy with other tests an answer comes late.
    """
    written = written_outcomes(driver)
    odd = [job for job in made if str(made[job]) != written[job]]
    return made | {(name, wire): provoke(faults[name], wire, folder, driver) for name, wire in odd}


def short_timing() -> Timing:
    """Limits for tests: outcomes are the same, waits are not. A busy machine needs some room."""
    return Timing(reply_s=1.5, block_s=2.0, overhead_s=3.0)


def rows(outcomes: Mapping[tuple[str, str], Outcome | str], driver: str = "") -> list[str]:
    """The table, one row a fault."""
    heads = {
        "": "on raw TCP | through an adapter | ends within",
        "sr785": "through an adapter | RS-232",
    }[driver]
    lines = [f"| fault | what it is | {heads} |", "| --- " * (3 + heads.count("|")) + "|"]
    return [*lines, *(row_of(name, outcomes, driver) for name in (OWN if driver else CATALOGUE))]


def row_of(name: str, outcomes: Mapping[tuple[str, str], Outcome | str], driver: str = "") -> str:
    """The row of one fault."""
    cells = [str(outcomes[name, wire]) for wire in WIRES_OF[driver]]
    if not driver:
        cells.append(f"{DEADLINES_S.get(name, DEADLINE_S)} s")
    return f"| `{name}` | {model_of(driver).faults[name].does} | {' | '.join(cells)} |"


def written_rows(driver: str = "") -> list[str]:
    """The table as the page has it."""
    text, (begin, end) = PAGE.read_text(encoding="utf-8"), MARKS[driver]
    return text[text.index(begin) + len(begin) : text.index(end)].strip().splitlines()


def written_outcomes(driver: str = "") -> dict[tuple[str, str], str]:
    """Each cell of that table, by fault and wire."""
    found = {}
    for row in written_rows(driver)[2:]:
        name, _, *cells = row.strip("| ").split(" | ")
        found |= {
            (name.strip("`"), wire): cell
            for wire, cell in zip(WIRES_OF[driver], cells, strict=False)
        }
    return found


def write(lines: list[str], driver: str) -> None:
    """Put a table between its marks."""
    text, (begin, end) = PAGE.read_text(encoding="utf-8"), MARKS[driver]
    before, after = text[: text.index(begin)], text[text.index(end) :]
    PAGE.write_text(f"{before}{begin}\n\n" + "\n".join(lines) + f"\n\n{after}", encoding="utf-8")


def main() -> None:
    """Provoke all, check the deadlines, write the tables."""
    for driver, names in (("", tuple(CATALOGUE)), ("sr785", OWN)):
        with tempfile.TemporaryDirectory() as folder:
            faults = {name: ordered(name) for name in names}
            outcomes = provoke_all(Path(folder), faults, every_job(names, driver), driver)
        for (name, wire), outcome in outcomes.items():
            line = f"{name:22} {wire:13} {outcome.elapsed_s:5.1f} s  {outcome}  {outcome.said[:90]}"
            print(line)  # noqa: T201
            assert outcome.elapsed_s < DEADLINES_S.get(name, DEADLINE_S)
        write(rows(outcomes, driver), driver)


if __name__ == "__main__":
    main()
