"""Beginning and giving up analyses for the application, and where their results go.

Owns how far each analysis is and whom its result concerns. It draws nothing;
what people must know it hands to the application.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from daq.errors import LashbenchError
from tui.app.state.analyses import Analyses, Task, diagnose, draw_band, read_result, write_report
from tui.app.state.desk import Results
from tui.app.state.host import Host
from tui.app.state.judgement import Asked, Judged, judge_result
from tui.app.state.plan_search import PlanSearch

if TYPE_CHECKING:
    from tui.app import messages

__all__ = ["AnalysisKeeper"]


class AnalysisKeeper:
    """The analyses of one application.

    Parameters
    ----------
    app
        Whose workers run them and whose desk takes the results.
    analyses
        What is called.
    """

    def __init__(self, app: Host, analyses: Analyses) -> None:
        self._app = app
        self._analyses = analyses
        self._given_up: dict[str, threading.Event] = {}
        self._judged: Judged | None = None
        self.search = PlanSearch(analyses.planner)
        self.progress: dict[str, tuple[float, str]] = {}
        """How far each is and what it does, by job; none that is over."""

    def begin(self, job: messages.Job, path: Path | None = None) -> None:
        """Begin an analysis of the measurement in view, unless it runs already."""
        desk = self._app.desk
        if job in self.progress or desk.measurement is None or desk.unit is None:
            return
        post = self._app.post_message
        given_up = self._given_up[job] = threading.Event()
        task = Task(post, desk.db, desk.measurement, desk.unit, given_up, desk.results.as_is)
        works: dict[str, Callable[[], None]] = {
            "result": partial(read_result, task, self._analyses),
            "diagnosis": partial(diagnose, task, self._analyses),
            "band": partial(draw_band, task, self._analyses, desk.results.estimate),
            "judgement": partial(judge_result, task, self._analyses, Asked.of(desk)),
            "report": partial(
                write_report, task, self._analyses,
                desk.results.diagnosis, path or Path("report.html"),
            ),
        }  # fmt: skip
        desk.results.faults.pop(job, None)
        self.progress[job] = (0.0, "")
        self._app.run_worker(works[job], thread=True, group=job, name=job, exit_on_error=False)

    def view(self, measurement: int | None) -> None:
        """Make a measurement the one that results are about; work on another is given up."""
        self.give_up()
        self.progress.clear()
        self._app.desk.measurement, self._app.desk.results = measurement, Results()

    def judge(self) -> None:
        """Judge by what is known so far; again where more is known, or other limits are chosen."""
        results = self._app.desk.results
        if results.response is None:
            return
        if self._judged is None or not self._judged.asked.holds(self._app.desk):
            results.judgement = None
        self.begin("judgement")

    def give_up(self) -> None:
        """End what runs, at its next word."""
        for one in self._given_up.values():
            one.set()

    def stop(self, job: messages.Job) -> None:
        """End one analysis, at its next word; nothing comes of it."""
        if self.progress.pop(job, None) is not None:
            self._given_up[job].set()

    # ------------------------------------------------------------ told by the workers

    def progressed(self, message: messages.AnalysisProgressed) -> None:
        """Remember how far it is."""
        if message.job in self.progress:
            self.progress[message.job] = (message.fraction, message.text)

    def done(self, message: messages.AnalysisDone) -> None:
        """Put the result on the desk, if it is about the measurement in view."""
        desk = self._app.desk
        if message.measurement != desk.measurement:
            return
        if message.job == "result" and isinstance(message.result, tuple):
            # The first part of two: features come before the estimate.
            desk.results.response, desk.results.features = message.result
            self.judge()
            return
        if message.job == "stored diagnosis":
            # One that is made meanwhile, or was made, goes before it.
            if desk.results.diagnosis is None and "diagnosis" not in self.progress:
                desk.results.diagnosis = message.result
                self.judge()
            return
        if message.job == "judgement" and not message.result.is_whole:
            if message.result.asked.holds(desk):
                desk.results.judgement = message.result.judgement
            return
        self.progress.pop(message.job, None)
        if message.job == "result":
            desk.results.estimate = message.result
            self.judge()
            if desk.results.band is not None:
                self.begin("band")  # anew, by what the estimate knows
        elif message.job == "band":
            desk.results.band, by = message.result
            if by is not desk.results.estimate:
                self.begin("band")
        elif message.job == "judgement":
            judged = message.result
            self._judged, desk.results.total = judged, judged.total
            if judged.asked.holds(desk):
                desk.results.judgement = judged.judgement
            else:
                self.judge()
        elif message.job == "diagnosis":
            desk.results.diagnosis = message.result
            self.judge()
            self._app.notify("diagnosis done: step 6")
        elif message.job == "report":
            desk.results.report = message.result
            self._app.notify(f"report written: {message.result}", timeout=10)

    def failed(self, message: messages.AnalysisFailed) -> None:
        """Say why, and leave the rest as it is."""
        if message.measurement != self._app.desk.measurement:
            return
        self.progress.pop(message.job, None)
        error = message.error
        text = str(error)
        if not isinstance(error, LashbenchError):
            text = f"internal fault ({type(error).__name__}). {self._app.log_words}"
        self._app.desk.results.faults[message.job] = text
        self._app.notify(f"{message.job}: {text}", severity="error", timeout=10)
