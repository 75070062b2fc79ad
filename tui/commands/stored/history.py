"""``lashbench history``: the measurements of a bench, and how a unit's backlash changes.

Owns the options of the verb, and what is read for it. Estimates that the history lacks
are made by the analysis and kept, so that the next look is quick. What is not
shown is not read.
"""

from __future__ import annotations

import json as json_text
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict, replace
from datetime import UTC, datetime
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from daq.errors import AnalysisError, ConfigurationError, InputError, LashbenchError
from daq.servers.place import HistoryPlace
from tui.executors import executor_at
from tui.judging import limits_to_judge_by
from tui.measurements.history_rows import Trends, measurement_row, trend_lines
from tui.measurements.history_tables import (
    corrected_lines,
    estimated_lines,
    judged_lines,
    measured_table,
)
from tui.measurements.measured_unit import unit_as_measured
from tui.options import Cluster, HistoryOption, Json, JudgeBy, Whole
from tui.places import cache_folder, history_path
from tui.text.layout import wrapped
from tui.text.output import Console, Injected, as_json, readers_may_leave

if TYPE_CHECKING:
    from analysis.acceptance import LimitSet, Verdict
    from analysis.execution.executor import Executor
    from daq.store import Store
    from daq.store_records import Answer, HistoryLine

__all__ = ["history"]

_BUDGET_S = 45.0
"""Time after which `--estimate some` begins no further estimate."""
_SHOWN = 200
"""Measurements that are listed for people unless they ask for more."""
_PROGRESS_EVERY = 1000


def history(
    *,
    db: HistoryOption = None,
    unit: Annotated[str | None, Parameter(name="--unit")] = None,
    serial: str | None = None,
    last: Whole | None = None,
    since: str | None = None,
    state: Literal["complete", "interrupted", "aborted"] | None = None,
    search: str | None = None,
    estimate: Literal["none", "some", "all"] = "some",
    cluster: Cluster = None,
    judge: JudgeBy = None,
    json: Json = False,
    console: Injected,
) -> int:
    """List the measurements of a bench, oldest first, with the trend of r, b1 and b2.

    Complete measurements that were not estimated since their last point are
    estimated now, which takes a while, and the result is kept in the history.
    The numbers are those of the model that is accepted: a diagnosis decides where
    there is one, and where the plain model does not fit and none was made, there is none.

    Parameters
    ----------
    db
        The bench's history, a file or postgresql://USER@HOST/DATABASE; yours, if left out.
    unit
        Only measurements of this unit: adss, edss, the path of a unit file, or a name.
    serial
        Only measurements of the specimen with this serial number.
    last
        How many measurements to list, the newest; 200 if left out, and all with --json.
        Trends are of all measurements of whatever is listed.
    since
        Only measurements that were started on this day or later, such as 2026-11-01 (UTC).
    state
        Only measurements that are complete, interrupted or aborted.
    search
        Only measurements with each of these words in unit, serial number, operator, notes, state,
        day or number.
    estimate
        Which missing estimates to make of those that are listed: none, all, those that failed
        or are of an earlier edition once more among them, or some, that is to begin no more of
        them after 45 s.
    """
    from analysis.edition import EDITION
    from daq.store import Store

    if last is not None and last < 1:
        raise InputError(f"--last {last}: give 1 or more")
    which: dict[str, Any] = {"since": _moment(since), "state": state, "search": search}
    limits = limits_to_judge_by(judge)
    db = history_path(db)
    shown = last if last is not None or json else _SHOWN
    with Store(db, read_only=True) as store:
        name = _unit_name(unit, store)
        edition = EDITION if estimate == "all" else None
        lacking = store.lacking(name, serial, last=shown, edition=edition, **which)
    loose: dict[int, Answer] = {}
    if estimate != "none" and lacking:
        with executor_at(cluster, console.compute) as executor:
            loose = _estimates(db, lacking, estimate == "all", executor, console)
    with Store(db, read_only=True) as store:
        making = _Rows(store, loose, limits)
        if json:
            # The exit code counts, whether or not all was read.
            with readers_may_leave() if limits else nullcontext():
                _write_json(store, name, serial, shown, which, making, console)
            return making.exit_code
        rows = [making.row(line) for line in store.lines(name, serial, last=shown, **which)]
        if not rows:
            console.data(
                "no such measurements"
                if store.count()
                else "no measurements; lashbench measure --help says how to make one"
            )
            return making.exit_code
        whole = store.count(name, serial, **which)
        if whole <= len(rows):
            trends = Trends(rows, limits)
        else:
            trends = _whole_trends(store, rows, which, limits, console)
        lines = [*measured_table(rows), *judged_lines(rows), *corrected_lines(store, rows)]
        lines += estimated_lines(rows)
        for line in trend_lines(trends.rows()):
            lines += wrapped(line, indent="  ")
    if whole > len(rows):
        console.note(f"the last {len(rows)} of {whole} measurements; --last N lists more")
    with readers_may_leave() if limits else nullcontext():
        console.data("\n".join(lines))
    return making.exit_code


def _unit_name(unit: str | None, store: Store) -> str | None:
    """The name that units of the history bear."""
    if unit is None:
        return None
    from sim.unit import load_unit

    stored = sorted({name.lower() for name in store.unit_names()})
    if unit.lower() in stored:
        return unit
    try:
        return load_unit(unit).name
    except ConfigurationError as error:
        names = ", ".join(stored) or "none"
        raise InputError(f"{error}; units in this history: {names}") from error


