"""Step 6: what the model lacks, which cause is likeliest, and what to measure next.

Owns the wording of a diagnosis' document. The diagnosis itself runs beside the
screen and nothing of it is made here.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.content import Content
from textual.widgets import ProgressBar

from analysis.execution.pace import Pace, duration
from daq.errors import LashbenchError
from daq.untrusted.visible_text import visible
from tui.app.diagnosis_words import diagnosis_lines
from tui.app.dialogs.dialogs import HelpDialog
from tui.app.judged_words import headline, item_lines, progress_lines
from tui.app.plot.chart import Chart
from tui.app.plot.predictions import ratio_drawing, residual_drawing
from tui.app.screens.result_screen import answer_lines
from tui.app.state.desk import plan_of_document
from tui.app.state.sessions import one_session
from tui.app.step_screen import StepScreen
from tui.app.widgets.plain import Words
from tui.app.words import clock_in, plan_words

__all__ = ["DiagnosisScreen"]


_ROOM_FOR_THREE = 30
"""Lines from which on three plots stand below each other."""


class DiagnosisScreen(StepScreen):
    """Residual before and after, causes, rivals, the next measurement."""

    STEP = 6
    HELP = """
D compares the measurement with the model and asks which physical cause explains what is left,
which takes a minute or two of both processors; the screen stays free meanwhile.

Every cause is given with its probability and its size beside the datasheet. The residual is the
distance of measurement and model on source levels that were held out, in standard errors and dB,
before and after the cause was added. The grid shows where the measurement departs from the plain
model: ! from 2, !! from 5 standard deviations on. V changes between words and plots, which stand
side by side where there is room: what each model leaves over frequency, and the contribution
ratio before and after.

N starts the measurement that would tell rivals apart: checks first, as always, then the
sweep itself. D then diagnoses both measurements together. A response that looks like a mistake
is not diagnosed; A takes it as it stands.

J chooses limits: each is decided by the model that is accepted, causes that are not tolerated, too.

