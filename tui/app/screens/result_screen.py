"""Step 5: ARF and RF per level, the contribution ratio, b1 and b2, and what to adjust.

Owns the reading of results off the desk. The analysis runs beside the screen
and what is there of it is shown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll

from analysis.execution.pace import Pace, duration
from tui.app.plot.bode import BodePlot
from tui.app.plot.chart import Chart
from tui.app.plot.curves import index_drawing
from tui.app.plot.predictions import Which, predictions_of
from tui.app.plot.traces import LEVEL_MARKS, Prediction, traces_of_response
from tui.app.step_screen import StepScreen
from tui.app.widgets.plain import Words

if TYPE_CHECKING:
    from analysis.resonance.records import LevelFeatures
    from sim.unit import Unit

__all__ = ["ResultScreen", "answer_lines"]

_MODELS: tuple[Which | None, ...] = ("extended", "baseline", None)
"""Whose prediction is shown, in the order of the key."""

_INDEX_WORDS = "error index in Hz over the contribution ratio of stage 1: least is likeliest"


class ResultScreen(StepScreen):
    """What the response says of the gears."""

    STEP = 5
    HELP = """
Anti-resonance (ARF) and resonance (RF) stand as lines on the plot, with their errors in the
table. The contribution ratio r is the share of the backlash that sits in stage 1, with its 95 %
interval; b1 and b2 are the plays of the stages. The estimate simulates the unit many times and
takes a while; the screen stays free meanwhile. Where the unit's own model does not explain the
response there is no advice before a diagnosis (step 6); after it, the numbers are those of the
model that the diagnosis accepts.

After a diagnosis, M puts a model's prediction under the points: a dashed line in the band of one
standard deviation, with the cause that was named or without. Each level is predicted from the
others.

V changes between the Bode plot and the error index, the paper's measure over the ratio: the
least index marks the likeliest ratio. E estimates once more. A response that looks like a mistake
is not estimated; A takes it as it stands. Ctrl+Y copies everything.
"""
    BINDINGS = [
        Binding("v", "view", "Bode/index", id="result.view"),
        Binding(
            "m",
            "model",
            "Model",
            id="result.model",
            tooltip="The model's prediction: plain, with the cause, none",
        ),
        Binding("g", "panels", "Gain/phase", id="result.panels", show=False),
        Binding("e", "estimate", "Estimate", id="result.estimate", show=False),
        Binding("a", "as_is", "As it is", id="result.as-is", show=False),
    ]
    DEFAULT_CSS = """
    ResultScreen #halves { height: 1fr; }
    ResultScreen.-side #halves { layout: horizontal; }
    ResultScreen #plots { height: 1fr; }
    ResultScreen.-side #plots { width: 3fr; height: 100%; }
    ResultScreen.-side #words { width: 2fr; max-height: 100%; height: 100%; }
    ResultScreen #index { height: 1fr; }
    ResultScreen #index-words { height: 1; }
    ResultScreen #index, ResultScreen #index-words { display: none; }
    ResultScreen.-index #index, ResultScreen.-index #index-words { display: block; }
    ResultScreen.-index BodePlot { display: none; }
    ResultScreen #words { height: auto; max-height: 45%; }
    ResultScreen.-short #words { max-height: 9; }
    """

    def __init__(self) -> None:
        super().__init__()
        self._model: Which | None = "extended"
        self._pace = Pace()

    def body(self) -> ComposeResult:
        """Plot above, words below; side by side where there is room."""
        with Vertical(id="halves"):
            with Vertical(id="plots", classes="pane"):
                yield BodePlot()
                yield Chart("index")
                yield Words(_INDEX_WORDS, id="index-words")
            with VerticalScroll(id="words", classes="pane"):
                yield Words("", id="text")

    def on_mount(self) -> None:
        """The plot has the keys."""
        super().on_mount()
        self.query_one(BodePlot).focus()

    def on_resize(self) -> None:
        """Gain alone where there is little room."""
        self.query_one(BodePlot).set_class(self.size.height < 40, "-gain-only")
        self.call_after_refresh(self.show)

    def arrive(self) -> None:
        """Begin what is not there yet."""
        results = self.desk.results
        if results.estimate is None and "result" not in results.faults:
            self.bench.analyses.begin("result")

    def show_body(self) -> None:
        """Plot and words from the desk."""
        results = self.desk.results
        plot = self.query_one(BodePlot)
        traces = [] if results.response is None else traces_of_response(results.response)
        features = [
            (feature.frequency_hz, f"{LEVEL_MARKS[at % len(LEVEL_MARKS)]}{name}")
            for at, level in enumerate(results.features)
            for name, feature in (("ARF", level.arf), ("RF", level.rf))
            if feature is not None
        ]
        plot.draw(traces, None, features, self._predictions())
        if results.estimate is not None:
            index = self.query_one("#index", Chart)
            index.show(index_drawing(index, results.estimate.get("error_index")))
        self.query_one("#text", Words).update("\n".join(self._lines()))

    def hint(self) -> str:
        """Wait, or go on."""
        if "result" in self.bench.analyses.progress:
            return "Estimating beside the screen; look around.  Ctrl+N: on to the diagnosis"
        if "result" in self.desk.results.faults:
            return "E: estimate once more.  A: take it as it is.  Ctrl+N: on to the diagnosis"
        if self.desk.results.estimate is None:
            return "E: estimate once more.  Ctrl+N: on to the diagnosis"
        if self.desk.results.diagnosis is not None:
            return "M: another model.  V: the error index.  Ctrl+N: on to the diagnosis"
        return "V: the error index.  Ctrl+Y: copy.  Ctrl+N: on to the diagnosis"

    def copy_text(self) -> str:
        """All lines."""
        return "\n".join(self._lines())

    def action_view(self) -> None:
        """Bode plot or error index."""
        self.toggle_class("-index")
        self.show()

    def action_model(self) -> None:
        """Another model's prediction under the points, or none."""
        diagnosis = self.desk.results.diagnosis
        if diagnosis is None:
            self.notify("diagnose first: step 6")
            return
        document = diagnosis.to_json()
        there: list[Which | None] = [
            one for one in _MODELS if one is None or predictions_of(document, one)
        ]
        if len(there) == 1:
            self.notify("this diagnosis tells no prediction; D in step 6 makes it anew")
        shown = _shown(self._model, document)
        self._model = there[(there.index(shown) + 1) % len(there)]
        self.show()

    def _predictions(self) -> list[Prediction]:
        diagnosis = self.desk.results.diagnosis
        if diagnosis is None or self._model is None:
            return []
        document = diagnosis.to_json()
        shown = _shown(self._model, document)
        return [] if shown is None else predictions_of(document, shown)

    def action_panels(self) -> None:
        """Gain alone, or gain and phase."""
        self.query_one(BodePlot).toggle_class("-gain-only")
        self.show()

    def action_estimate(self) -> None:
        """Once more."""
        self.desk.results.faults.pop("result", None)
        self.bench.analyses.begin("result")
        self.show()

    def action_as_is(self) -> None:
        """Estimate what was refused."""
        if "result" in self.desk.results.faults:
            self.desk.results.as_is = True
            self.action_estimate()

    def _lines(self) -> list[str]:
        from analysis.ensemble.datasheet_belief import believed_lines
        from analysis.resonance.records import summary

        desk, results = self.desk, self.desk.results
        lines: list[str] = []
        below: list[str] = []
        if results.estimate is not None and desk.unit is not None:
            diagnosis = None if results.diagnosis is None else results.diagnosis.to_json()
            lines += answer_lines(results.estimate, diagnosis, desk.unit, results.doubt)
            if diagnosis is None:
                below += [f"warning: {text}" for text in results.estimate.get("warnings", ())]
            below += believed_lines(results.estimate)
        elif "result" in self.bench.analyses.progress:
            fraction, text = self.bench.analyses.progress["result"]
            left_s = self._pace.remaining_s(fraction)
            left = "" if left_s is None else f", {duration(left_s)} left"
            lines.append(f"estimating {100 * fraction:3.0f} %{left}  {text}")
        elif "result" in results.faults:
            lines.append(f"NO ESTIMATE: {results.faults['result']}")
        head = f"measurement {desk.measurement}" + (", SIMULATED" if desk.simulated else "")
        if results.features:
            wide = not self.has_class("-narrow") and not self.has_class("-side")
            lines += [head, *(summary(results.features) if wide else _brief(results.features))]
        return [*lines, *below] or [f"reading {head}"]


