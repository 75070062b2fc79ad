"""One unit of a line: its session, its judgement and its result.

Owns the mark by which a measurement is one of a line's, and which measurement still lacks its
result. The session drives and ends with the source off; the limits decide.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from daq.errors import LashbenchError
from daq.servers.place import HistoryPlace, is_there, whole_name
from tui.line.results import Result, Results, Word
from tui.measure_options import PlanOptions, session_request
from tui.measurements.running import run_session
from tui.session_words import contract_state, exit_code, tell_event
from tui.text.output import Console

if TYPE_CHECKING:
    from analysis.acceptance import LimitSet
    from daq.control import SessionControl
    from daq.session_events import Finished, SessionEvent
    from daq.session_request import SessionRequest
    from daq.store import Store
    from daq.store_records import Measurement
    from sim.unit import Unit

__all__ = ["Line", "Pending"]

_MARK = "line"
_LOOKED_AT = 20
"""Newest measurements of a history among which one without a result is looked for."""


@dataclass(frozen=True, slots=True)
class Pending:
    """A measurement of a line that has no result yet."""

    measurement: int
    serial: str
    attempt: int
    points: int
    planned: int
    complete: bool
    newest: bool
    """Whether nothing was measured after it, so that its unit may still be on the bench."""


class Watcher(Protocol):
    """Who follows the sessions of a line on a screen."""

    def control(self) -> SessionControl:
        """What the session that begins now is ended by."""
        ...

    def take(self, event: SessionEvent) -> None:
        """A session told something."""
        ...


@dataclass(frozen=True, slots=True)
class Line:
    """What every unit of a line has in common.

    Parameters
    ----------
    unit_name, unit
        Name or path of the unit's file, and the unit.
    instrument, recipe, bench, adaptive, operator
        As for ``measure``.
    db
        The history.
    limits
        What is judged by; None to measure only.
    diagnose
        Diagnose where a limit asks for it.
    out
        The file of results. It is kept with each measurement: what another file's line measured
        is that line's.
    watcher
        Follows the sessions in place of the console, and can end them.
    """

    unit_name: str
    unit: Unit
    instrument: str
    recipe: str
    bench: str
    adaptive: bool
    operator: str
    db: HistoryPlace
    limits: LimitSet | None
    diagnose: bool
    out: Path
    console: Console
    watcher: Watcher | None = None

    def request(self, serial: str, attempt: int, resume: int | None = None) -> SessionRequest:
        """What a session is asked to do for a unit.

        Raises
        ------
        InputError, LimitError
            As `session_request`.
        """
        remarks = {"serial": serial, "operator": self.operator, "notes": ""}
        request = session_request(
            PlanOptions(adaptive=self.adaptive and resume is None), self.unit_name, self.unit,
            self.instrument, self.db,
            recipe=self.recipe, bench=self.bench, resume=resume, remeasure=None, run_in=None,
            remarks=remarks if resume is None else dict.fromkeys(remarks, ""),
        )  # fmt: skip
        if request.header is None:
            return request
        mark = json.dumps({"attempt": attempt, "results": str(self.out.resolve())})
        configurations = {**request.header.configurations, _MARK: mark}
        return replace(request, header=replace(request.header, configurations=configurations))

    def pending(self, results: Results) -> Pending | None:
        """The newest measurement of the line with these results, if it has none there."""
        from daq.store import Store

        if not is_there(self.db):
            return None
        with Store(self.db, read_only=True) as store:
            lines = list(store.lines(last=_LOOKED_AT))
            for line in reversed(lines):
                found = store.measurement(line.id)
                if _MARK not in found.header.configurations:
                    continue
                mark = _mark(found)
                if mark.get("results", str(self.out.resolve())) != str(self.out.resolve()):
                    continue
                judged = results.of_measurement(self.db, line.id) is not None
                # Marks of earlier versions name no file; a note says that there is a result.
                judged |= "results" not in mark and _is_noted(store, line.id, _MARK)
                if judged or found.state == "aborted" or found.header.unit != self.unit.name:
                    return None
                return _pending(found, mark, line.id == lines[-1].id)
        return None

    def measure(self, serial: str, attempt: int, resume: int | None = None) -> Result | None:
        """Measure a unit, or go on with it, and judge it; None if it was ended on request.

        Raises
        ------
        LashbenchError
            If the instrument failed, or the source is not proven off. The measurement stays
            pending.
        """
        began_s = time.monotonic()
        finished, why = self._session(self.request(serial, attempt, resume))
        if why:
            return self._result(finished.measurement, serial, attempt, began_s, why)
        if exit_code(finished) != 0:
            return None
        return self._result(finished.measurement, serial, attempt, began_s)

    def judge(self, pending: Pending) -> Result:
        """The result of a measurement that is complete already."""
        return self._result(pending.measurement, pending.serial, pending.attempt, time.monotonic())

    def _session(self, request: SessionRequest) -> tuple[Finished, str]:
        """Run a session; how it ended, and what is wrong with the unit if that ended it."""
        from daq.session_events import CheckLine

        why = ""

        def tell(event: SessionEvent, console: Console) -> None:
            nonlocal why
            if isinstance(event, CheckLine) and event.name == "trial point":
                why = event.text if event.verdict == "fail" else ""
            if self.watcher is None:
                tell_event(event, console)
            else:
                self.watcher.take(event)

        control = None if self.watcher is None else self.watcher.control()
        finished, fault = run_session(
            self.instrument, self.unit, self.db, request, self.console, tell, control=control
        )
        if fault is not None and (not why or contract_state(finished) != "confirmed-off"):
            raise fault
        return finished, why

    def _result(
        self, measurement: int, serial: str, attempt: int, began_s: float, why: str = ""
    ) -> Result:
        from daq.store import Store
        from tui.measurements.judging import judge_measurement

        judgement, reasons = None, [f"not measured: {why}"] if why else []
        if self.limits is not None and not why:
            try:
                judgement = judge_measurement(
                    self.db, measurement, self.limits, diagnose=self.diagnose,
                    progress=self.console.progress,
                )  # fmt: skip
            except LashbenchError as error:
                reasons.append(f"not judged: {error}")
        with Store(self.db, read_only=True) as store:
            measured = store.measurement(measurement)
        word: Word = "UNDECIDED" if self.limits is not None or why else "MEASURED"
        if judgement is not None:
            reasons += [item.line for item in judgement.items if item.verdict != "PASS"]
        return Result(
            serial=serial,
            attempt=attempt,
            verdict=judgement.verdict if judgement is not None else word,
            unit=self.unit.name,
            measurement=measurement,
            history=whole_name(self.db),
            started=measured.started,
            ended=measured.ended,
            operator=measured.header.operator,
            failed=[] if judgement is None else judgement.failed,
            undecided=[] if judgement is None else judgement.open,
            reasons=reasons,
            limits=None if self.limits is None else self.limits.name,
            elapsed_s=round(time.monotonic() - began_s, 3),
            judgement=None if judgement is None else judgement.to_json(),
        )

    def note(self, measurement: int, kind: str, text: str) -> None:
        """Add to the journal of a measurement; a history that takes nothing costs no result."""
        from daq.store import Store

        with suppress(LashbenchError), Store(self.db) as store:
            store.note(measurement, kind, text)

    def noted(self, measurement: int, kind: str) -> bool:
        """Whether its journal has a line of a kind."""
        from daq.store import Store

        with Store(self.db, read_only=True) as store:
            return _is_noted(store, measurement, kind)


def _is_noted(store: Store, measurement: int, kind: str) -> bool:
    return any(event.kind == kind for event in store.events(measurement))


def _mark(found: Measurement) -> Mapping[str, Any]:
    """What a line said of its measurement; empty where it cannot be read."""
    try:
        mark = json.loads(found.header.configurations[_MARK])
    except (ValueError, RecursionError):
        return {}
    return mark if isinstance(mark, dict) else {}


def _pending(found: Measurement, mark: Mapping[str, Any], newest: bool) -> Pending:
    attempt = 1
    with suppress(ValueError, TypeError, KeyError, OverflowError):
        attempt = max(1, int(mark["attempt"]))
    return Pending(
        found.id, found.header.serial, attempt, found.points, found.header.plan.points,
        found.state == "complete", newest,
    )  # fmt: skip
