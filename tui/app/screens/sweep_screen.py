"""Step 4: the sweep, live on a Bode plot; pause, stop, abort, measure a band again.

Owns what the operator may ask of the session in hand. Points are drawn as the
session told them, at most ten times a second.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.widgets import ProgressBar

from tui.app.dialogs.dialogs import QuestionDialog
from tui.app.plot.bode import BodePlot
from tui.app.plot.traces import traces_of_points, traces_of_response
from tui.app.screens.earlier_sweep import EarlierSweep
from tui.app.state.sessions import one_session
from tui.app.widgets.plain import Words
from tui.app.words import clock_in, plan_words, point_words, span_words

if TYPE_CHECKING:
    from daq.store_records import Measurement

__all__ = ["SweepScreen"]

_VIEWS = ("-both", "-gain-only", "-phase-only")


class SweepScreen(EarlierSweep):
    """Start, watch, pause, stop."""

    STEP = 4
    HELP = """
S starts the sweep, or goes on after a pause. Space pauses after the point in hand; the source
is off in a pause. Ctrl+X stops at once, the rest can be measured later with R. A aborts for good:
the points are kept, the measurement cannot be resumed.

B marks one end of a band and, pressed again, the other; that band is then measured again and the
old points are kept as superseded. Esc forgets the mark.

G shows gain, phase or both. L puts the latest complete session of this unit behind the sweep.

Marks: a shape per level, ! overload, ~ not periodic, - coarse, ? spoilt. The shaded band is one
standard error.

