"""Step 5: ARF and RF per level, the contribution ratio, b1 and b2, and what to adjust.

Owns the reading of results off the desk. The analysis runs beside the screen
and what is there of it is shown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll

from analysis.execution.pace import Pace, duration
from tui.app.judged_words import STAGES, headline, item_lines, progress_lines
from tui.app.plot.bode import BodePlot
from tui.app.plot.chart import Chart
from tui.app.plot.curves import index_drawing
from tui.app.plot.predictions import Which, band_predictions, predictions_of
from tui.app.plot.traces import LEVEL_MARKS, Prediction, traces_of_response
from tui.app.screens.earlier_sweep import EarlierSweep
from tui.app.widgets.plain import Words

if TYPE_CHECKING:
    from analysis.acceptance import Judgement
    from analysis.resonance.records import LevelFeatures
    from sim.unit import Unit

__all__ = ["ResultScreen", "answer_lines"]

Shown = Which | Literal["datasheet"] | None
"""Whose prediction is under the points."""

_DIAGNOSED: tuple[Which, ...] = ("extended", "baseline")

_INDEX_WORDS = "error index in Hz over the contribution ratio of stage 1: least is likeliest"


class ResultScreen(EarlierSweep):
    """What the response says of the gears."""

    STEP = 5
    HELP = """
Anti-resonance (ARF) and resonance (RF) stand as lines on the plot, with their errors in the
table. The contribution ratio r is the share of the backlash that sits in stage 1, with its 95 %
interval; b1 and b2 are the plays of the stages. The estimate simulates the unit many times and
takes a while; the screen stays free meanwhile. Where the unit's own model does not explain the
response there is no advice before a diagnosis (step 6); after it, the numbers are those of the
model that the diagnosis accepts.

M puts a model's prediction under the points, a dashed line in its band. Before a diagnosis it is
what units of this datasheet read: some are simulated, with values off by their tolerances and the
ratio of the estimate (any ratio, before it), and the band holds the middle 68 % of them. It takes
some seconds beside the screen; M again ends it. After a diagnosis there are also the model with
the cause that was named and the one without, in the band of one standard deviation. Each level is
predicted from the others then.

J chooses limits. Each of them is then decided, PASS, FAIL or UNDECIDED, with its reason: limits of
r, b1, b2 and b_t by the estimate or the diagnosis, those of ARF, RF and damping at once, and
causes that are not tolerated by the diagnosis.