def _moment(since: str | None) -> str | None:
    """A day, or a moment, as the history keeps moments: ISO 8601, UTC."""
    if since is None:
        return None
    try:
        found = datetime.fromisoformat(since)
        found = found.replace(tzinfo=UTC) if found.tzinfo is None else found.astimezone(UTC)
    except (ValueError, OverflowError):
        raise InputError(f"--since {since}: give a day such as 2026-11-01") from None
    return found.isoformat(timespec="microseconds")


class _Rows:
    """Rows, with the estimates that could not be kept, and judged where there are limits."""

    def __init__(self, store: Store, loose: Mapping[int, Answer], limits: LimitSet | None) -> None:
        self._store = store
        self._loose = loose
        self.limits = limits
        self._verdicts: list[Verdict] = []

    def row(self, line: HistoryLine) -> dict[str, Any]:
        """A measurement as a row."""
        line = replace(line, estimate=self._loose.get(line.id, line.estimate))
        row = measurement_row(line)
        if self.limits is not None:
            from tui.measurements.judging import judge_line

            judgement = judge_line(self._store, line, self.limits)
            self._verdicts.append(judgement.verdict)
            row["judgement"] = judgement.to_json()
        return row

    @property
    def exit_code(self) -> int:
        """0, or what the worst judgement means: 6 for FAIL, 7 for UNDECIDED."""
        if self.limits is None:
            return 0
        from analysis.acceptance import EXIT_CODES, combine

        return EXIT_CODES[combine(self._verdicts)]


def _write_json(
    store: Store,
    unit: str | None,
    serial: str | None,
    last: int | None,
    which: Mapping[str, Any],
    making: _Rows,
    console: Console,
) -> None:
    """The document, put together on the disk: a history may be longer than the memory."""
    trends, count, whole = Trends((), making.limits), 0, store.count(unit, serial, **which)
    with TemporaryFile("w+", encoding="utf-8") as out:
        out.write('{"measurements": [')
        for line in store.each_line(unit, serial, last=last, **which):
            row = making.row(line)
            trends.add(row)
            if row["corrections"]:
                row["corrections"] = [asdict(one) for one in store.corrections(line.id)]
            else:
                row["corrections"] = []
            out.write(",\n" if count else "\n")
            out.write(as_json(row, indent=None))
            count += 1
            if count % _PROGRESS_EVERY == 0:
                console.progress(min(1.0, count / whole), "reading the history")
        out.write(f'],\n"trends": {json_text.dumps(trends.rows(), allow_nan=False)}}}')
        out.seek(0)
        console.data_from(out)


def _whole_trends(
    store: Store,
    rows: Sequence[Mapping[str, Any]],
    which: Mapping[str, Any],
    limits: LimitSet | None,
    console: Console,
) -> Trends:
    """Trends of what is listed, over all measurements of each unit and serial number."""
    trends = Trends((), limits)
    groups = dict.fromkeys((row["unit"], row["serial"]) for row in rows)
    for count, (unit, serial) in enumerate(groups):
        console.progress(count / len(groups), "reading the history")
        for line in store.each_line(unit, serial, exact=True, answered=True, **which):
            if line.estimate is not None or line.diagnosis is not None:
                trends.add(measurement_row(line))
    return trends


def _estimates(
    db: HistoryPlace,
    lacking: Sequence[int],
    every: bool,
    executor: Executor | None,
    console: Console,
) -> dict[int, Answer]:
    """Make estimates and keep them; those that cannot be kept, by measurement."""
    began_s, loose = time.monotonic(), {}
    for done, number in enumerate(lacking):
        if not every and done and time.monotonic() - began_s > _BUDGET_S:
            console.note(
                f"{len(lacking) - done} complete measurements are not estimated yet; run this "
                "again, or with --estimate all"
            )
            break
        console.note(f"estimating measurement {number}")
        answer = _estimate(db, number, executor, console)
        if answer is not None:
            loose[number] = answer
    return loose


def _estimate(
    db: HistoryPlace, number: int, executor: Executor | None, console: Console
) -> Answer | None:
    """Make an estimate and keep it; it is given back where it cannot be kept."""
    from analysis.observation.input_check import check_inputs
    from daq.store import Store
    from tui.measurements.stored_answers import keep_estimate, loose_answer

    began_s = time.monotonic()
    with Store(db, read_only=True) as store:
        measured = store.measurement(number)
        response = store.response(number)
    try:
        unit = unit_as_measured(measured)
        check_inputs([response], unit, way_on="")
        result = console.compute.estimate_response(
            response, unit, progress=console.progress, cache=cache_folder(), executor=executor
        )
        content: dict[str, Any] = result.to_json()
    except (AnalysisError, InputError, ValueError) as error:
        # A lost cluster is not among them: it says nothing of the data, and ends the verb.
        console.note(f"measurement {number} gives no estimate: {error}")
        content = {"failed": str(error)}
    try:
        keep_estimate(db, measured, content, elapsed_s=time.monotonic() - began_s)
    except LashbenchError as error:
        console.note(f"the estimate is shown but not kept: {error}")
        return loose_answer(content)
    return None