"""
    BINDINGS = [
        Binding("s", "start", "Start", id="sweep.start", tooltip="Start, or go on after a pause"),
        Binding("space", "pause", "Pause", id="sweep.pause", tooltip="Hold, or go on"),
        Binding("r", "resume", "Resume", id="sweep.resume", show=False,
                tooltip="Go on with the interrupted measurement"),
        Binding("a", "abort", "Abort", id="sweep.abort", show=False,
                tooltip="End for good, points kept"),
        Binding("b", "band", "Band", id="sweep.band", tooltip="Measure a band again"),
        Binding("g", "view", "Gain/phase", id="sweep.view", show=False),
        Binding("l", "reference", "Reference", id="sweep.reference", show=False),
    ]  # fmt: skip
    DEFAULT_CSS = """
    SweepScreen #line { height: 1; }
    SweepScreen #text { height: auto; max-height: 5; }
    SweepScreen ProgressBar { width: 100%; height: 1; }
    SweepScreen Bar { width: 1fr; }
    """

    def __init__(self) -> None:
        super().__init__()
        self._band_from: float | None = None
        self._view = 0
        self._is_chosen = False

    def body(self) -> ComposeResult:
        """Plot, progress, two or three lines."""
        with Vertical(classes="pane"):
            yield BodePlot()
            yield ProgressBar(show_eta=False, classes="decoration")
            yield Words("", id="text")

    def on_mount(self) -> None:
        """The plot has the keys."""
        super().on_mount()
        self.query_one(BodePlot).focus()

    def on_resize(self) -> None:
        """Gain alone where there is little room, unless something else was chosen."""
        if not self._is_chosen:
            self._view = 1 if self.size.height < 30 else 0
            self._show_view()

    def show_body(self) -> None:
        """The points so far, and the lines below."""
        run = self.desk.run
        plot = self.query_one(BodePlot)
        levels = run.plan.levels_vpk if run.plan is not None else ()
        traces = traces_of_points(run.points.values(), levels)
        if self.desk.reference is not None:
            traces += traces_of_response(self.desk.reference, self.desk.reference_name)
        span = None
        if run.plan is not None:
            span = min(run.plan.frequencies_hz), max(run.plan.frequencies_hz)
            span = span if span[1] > span[0] else None
        lines = [] if self._band_from is None else [(self._band_from, "band")]
        plot.draw(traces, span, lines)
        self.query_one(ProgressBar).update(total=max(1, run.total), progress=run.done)
        self.query_one("#text", Words).update("\n".join(self._lines()))

    def hint(self) -> str:
        """The word that the session waits for."""
        run = self.desk.run
        if self._band_from is not None:
            return (
                f"Band from {self._band_from:g} Hz: arrows to its other end, then B.  Esc forgets"
            )
        if run.stop_asked and run.live:
            return "Stopping: the source is being made safe"
        match run.phase:
            case "ready":
                return "S: START the sweep.  3: back to the checks and the plan"
            case "checking":
                return "Checking before the source may drive.  Ctrl+X stops"
            case "sweeping" if self.bench.keeper.pausing:
                return "Pausing after this point"
            case "sweeping":
                return "Space: pause.  Ctrl+X: stop now.  Arrows, B: measure a band again"
            case "paused":
                return "Paused, source off.  Space or S: go on.  A: abort for good"
        if self.desk.resume is not None:
            return "R: go on with the missing points.  Ctrl+N: the result of what is there"
        if run.finished is not None and run.finished.state == "complete":
            return "Complete.  Ctrl+N: the result.  Arrows, B: measure a band again"
        return "Ctrl+N: the result.  3: check for a new sweep"

    def copy_text(self) -> str:
        """Every point as a line."""
        run = self.desk.run
        points = sorted(run.points.values(), key=lambda p: (p.source_vpk, p.point.frequency_hz))
        return "\n".join([*self._lines(), *(point_words(point) for point in points)])

    # ------------------------------------------------------------ keys

    def action_start(self) -> None:
        """Start after the checks, or go on after a pause."""
        run, keeper = self.desk.run, self.bench.keeper
        if run.phase in ("ready", "paused") or run.phase == "sweeping" and keeper.pausing:
            keeper.go_on()
        elif run.live:
            self.notify("the session is under way")
        elif self.desk.resume is not None:
            self.action_resume()
        else:
            self.notify("the checks come first: step 3", severity="warning")
        self.show()

    def action_pause(self) -> None:
        """Hold after the point in hand, or go on."""
        run, keeper = self.desk.run, self.bench.keeper
        if run.phase == "paused" or (run.phase == "sweeping" and keeper.pausing):
            keeper.go_on()
        elif run.phase == "sweeping":
            keeper.pause()
        elif run.phase == "ready":
            self.notify("not started yet; S starts")
        self.show()

    def action_resume(self) -> None:
        """Go on with the interrupted measurement; all checks run again first."""
        if self.desk.run.live:
            self.notify("the session is under way")
        elif self.desk.resume is None:
            self.notify("nothing is interrupted here")
        else:
            self.bench.keeper.start(hold=False)
        self.show()

    def action_abort(self) -> None:
        """End for good; the source goes off while the question stands."""
        run = self.desk.run
        if not run.live:
            self.notify("no session is under way")
            return
        if run.phase == "sweeping":
            self.bench.keeper.pause()
        text = (
            f"Measurement {run.measurement} keeps its {run.done} points and cannot be resumed. "
            "It pauses meanwhile, with the source off."
        )
        dialog = QuestionDialog("Abort for good?", text, "Abort", "a", "Stay paused")
        self.app.push_screen(dialog, lambda yes: self.bench.keeper.abort() if yes else None)

    def action_band(self) -> None:
        """Mark one end of a band; the second time, measure it again."""
        plot = self.query_one(BodePlot)
        if plot.cursor_hz is None:
            plot.action_move(0)
        if plot.cursor_hz is None:
            self.notify("no point yet to put a cursor on")
        elif self._band_from is None:
            self._band_from = plot.cursor_hz
        else:
            low, high = sorted((self._band_from, plot.cursor_hz))
            self._band_from = None
            self._ask_band(low, high)
        self.show()

    def action_back(self) -> None:
        """Forget the mark, else go back."""
        if self._band_from is not None:
            self._band_from = None
            self.show()
        else:
            super().action_back()

    def action_view(self) -> None:
        """Gain and phase, gain, phase."""
        self._is_chosen = True
        self._view = (self._view + 1) % len(_VIEWS)
        self._show_view()

    def shown_measurement(self) -> int | None:
        """The one of the session."""
        return self.desk.run.measurement

    def on_bode_plot_cursor_moved(self) -> None:
        """The reading follows the cursor."""
        self.query_one("#text", Words).update("\n".join(self._lines()))

    # ------------------------------------------------------------ inside

    def _show_view(self) -> None:
        plot = self.query_one(BodePlot)
        for index, name in enumerate(_VIEWS):
            plot.set_class(index == self._view, name)
        self.show()

    def _ask_band(self, low: float, high: float) -> None:
        run = self.desk.run
        stored = sum(low <= hertz <= high for _, hertz in run.points)
        text = (
            f"{stored} stored points from {low:g} to {high:g} Hz are measured again, after a "
            "run-in; the old ones are kept as superseded."
        )
        dialog = QuestionDialog("Measure the band again?", text, "Measure", "b", "Leave it")
        self.app.push_screen(dialog, lambda yes: self._again(low, high) if yes else None)

    def _again(self, low: float, high: float) -> None:
        desk, keeper = self.desk, self.bench.keeper

        def begin(measurement: Measurement) -> None:
            if lost := desk.take_remarks(measurement):
                self.notify(lost, severity="warning")
            desk.resume, desk.given_plan = measurement.id, desk.run.plan
            keeper.start(hold=False, remeasure_hz=(low, high))
            self.show()

        def read() -> None:
            run = desk.run
            if run.measurement is None or (run.finished and run.finished.state == "aborted"):
                self.notify("an aborted measurement stays as it is", severity="warning")
                return
            work = partial(one_session, desk.db, run.measurement)
            self.bench.beside.do("session", work, begin, "Nothing was started")

        keeper.finish_then(read)

    def _lines(self) -> list[str]:
        run, desk = self.desk.run, self.desk
        cursor = self.query_one(BodePlot).reading
        if run.phase in ("ready", "checking") and run.plan is not None and run.latest is None:
            stored = run.done
            return [*plan_words(run.plan, desk.url, stored), cursor or f"{stored} points stored"]
        progress = f"{run.done} of {run.total} points stored"
        if run.phase == "sweeping" and run.run_in:
            progress += f"; run-in, {run.run_in} points driven again"
            # No time of day: how long the run-in takes is not in it.
            progress += f"; then {span_words(run.remaining_s)}" if run.remaining_s else ""
        elif run.phase == "sweeping" and run.remaining_s is not None:
            progress += f"; {span_words(run.remaining_s)} left, done {clock_in(run.remaining_s)}"
        elif run.finished is not None:
            done = run.finished
            progress += f"; {done.state}: {done.reason}; {done.flagged} flagged"
        latest = f"now: {point_words(run.latest)}" if run.latest is not None else ""
        warning = f"note: {run.warnings[-1]}" if run.warnings else ""
        below = f"cursor: {cursor}" if cursor else warning
        return [progress, latest, below]