def _shown(asked: Which | None, document: Mapping[str, Any]) -> Which | None:
    """The model that is shown: where no cause is named, the plain one in place of the other."""
    if asked == "extended" and not predictions_of(document, "extended"):
        asked = "baseline"
    return asked if asked is None or predictions_of(document, asked) else None


def _brief(features: Sequence[LevelFeatures]) -> list[str]:
    """A line per level, for narrow screens, and what a reader should know below."""
    from analysis.resonance.records import with_error

    lines = []
    for level in features:
        parts = [
            f"{name} {with_error(found.frequency_hz, found.std_hz)} Hz {found.gain_db:.1f} dB"
            if found is not None
            else f"no {name}"
            for name, found in (("ARF", level.arf), ("RF", level.rf))
        ]
        apart = with_error(level.difference_hz, level.difference_std_hz)
        lines.append(f"{level.source_vpk:g} V: {', '.join(parts)}, apart {apart} Hz")
    lines += [f"{level.source_vpk:g} V {flag}" for level in features for flag in level.flags]
    return lines


def answer_lines(
    estimate: Mapping[str, Any] | None,
    diagnosis: Mapping[str, Any] | None,
    unit: Unit,
    doubt: str = "",
) -> list[str]:
    """Advice, whose numbers they are, the contribution ratio, and each stage beside its limit."""
    from analysis.advice import advise
    from analysis.answer import accept_model

    answer = accept_model(estimate, diagnosis)
    advice = advise(answer, unit, doubt=doubt)
    ratio = answer.contribution_ratio
    told = [] if ratio is None else [f"{ratio_words(ratio)}; {answer.source}"]
    stages = [stage.line for stage in advice.stages] if answer.models else []
    before = [advice.before] if advice.before else []
    return [*before, advice.headline, *told, *stages]


def ratio_words(ratio: Mapping[str, Any]) -> str:
    """The contribution ratio in one line."""
    words = f"contribution ratio r = {ratio['value']:.3f} +- {ratio['std']:.3f}"
    if ratio.get("interval95"):
        low, high = ratio["interval95"]
        words += f"  (95 %: {low:.3f} to {high:.3f})"
    return words