H tells what a simulated bench hid, where the measurement is of one that hides something.
"""
    BINDINGS = [
        Binding("d", "diagnose", "Diagnose", id="diagnosis.run"),
        Binding("a", "as_is", "As it is", id="diagnosis.as-is", show=False),
        Binding("n", "measure_next", "Measure this next", id="diagnosis.next"),
        Binding("v", "view", "Words/plots", id="diagnosis.view"),
        Binding("h", "reveal", "What was hidden", id="diagnosis.reveal", show=False),
    ]

    DEFAULT_CSS = """
    DiagnosisScreen #running { height: 1; }
    DiagnosisScreen #share { width: 40; }
    DiagnosisScreen #left { width: 1fr; text-wrap: nowrap; text-overflow: ellipsis; }
    DiagnosisScreen #halves { height: 1fr; }
    DiagnosisScreen #scroll { width: 1fr; }
    DiagnosisScreen #plots { width: 1fr; display: none; }
    DiagnosisScreen.-plots #plots { display: block; }
    DiagnosisScreen.-plots #scroll { display: none; }
    DiagnosisScreen.-side #plots, DiagnosisScreen.-side #scroll { display: block; }
    """

    def __init__(self) -> None:
        super().__init__()
        self._pace = Pace()

    def body(self) -> ComposeResult:
        """Progress, words, and two plots beside them or in their place."""
        with Horizontal(id="running"):
            yield ProgressBar(total=100, show_eta=False, show_percentage=True, id="share")
            yield Words("", id="left")
        with Horizontal(id="halves"):
            with VerticalScroll(classes="pane", id="scroll"):
                yield Words("", id="text")
            with Vertical(id="plots"):
                yield Chart("residual")
                yield Chart("residual-after")
                yield Chart("ratios")

    def on_mount(self) -> None:
        """The words have the focus, to be scrolled."""
        super().on_mount()
        self.query_one("#scroll").focus()

    def arrive(self) -> None:
        """Judge: limits may be others by now."""
        self.bench.analyses.judge()

    def on_resize(self) -> None:
        """Plots are drawn for a size."""
        self.call_after_refresh(self.show)

    def show_body(self) -> None:
        """Progress or verdict."""
        running = self.bench.analyses.progress.get("diagnosis")
        self.query_one("#running").display = running is not None
        if running is not None:
            share, text = running
            self.query_one("#share", ProgressBar).update(progress=100 * share)
            left_s = self._pace.remaining_s(share)
            left = "" if left_s is None else f"{duration(left_s)} left, done {clock_in(left_s)}; "
            self.query_one("#left", Words).update(f" {left}{text}")
        self.query_one("#text", Words).update(Content("\n").join(self._lines()))
        self._draw()

    def _draw(self) -> None:
        """The plots, as far as the document holds what they show."""
        diagnosis = None if self._is_running else self.desk.results.diagnosis
        document = None if diagnosis is None else diagnosis.to_json()
        for name, drawing in (
            ("#residual", partial(residual_drawing, which="baseline")),
            ("#residual-after", partial(residual_drawing, which="extended")),
            ("#ratios", ratio_drawing),
        ):
            chart = self.query_one(name, Chart)
            drawn = None if document is None else drawing(chart, document)
            chart.display = drawn is not None
            chart.show(drawn)
        # Two plots at most where there is little room: what is left goes before what was.
        after = self.query_one("#residual-after", Chart)
        if after.display and self.size.height < _ROOM_FOR_THREE:
            self.query_one("#residual", Chart).display = False

    @property
    def _is_running(self) -> bool:
        return "diagnosis" in self.bench.analyses.progress

    def hint(self) -> str:
        """Diagnose, measure next, or go on."""
        if "diagnosis" in self.bench.analyses.progress:
            return "Diagnosing beside the screen; look around.  Ctrl+N: on to report and history"
        if self._next_plan() is not None:
            return "N: measure this next, one key.  Ctrl+N: on to report and history"
        if "diagnosis" in self.desk.results.faults:
            return "D: once more.  A: take it as it is.  Ctrl+N: on to report and history"
        if self.desk.results.diagnosis is None:
            return "D: diagnose.  Ctrl+N: on to report and history"
        return "Ctrl+Y: copy.  Ctrl+N: on to report and history"

    def copy_text(self) -> str:
        """All lines."""
        return "\n".join(line.plain for line in self._lines())

    def action_view(self) -> None:
        """Words or plots, where there is room for one of them only."""
        self.toggle_class("-plots")
        self.call_after_refresh(self.show)

    def action_diagnose(self) -> None:
        """Begin, unless it runs."""
        self.bench.analyses.begin("diagnosis")
        self.show()

    def action_as_is(self) -> None:
        """Diagnose what was refused."""
        if "diagnosis" in self.desk.results.faults:
            self.desk.results.as_is = True
            self.action_diagnose()

    def action_measure_next(self) -> None:
        """Start the proposed sweep; its checks run first."""
        plan = self._next_plan()
        desk = self.desk
        if plan is None:
            self.notify("no measurement is proposed")
            return
        if desk.identity is None:
            self.notify("connect an instrument first: step 2", severity="warning")
            return
        try:
            desk.given_plan, desk.resume = plan_of_document(plan), None
            desk.follows = desk.measurement
        except LashbenchError as error:
            self.bench.show_error("The proposed measurement cannot be made", error)
            return
        if self.bench.keeper.start(hold=False):
            self.bench.go(4)

    def action_reveal(self) -> None:
        """Tell what the simulated bench hid, beside what was diagnosed."""
        desk = self.desk
        if desk.measurement is None or desk.unit is None or desk.results.diagnosis is None:
            self.notify("diagnose first: D", severity="warning")
            return
        unit, document = desk.unit, desk.results.diagnosis.to_json()

        def work() -> list[str]:
            from tui.demonstration.hidden import behind_address, compare, worded

            address = one_session(desk.db, number).header.address
            hidden = behind_address(address, unit)
            if hidden is None:
                return []
            return list(worded(hidden, compare(hidden, document), document, None))

        def tell(lines: list[str]) -> None:
            if lines:
                self.app.push_screen(HelpDialog("What was hidden", "\n\n".join(lines)))
            else:
                self.notify("the bench of this measurement hides nothing")

        number = desk.measurement
        self.bench.beside.do("reveal", work, tell, "It cannot be told")

    def _judged(self) -> list[str]:
        """What is judged without a diagnosis."""
        results = self.desk.results
        said = progress_lines(results, self.bench.analyses.progress.get("judgement"))
        said += [*headline(results.judgement), *item_lines(results.judgement)]
        return ["", *said] if said else []

    def _next_plan(self) -> Mapping[str, Any] | None:
        diagnosis = self.desk.results.diagnosis
        if diagnosis is None:
            return None
        proposed = diagnosis.to_json().get("next_measurement")
        return None if proposed is None else proposed["plan"]

    def _lines(self) -> list[Content]:
        desk, results = self.desk, self.desk.results
        head = f"measurement {desk.measurement}" + (", SIMULATED" if desk.simulated else "")
        if self._is_running:
            return _plain(f"{head}: the diagnosis runs beside the screen")
        if "diagnosis" in results.faults:
            return _plain(
                f"{head}: NO DIAGNOSIS", results.faults["diagnosis"], "", "D: try once more",
                *self._judged(),
            )  # fmt: skip
        if results.diagnosis is None:
            return _plain(f"{head}: not diagnosed yet", "", "D compares it with the model: which"
                          " physical cause explains what the model misses?",
                          *self._judged())  # fmt: skip
        document = results.diagnosis.to_json()
        origin = getattr(results.diagnosis, "origin", "")
        lines = _plain(f"{head}, {origin}; D makes it anew" if origin else head)
        unit = desk.unit
        answer = progress_lines(results, self.bench.analyses.progress.get("judgement"))
        if unit is not None:
            answer += answer_lines(None, document, unit, results.doubt, results.judgement)
        chart = self.query_one("#ratios", Chart)
        width = max(40, self.query_one("#scroll").size.width - 4)
        lines += diagnosis_lines(document, chart.palette, width, answer)
        plan = self._next_plan()
        if plan is not None:
            try:
                lines += _plain("", *plan_words(plan_of_document(plan), desk.url))
            except LashbenchError as error:
                lines += _plain(f"it cannot be made: {error}")
        return lines


def _plain(*texts: str) -> list[Content]:
    """Lines of text as they stand, whatever they hold."""
    return [Content(visible(text)) for text in texts]
