"""A recorded session as a sequence in time: from a bench's history, or from a response file.

Owns the order and the moments of what was recorded. It draws nothing and
drives nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from daq.analyser import SweepPoint
from daq.errors import InputError
from daq.frf import FrequencyResponse, PointFlag
from daq.store_records import StoredPoint
from tui.text.shell_quote import pasted

if TYPE_CHECKING:
    from daq.formats import Reading
    from daq.plan import SweepPlan

__all__ = ["Entry", "Recording", "read_recording"]

_LONGEST_GAP_S = 5.0
"""Nothing happened for longer between two sessions of one measurement; it is not sat out."""
_CYCLES = 50
"""Drive cycles a point where a file does not say."""
_SQLITE = b"SQLite format 3\0"


@dataclass(frozen=True, slots=True)
class Entry:
    """Something that was recorded.

    Parameters
    ----------
    at_s
        Moment since the beginning, s, long gaps shortened.
    point
        The point that was stored, or None.
    text
        The line of the journal, empty for a point.
    """

    at_s: float
    point: StoredPoint | None = None
    text: str = ""


@dataclass(frozen=True, slots=True)
class Recording:
    """A session that was recorded; `plan` is None for a response file."""

    title: str
    simulated: bool
    levels_vpk: tuple[float, ...]
    span_hz: tuple[float, float]
    entries: tuple[Entry, ...]
    plan: SweepPlan | None = None

    @property
    def duration_s(self) -> float:
        """From the first entry to the last, s."""
        return self.entries[-1].at_s if self.entries else 0.0


def read_recording(
    path: Path, measurement: int | None = None, reading: Reading | None = None
) -> Recording:
    """Read a session from a history or a response file.

    Parameters
    ----------
    path
        History of a bench, or a response in any format that can be read.
    measurement
        Which one of a history; the latest with points if left out.
    reading
        What a response file does not say itself.

    Raises
    ------
    InputError
        If there is no such file or measurement, or it holds no point.
    """
    try:
        with path.open("rb") as file:
            start = file.read(len(_SQLITE))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    if start == _SQLITE:
        return _from_history(path, measurement)
    if measurement is not None:
        raise InputError(f"{path} is no history; leave --id out")
    if path.suffix == ".jsonl":
        raise InputError(
            f"{path} is a transcript; measure with it as the instrument: "
            f"--instrument {pasted([f'replay:{path}'])}"
        )
    from daq.formats import NOTHING_TOLD, read_response

    return _from_response(read_response(path, reading or NOTHING_TOLD), path)


def _from_history(path: Path, measurement: int | None) -> Recording:
    from daq.store import Store

    with Store(path, read_only=True) as store:
        if measurement is None:
            with_points = store.lines(last=1, with_points=True)
            if not with_points:
                raise InputError(f"{path}: no measurement in it has a point")
            measurement = with_points[0].id
        found = store.measurement(measurement)
        points = store.points(measurement, superseded=True)
        events = store.events(measurement)
    if not points:
        raise InputError(f"measurement {measurement} in {path} has no point")
    rows = [(_seconds(p.taken), 1, Entry(0.0, point=p)) for p in points]
    rows += [(_seconds(e.time), 0, Entry(0.0, text=f"{e.kind}: {e.text}")) for e in events]
    rows.sort(key=lambda row: row[:2])
    plan = found.header.plan
    serial = f" {found.header.serial}" if found.header.serial else ""
    started = found.started[:16].replace("T", " ")
    return Recording(
        title=f"measurement {measurement}, {found.header.unit}{serial}, {started} UTC",
        simulated=found.instrument is not None and found.instrument.simulated,
        levels_vpk=plan.levels_vpk,
        span_hz=(min(plan.frequencies_hz), max(plan.frequencies_hz)),
        entries=tuple(_without_gaps(rows)),
        plan=plan,
    )


def _without_gaps(rows: list[tuple[float, int, Entry]]) -> Iterator[Entry]:
    at_s, before_s = 0.0, rows[0][0]
    for moment_s, _, entry in rows:
        at_s += min(max(0.0, moment_s - before_s), _LONGEST_GAP_S)
        before_s = moment_s
        yield Entry(at_s, entry.point, entry.text)


def _from_response(response: FrequencyResponse, path: Path) -> Recording:
    """The rows in their order, each as long as its cycles take."""
    if not len(response):
        raise InputError(f"{path} holds no point")
    settle, integrate = response.settle_cycles, response.integrate_cycles
    cycles = _CYCLES if settle is None or integrate is None else settle + integrate
    entries, at_s = [], 0.0
    for row in range(len(response)):
        hertz = float(response.frequency_hz[row])
        at_s += cycles / hertz
        point = SweepPoint(
            hertz,
            complex(response.gain[row]),
            _known(response.gain_std_db[row]),
            _known(response.phase_std_deg[row]),
            PointFlag(int(response.flags[row])),
        )
        entries.append(
            Entry(at_s, StoredPoint(row, float(response.source_vpk[row]), hertz, point, ""))
        )
    grid = response.frequency_hz
    return Recording(
        title=f"{path.name}, {response.unit}",
        simulated=response.provenance.get("kind") == "simulated",
        levels_vpk=tuple(response.levels_vpk.tolist()),
        span_hz=(float(grid.min()), float(grid.max())),
        entries=tuple(entries),
    )


def _known(value: float) -> float | None:
    return float(value) if value == value else None


def _seconds(moment: str) -> float:
    return datetime.fromisoformat(moment).timestamp()
