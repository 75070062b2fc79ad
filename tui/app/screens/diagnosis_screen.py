"""Step 6: what the model lacks, which cause is likeliest, and what to measure next.

Owns the wording of a diagnosis' document. The diagnosis itself runs beside the
screen and nothing of it is made here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import VerticalScroll
from textual.widgets import ProgressBar

from analysis.ensemble.datasheet_belief import believed_lines
from analysis.inference.exclusion import head_unseen, list_unseen
from analysis.observation.joint import sweep_lines
from analysis.selection.wording import verdict_words
from daq.errors import LashbenchError
from tui.app.screens.result_screen import answer_lines
from tui.app.state.desk import plan_of_document
from tui.app.step_screen import StepScreen
from tui.app.widgets.plain import Words
from tui.app.words import plan_words

__all__ = ["DiagnosisScreen", "diagnosis_lines"]

_DEPARTURES = 4
"""The strongest departures of the plain model that are shown."""


class DiagnosisScreen(StepScreen):
    """Residual before and after, causes, rivals, the next measurement."""

    STEP = 6
    HELP = """
D compares the measurement with the model and asks which physical cause explains what is left,
which takes a minute or two of both processors; the screen stays free meanwhile.

Every cause is given with its probability. The residual is the distance of measurement and model
on source levels that were held out, in standard errors and dB, before and after the cause was
added. N starts the measurement that would tell rivals apart: checks first, as always, then the
sweep itself. D then diagnoses both measurements together. A response that looks like a mistake
is not diagnosed; A takes it as it stands.
"""
    BINDINGS = [
        Binding("d", "diagnose", "Diagnose", id="diagnosis.run"),
        Binding("a", "as_is", "As it is", id="diagnosis.as-is", show=False),
        Binding("n", "measure_next", "Measure this next", id="diagnosis.next"),
    ]

    def body(self) -> ComposeResult:
        """Progress and words."""
        yield ProgressBar(total=100, show_eta=False, id="share")
        with VerticalScroll(classes="pane", id="scroll"):
            yield Words("", id="text")

    def on_mount(self) -> None:
        """The words have the focus, to be scrolled."""
        super().on_mount()
        self.query_one("#scroll").focus()

    def show_body(self) -> None:
        """Progress or verdict."""
        running = self.bench.analyses.progress.get("diagnosis")
        bar = self.query_one("#share", ProgressBar)
        bar.display = running is not None
        if running is not None:
            bar.update(progress=100 * running[0])
        self.query_one("#text", Words).update("\n".join(self._lines()))

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
        return "\n".join(self._lines())

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

    def _next_plan(self) -> Mapping[str, Any] | None:
        diagnosis = self.desk.results.diagnosis
        if diagnosis is None:
            return None
        proposed = diagnosis.to_json().get("next_measurement")
        return None if proposed is None else proposed["plan"]

    def _lines(self) -> list[str]:
        desk, results = self.desk, self.desk.results
        head = f"measurement {desk.measurement}" + (", SIMULATED" if desk.simulated else "")
        if "diagnosis" in self.bench.analyses.progress:
            fraction, text = self.bench.analyses.progress["diagnosis"]
            return [f"{head}: {100 * fraction:.0f} %  {text}"]
        if "diagnosis" in results.faults:
            return [f"{head}: NO DIAGNOSIS", results.faults["diagnosis"], "", "D: try once more"]
        if results.diagnosis is None:
            return [f"{head}: not diagnosed yet", "", "D compares it with the model: which"
                    " physical cause explains what the model misses?"]  # fmt: skip
        document = results.diagnosis.to_json()
        origin = getattr(results.diagnosis, "origin", "")
        lines = [f"{head}, {origin}; D makes it anew"] if origin else [head]
        lines += [*self._answer(document), *diagnosis_lines(document)]
        plan = self._next_plan()
        if plan is not None:
            try:
                lines += plan_words(plan_of_document(plan), desk.url)
            except LashbenchError as error:
                lines.append(f"it cannot be made: {error}")
        return lines

    def _answer(self, document: Mapping[str, Any]) -> list[str]:
        """Advice and backlash by the model that is accepted."""
        unit = self.desk.unit
        return [] if unit is None else answer_lines(None, document, unit)


def diagnosis_lines(document: Mapping[str, Any]) -> list[str]:
    """A diagnosis for people: verdict, residual, causes with a sentence each, rivals, what next."""
    before, after = document["baseline"], document["extended"]
    lines = [
        f"VERDICT: {document['verdict'].upper()}. {' '.join(verdict_words(document))}",
        *sweep_lines(document.get("sweeps", ())),
        *believed_lines(document),
        "",
        f"residual before  {_residual(before)}",
        f"residual after   {_residual(after)}",
    ]
    gain = (document.get("gain") or {}).get("held_out_rms_ratio")
    if gain is not None:
        lines.append(f"gain             {gain:.2f} of the residual is left (1.00: nothing gained)")
    if document.get("shape"):
        lines.append(f"left by the plain model: {document['shape']}")
    lines += [f"  {_departure(part)}" for part in document.get("residual", ())[:_DEPARTURES]]
    lines += ["", "Causes" if document["causes"] else "Causes: none named"]
    for rank, cause in enumerate(document["causes"], start=1):
        lines.append(f" {rank}. {cause['effect']}  probability {cause['probability']:.2f}")
        lines.append(f"    {_explained(cause['effect'])}{_parameters(cause['parameters'])}")
        lines += [f"    {text}" for text in _checked(cause["effect"])]
    if document.get("rivals"):
        lines += ["", "Rivals" if document["causes"] else "Sets judged"]
        for rival in document["rivals"]:
            names = " + ".join(rival["causes"]) or "no cause"
            remark = f" ({rival['remark']})" if rival.get("remark") else ""
            lines.append(f" - {names}  probability {rival['probability']:.2f}{remark}")
    lines += [f"warning: {text}" for text in document.get("warnings", ())]
    proposed = document.get("next_measurement")
    if proposed:
        apart = " from ".join(proposed["separates"])
        sigma = _number(proposed.get("expected_sigma"))
        lines += ["", f"MEASURE THIS NEXT (key N): tells {apart}, {sigma} sigma expected"]
    if document.get("unseen"):
        lines += ["", head_unseen(document["verdict"]).capitalize()]
        lines += [f" - {text}" for text in list_unseen(document["unseen"])]
    return lines


def _explained(effect: str) -> str:
    from sim.catalogue import CATALOGUE

    known = CATALOGUE.get(effect)
    if known is None:
        return ""
    return f"{known.meaning.rstrip('.')}; on the bench: {known.bench_cause.rstrip('.')}."


def _checked(effect: str) -> list[str]:
    from sim.catalogue import CATALOGUE

    known = CATALOGUE.get(effect)
    return [] if known is None else [f"To make sure: {known.check}."]


def _parameters(parameters: Mapping[str, Any]) -> str:
    parts = [
        f"{name} = {_value(number)} {number.get('unit', '')}".rstrip()
        for name, number in parameters.items()
    ]
    return f" {', '.join(parts)}" if parts else ""


def _departure(part: Mapping[str, Any]) -> str:
    low, high = part["band_hz"]
    sweep = f" of sweep {part['sweep'] + 1}" if "sweep" in part else ""
    return (
        f"{part['quantity']} {part['mean']:+.2g} from {low:.0f} to {high:.0f} Hz at "
        f"{part['source_vpk']:g} V{sweep} ({abs(part['sigma']):.1f} standard errors)"
    )


def _residual(part: Mapping[str, Any]) -> str:
    sigma, decibel = part.get("held_out_rms_sigma"), part.get("held_out_rms_db")
    return f"{_number(sigma)} standard errors, {_number(decibel)} dB (held-out levels)"


def _value(number: Mapping[str, Any]) -> str:
    return f"{number['value']:.4g} +- {_number(number.get('std'))}"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2g}"
