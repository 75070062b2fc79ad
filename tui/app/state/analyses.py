"""The analyses that the screens ask for, run beside them on a worker of their own.

Owns which analysis is called with what, and that it can be given up. It
computes nothing itself and draws nothing.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from textual.message import Message

from daq.errors import LashbenchError
from daq.servers.place import HistoryPlace
from tui.app.messages import AnalysisDone, AnalysisFailed, AnalysisProgressed, Job
from tui.app.state.plan_search import Planner, find_plan

if TYPE_CHECKING:
    from analysis.estimate.datasheet_band import DatasheetBand
    from daq.frf import FrequencyResponse
    from daq.store_records import Measurement
    from sim.unit import Unit

__all__ = ["Analyses", "Task", "diagnose", "draw_band", "read_result", "write_report"]

Post = Callable[[Message], object]
Progress = Callable[[float, str], None]
_LOG = logging.getLogger("lashbench.analysis")


def _estimate(response: FrequencyResponse, unit: Unit, progress: Progress) -> Mapping[str, Any]:
    from analysis.estimate import estimate_response
    from tui.places import cache_folder

    return estimate_response(response, unit, cache=cache_folder(), progress=progress).to_json()


def _total(response: FrequencyResponse, unit: Unit, progress: Progress) -> Mapping[str, Any]:
    from analysis.estimate import estimate_response
    from tui.places import cache_folder

    return estimate_response(
        response, unit, unit.stages > 1, cache=cache_folder(), progress=progress
    ).to_json()


def _diagnose(responses: Sequence[FrequencyResponse], unit: Unit, progress: Progress) -> Any:
    from analysis.diagnosis import diagnose_response
    from tui.places import cache_folder

    response, *further = responses
    return diagnose_response(
        response, unit, further=further, cache=cache_folder(), progress=progress
    )


def _band(
    response: FrequencyResponse, unit: Unit, estimate: Any, progress: Progress
) -> DatasheetBand:
    from analysis.estimate.datasheet_band import datasheet_band, known_of_estimate

    words = "simulating units of the datasheet"
    known = known_of_estimate(estimate)
    return datasheet_band(response, unit, known, progress=lambda part: progress(part, words))


def _report(task: Task, diagnosis: Any, path: Path) -> None:
    from tui.measurements.reports import report_measurement

    remarks = {} if diagnosis is not None else {"diagnosis": "No diagnosis was asked for."}
    report_measurement(
        path, task.db, task.measurement, task.unit, diagnosis=diagnosis, remarks=remarks
    )


@dataclass(frozen=True, slots=True)
class Analyses:
    """What is called; tests put something quicker in its place.

    Parameters
    ----------
    estimate
        Gives the document of ``estimate --json``.
    diagnose
        Gives something with ``to_json()`` and ``summary()``, of a response and those it follows.
    band
        Gives what units of the datasheet read in the sweep of a response, by what its estimate
        knows, which may be None.
    total
        As `estimate`, with the total backlash unknown.
    planner
        Gives the sweep that tells most of a unit in so many minutes.
    report
        Writes a file about a task's measurement, with its diagnosis or None.
    """

    estimate: Callable[[FrequencyResponse, Unit, Progress], Mapping[str, Any]] = _estimate
    diagnose: Callable[[Sequence[FrequencyResponse], Unit, Progress], Any] = _diagnose
    report: Callable[[Task, Any, Path], None] = _report
    band: Callable[[FrequencyResponse, Unit, Any, Progress], DatasheetBand] = _band
    total: Callable[[FrequencyResponse, Unit, Progress], Mapping[str, Any]] = _total
    planner: Planner = find_plan


class _GivenUp(Exception):
    """Ends an analysis that nobody waits for any more."""


@dataclass(frozen=True, slots=True)
class Task:
    """An analysis of one measurement.

    Parameters
    ----------
    post
        Where its messages go.
    db, measurement, unit
        What it is about.
    given_up
        Set when nobody waits for it any more.
    as_is
        Whether a response is taken as it stands, also if it looks like a mistake.
    """

    post: Post
    db: HistoryPlace
    measurement: int
    unit: Unit
    given_up: threading.Event
    as_is: bool = False

    def doubts(self, responses: Sequence[FrequencyResponse]) -> list[str]:
        """What there is to be said of responses; raises an error where they are refused."""
        from analysis.observation.input_check import check_inputs

        return check_inputs(responses, self.unit, self.as_is, "; or key A: take it as it stands")

    def response(self) -> FrequencyResponse:
        """The measurement's points in force."""
        from daq.store import Store

        with Store(self.db, read_only=True) as store:
            return store.response(self.measurement)

    def responses(self) -> list[FrequencyResponse]:
        """The measurement's, and those that it follows."""
        from daq.store import Store
        from tui.measurements.follow_up import responses_together

        with Store(self.db, read_only=True) as store:
            return responses_together(store, self.measurement)

    def progress(self, job: Job) -> Progress:
        """Tells how far a job is, and ends it where nobody waits."""

        def tell(fraction: float, text: str = "") -> None:
            if self.given_up.is_set():
                raise _GivenUp
            self.post(AnalysisProgressed(job, fraction, text))

        return tell

    def run(self, job: Job, work: Callable[[], Any]) -> None:
        """Do a job and tell what came of it."""
        try:
            result = work()
        except _GivenUp:
            return
        except Exception as error:
            if not isinstance(error, LashbenchError):
                _LOG.error("%s of measurement %d", job, self.measurement, exc_info=error)
            self.post(AnalysisFailed(job, self.measurement, error))
            return
        self.post(AnalysisDone(job, self.measurement, result))


