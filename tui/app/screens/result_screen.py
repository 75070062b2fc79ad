"""Step 5: ARF and RF per level, the contribution ratio, b1 and b2, and what to adjust.

Owns the reading of results off the desk. The analysis runs beside the screen
and what is there of it is shown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll
from textual_plot import HiResMode

from tui.app.step_screen import StepScreen
from tui.app.widgets.bode import BodePlot
from tui.app.widgets.panel import Panel
from tui.app.widgets.plain import Words
from tui.app.widgets.traces import traces_of_response

if TYPE_CHECKING:
    from analysis.resonance.records import LevelFeatures
    from sim.unit import Unit

__all__ = ["ResultScreen", "answer_lines"]

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

V changes between the Bode plot and the error index, the paper's measure over the ratio: the
least index marks the likeliest ratio. E estimates once more. A response that looks like a mistake
is not estimated; A takes it as it stands. Ctrl+Y copies everything.
"""
    BINDINGS = [
        Binding("v", "view", "Bode/index", id="result.view"),
        Binding("g", "panels", "Gain/phase", id="result.panels", show=False),
        Binding("e", "estimate", "Estimate", id="result.estimate", show=False),
        Binding("a", "as_is", "As it is", id="result.as-is", show=False),
    ]
    DEFAULT_CSS = """
    ResultScreen #plots { height: 1fr; }
    ResultScreen #index { height: 1fr; }
    ResultScreen #index-words { height: 1; }
    ResultScreen #index, ResultScreen #index-words { display: none; }
    ResultScreen.-index #index, ResultScreen.-index #index-words { display: block; }
    ResultScreen.-index BodePlot { display: none; }
    ResultScreen #words { height: auto; max-height: 60%; }
    ResultScreen.-short #words { max-height: 9; }
    """

    def body(self) -> ComposeResult:
        """Plot above, words below."""
        with Vertical(id="plots", classes="pane"):
            yield BodePlot()
            yield Panel("index")
            yield Words(_INDEX_WORDS, id="index-words")
        with VerticalScroll(id="words", classes="pane"):
            yield Words("", id="text")

    def on_mount(self) -> None:
        """Gain alone where there is little room."""
        self.query_one(BodePlot).set_class(self.size.height < 40, "-gain-only")
        super().on_mount()
        self.query_one(BodePlot).focus()

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
            (feature.frequency_hz, name)
            for level in results.features
            for name, feature in (("ARF", level.arf), ("RF", level.rf))
            if feature is not None
        ]
        plot.draw(traces, None, features)
        if results.estimate is not None:
            _draw_index(self.query_one("#index", Panel), results.estimate)
        self.query_one("#text", Words).update("\n".join(self._lines()))

    def hint(self) -> str:
        """Wait, or go on."""
        if "result" in self.bench.analyses.progress:
            return "Estimating beside the screen; look around.  Ctrl+N: on to the diagnosis"
        if "result" in self.desk.results.faults:
            return "E: estimate once more.  A: take it as it is.  Ctrl+N: on to the diagnosis"
        if self.desk.results.estimate is None:
            return "E: estimate once more.  Ctrl+N: on to the diagnosis"
        return "V: the error index.  Ctrl+Y: copy.  Ctrl+N: on to the diagnosis"

    def copy_text(self) -> str:
        """All lines."""
        return "\n".join(self._lines())

    def action_view(self) -> None:
        """Bode plot or error index."""
        self.toggle_class("-index")
        self.show()

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
        if results.estimate is not None and desk.unit is not None:
            diagnosis = None if results.diagnosis is None else results.diagnosis.to_json()
            lines += answer_lines(results.estimate, diagnosis, desk.unit)
            lines += believed_lines(results.estimate)
            if diagnosis is None:
                lines += [f"warning: {text}" for text in results.estimate.get("warnings", ())]
        elif "result" in self.bench.analyses.progress:
            fraction, text = self.bench.analyses.progress["result"]
            lines.append(f"estimating {100 * fraction:3.0f} %  {text}")
        elif "result" in results.faults:
            lines.append(f"NO ESTIMATE: {results.faults['result']}")
        head = f"measurement {desk.measurement}" + (", SIMULATED" if desk.simulated else "")
        if results.features:
            wide = self.has_class("-wide")
            lines += [head, *(summary(results.features) if wide else _brief(results.features))]
        return lines or [f"reading {head}"]


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
    estimate: Mapping[str, Any] | None, diagnosis: Mapping[str, Any] | None, unit: Unit
) -> list[str]:
    """Advice, whose numbers they are, the contribution ratio, and each stage beside its limit."""
    from analysis.advice import advise
    from analysis.answer import accept_model

    answer = accept_model(estimate, diagnosis)
    advice = advise(answer, unit)
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


def _draw_index(panel: Panel, document: Any) -> None:
    panel.clear()
    curve = document.get("error_index")
    if not curve:
        return
    ratio, hertz = np.array(curve["ratio"], float), np.array(curve["hz"], float)
    std = np.array([np.nan if v is None else v for v in curve["std_hz"]], float)
    panel.plot(ratio, hertz, "bright_blue", HiResMode.BRAILLE, "error index")
    every = slice(0, None, max(1, len(ratio) // 20))
    shown = np.isfinite(hertz[every])
    bars = np.where(np.isfinite(std[every]), std[every], 0.0)
    panel.errorbar(
        ratio[every][shown], hertz[every][shown], None, bars[shown], marker="o",
        marker_style="bright_blue",
    )  # fmt: skip
    panel.add_v_line(float(curve["minimum_ratio"]), "green")