L puts the latest complete session of this unit behind the points.
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
            tooltip="The model's prediction: by the datasheet, by the diagnosis, none",
        ),
        Binding("g", "panels", "Gain/phase", id="result.panels", show=False),
        Binding("l", "reference", "Reference", id="result.reference", show=False),
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
        self._model: Shown = "extended"
        self._pace, self._band_pace = Pace(), Pace()

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
        """Begin what is not there yet, and judge: limits may be others by now."""
        results = self.desk.results
        self.bench.analyses.judge()
        if results.estimate is None and "result" not in results.faults:
            self.bench.analyses.begin("result")

    def show_body(self) -> None:
        """Plot and words from the desk."""
        results, measurement = self.desk.results, self.desk.measurement
        plot = self.query_one(BodePlot)
        traces = [] if results.response is None else traces_of_response(results.response)
        if self.desk.reference is not None and self.desk.reference_name != f"#{measurement}":
            traces += traces_of_response(self.desk.reference, self.desk.reference_name)
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
            return "Estimating beside the screen.  M: the model.  Ctrl+N: on to the diagnosis"
        if "result" in self.desk.results.faults:
            return "E: estimate once more.  A: take it as it is.  Ctrl+N: on to the diagnosis"
        if self.desk.results.estimate is None:
            return "E: estimate once more.  Ctrl+N: on to the diagnosis"
        if self.desk.results.diagnosis is not None:
            return "M: another model.  V: the error index.  Ctrl+N: on to the diagnosis"
        return "M: the model.  V: the error index.  Ctrl+N: on to the diagnosis"

    def copy_text(self) -> str:
        """All lines."""
        return "\n".join(self._lines())

    def shown_measurement(self) -> int | None:
        """The one that the results are about."""
        return self.desk.measurement

    def action_view(self) -> None:
        """Bode plot or error index."""
        self.toggle_class("-index")
        self.show()

    def action_model(self) -> None:
        """Another model's prediction under the points, or none."""
        there = self._models()
        self._model = there[(there.index(self._shown()) + 1) % len(there)]
        if self._model == "datasheet" and self.desk.results.band is None:
            self.bench.analyses.begin("band")
        elif self._model is None:
            self.bench.analyses.stop("band")
        self.show()

    def _models(self) -> list[Shown]:
        """Models whose prediction can be shown, in the order of the key; none last."""
        diagnosis = self.desk.results.diagnosis
        told: list[Shown] = []
        if diagnosis is not None:
            document = diagnosis.to_json()
            told = [one for one in _DIAGNOSED if predictions_of(document, one)]
        return [*told, "datasheet", None]

    def _shown(self) -> Shown:
        """The model that is shown: where no cause is named, the plain one in place of the other."""
        there = self._models()
        wanted = (self._model, "baseline") if self._model == "extended" else (self._model,)
        return next((one for one in wanted if one in there), None)

    def _predictions(self) -> list[Prediction]:
        results, shown = self.desk.results, self._shown()
        if shown == "datasheet":
            return [] if results.band is None else band_predictions(results.band)
        if shown is None or results.diagnosis is None:
            return []
        return predictions_of(results.diagnosis.to_json(), shown)

    def _band_lines(self) -> list[str]:
        """What the datasheet's band is, or how far it is."""
        if self._shown() != "datasheet":
            return []
        results = self.desk.results
        if "band" in self.bench.analyses.progress:
            fraction, text = self.bench.analyses.progress["band"]
            left_s = self._band_pace.remaining_s(fraction)
            left = "" if left_s is None else f", {duration(left_s)} left"
            return [f"{text or 'simulating'} {100 * fraction:.0f} %{left}; M ends it"]
        if "band" in results.faults:
            return [f"NO PREDICTION: {results.faults['band']}"]
        return [] if results.band is None else [results.band.words]

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
        lines = self._band_lines()
        below: list[str] = []
        lines += progress_lines(results, self.bench.analyses.progress.get("judgement"))
        if results.estimate is not None and desk.unit is not None:
            diagnosis = None if results.diagnosis is None else results.diagnosis.to_json()
            lines += answer_lines(
                results.estimate_told, diagnosis, desk.unit, results.doubt, results.judgement
            )
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
        if results.estimate is None:
            lines += [*headline(results.judgement), *item_lines(results.judgement)]
        head = f"measurement {desk.measurement}" + (", SIMULATED" if desk.simulated else "")
        if results.features:
            wide = not self.has_class("-narrow") and not self.has_class("-side")
            lines += [head, *(summary(results.features) if wide else _brief(results.features))]
        return [*lines, *below] or [f"reading {head}"]


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
    judgement: Judgement | None = None,
) -> list[str]:
    """The verdict, advice, whose numbers they are, the contribution ratio, and each limit."""
    from analysis.advice import advise
    from analysis.answer import accept_model

    answer = accept_model(estimate, diagnosis)
    advice = advise(answer, unit, judgement=judgement, doubt=doubt)
    ratio = answer.contribution_ratio
    told = [] if ratio is None else [f"{ratio_words(ratio)}; {answer.source}"]
    stages = [stage.line for stage in advice.stages] if answer.models else []
    before = [advice.before] if advice.before else []
    limits = item_lines(judgement, STAGES if stages else ())
    return [*headline(judgement), *before, advice.headline, *told, *stages, *limits]


def ratio_words(ratio: Mapping[str, Any]) -> str:
    """The contribution ratio in one line."""
    words = f"contribution ratio r = {ratio['value']:.3f} +- {ratio['std']:.3f}"
    if ratio.get("interval95"):
        low, high = ratio["interval95"]
        words += f"  (95 %: {low:.3f} to {high:.3f})"
    return words