def read_result(task: Task, analyses: Analyses) -> None:
    """Features first, since they are quick; then the estimate, from the history if it is there."""
    from analysis.observation.input_check import doubted
    from daq.store import Store
    from tui.measurements.stored_answers import kept_diagnosis, kept_estimate

    def features() -> tuple[FrequencyResponse, Any]:
        from analysis.resonance import extract

        response = task.response()
        return response, extract(response)

    def estimate() -> Mapping[str, Any]:
        with Store(task.db, read_only=True) as store:
            known = kept_estimate(store, task.measurement, task.unit)
            measured = store.measurement(task.measurement)
        if known is not None:
            return known
        began_s = time.monotonic()
        response = task.response()
        said = task.doubts([response])
        made = doubted(analyses.estimate(response, task.unit, task.progress("result")), said)
        _keep_estimate(task, measured, made, time.monotonic() - began_s)
        return made

    def diagnosis() -> Any:
        with Store(task.db, read_only=True) as store:
            return kept_diagnosis(store, task.measurement, task.unit)

    task.run("result", features)
    task.run("stored diagnosis", diagnosis)
    task.run("result", estimate)


def diagnose(task: Task, analyses: Analyses) -> None:
    """What the model lacks, and why; it is kept in the history."""

    def work() -> Any:
        responses = task.responses()
        said = task.doubts(responses)
        made = analyses.diagnose(responses, task.unit, task.progress("diagnosis"))
        if said:
            made = replace(made, warnings=(*said, *made.warnings))
        if not said:
            # The history would show its numbers as those of the unit.
            _keep_diagnosis(task, responses, made.to_json())
        return made

    task.run("diagnosis", work)


def draw_band(task: Task, analyses: Analyses, estimate: Any) -> None:
    """What units of the datasheet would have read; the estimate that it is by goes with it."""

    def work() -> tuple[DatasheetBand, Any]:
        made = analyses.band(task.response(), task.unit, estimate, task.progress("band"))
        return made, estimate

    task.run("band", work)


def write_report(task: Task, analyses: Analyses, diagnosis: Any, path: Path) -> None:
    """The report as a file."""

    def work() -> Path:
        analyses.report(task, diagnosis, path)
        return path

    task.run("report", work)


def _keep_diagnosis(
    task: Task, responses: Sequence[FrequencyResponse], document: Mapping[str, Any]
) -> None:
    from tui.measurements.stored_answers import keep_diagnosis

    try:
        keep_diagnosis(task.db, task.measurement, responses, task.unit, document)
    except LashbenchError as error:
        # It is shown all the same, until the screen is left.
        _LOG.warning("a diagnosis was not kept: %s", error)


def _keep_estimate(
    task: Task, measured: Measurement, document: Mapping[str, Any], elapsed_s: float
) -> None:
    from tui.measurements.stored_answers import keep_estimate

    try:
        keep_estimate(task.db, measured, document, unit=task.unit, elapsed_s=elapsed_s)
    except LashbenchError as error:
        # It is shown all the same; the next look makes it once more.
        _LOG.warning("an estimate was not kept: %s", error)
