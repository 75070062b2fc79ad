"""Step 3: the checks before a sweep, line by line, and the plan that they are about.

Owns the start of a session up to its hold: the same session goes on in step 4,
so nothing can drive the source for long before its checks have passed.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll

from analysis.execution.pace import Pace, duration
from daq.errors import LashbenchError
from tui.app.dialogs.best_plan import BestPlanDialog
from tui.app.dialogs.dialogs import QuestionDialog
from tui.app.dialogs.plan import PlanChoice, PlanDialog
from tui.app.run_view import RunView
from tui.app.state.desk import NO_RECIPE, Desk, Results
from tui.app.state.proposed_sweep import LEVELS
from tui.app.step_screen import StepScreen
from tui.app.widgets.plain import Words
from tui.app.words import plan_words
from tui.measure_options import PlanOptions
from tui.unit_under_test import USUAL_MIN

if TYPE_CHECKING:
    from daq.plan import SweepPlan
    from tui.app.state.plan_search import PlanSearch

__all__ = ["CheckScreen"]

_LOOK_S = 0.5
"""How often the progress of a search is drawn."""

_MARKS = {"pass": "[ ok ]", "note": "[note]", "fail": "[FAIL]"}


class CheckScreen(StepScreen):
    """Limits, identity, source off, a gentle trial point."""

    STEP = 3
    HELP = """
C runs the checks: the plan within all limits, the right instrument, the source proven off, and
a trial point, which drives the unit gently at the plan's lowest level for a few cycles. When all
have passed the session holds with the source off, and the sweep is started in step 4.

P changes the plan: levels, band, points, cycles. The checks are then run again.

B finds the sweep that tells the contribution ratio best in so many minutes: units as the
datasheet allows are simulated beside the screen, and B again gives that up. Below the plan stands
what was found: where ARF and RF will be, levels, band, and the error that is expected of the
ratio. P then opens the plan filled with it. It is refused where bench or unit forbid it.
"""
    BINDINGS = [
        Binding("c", "check", "Check", id="check.run", tooltip="Run the checks"),
        Binding("p", "plan", "Plan", id="check.plan", tooltip="Change the plan"),
        Binding(
            "b",
            "best",
            "Best plan",
            id="check.best",
            tooltip="Find the sweep that tells most in so many minutes, or give that up",
        ),
    ]
    DEFAULT_CSS = """
    CheckScreen #halves { height: 1fr; }
    CheckScreen.-side #halves { layout: horizontal; }
    CheckScreen #planned { height: auto; }
    CheckScreen.-side #planned { width: 2fr; }
    CheckScreen.-side #checked { width: 3fr; }
    CheckScreen #lines { height: 1fr; }
    """

    def __init__(self) -> None:
        super().__init__()
        self._planned: SweepPlan | LashbenchError | None = None
        self._planned_for: Desk | None = None
        self._is_fresh = False
        self._pace = Pace()

    def on_mount(self) -> None:
        """How far a search is changes by itself."""
        super().on_mount()
        self.set_interval(_LOOK_S, self._show_search)

    def arrive(self) -> None:
        """The files that a plan is of may be others by now."""
        self._is_fresh = False

    def body(self) -> ComposeResult:
        """Plan above, checks below; side by side where there is room."""
        with Vertical(id="halves"):
            with Vertical(id="planned", classes="pane"):
                yield Words("Plan", classes="heading")
                yield Words("", id="plan")
                yield Words("", id="best")
            with Vertical(id="checked", classes="pane"):
                yield Words("Checks", classes="heading")
                with VerticalScroll(id="lines"):
                    yield Words("", id="checks")

    def show_body(self) -> None:
        """The plan, and every check told so far."""
        self._work_out()
        self.query_one("#plan", Words).update(self._plan_text())
        self._show_best()
        self.query_one("#checks", Words).update("\n".join(self._lines()))
        self.query_one("#lines", VerticalScroll).scroll_end(animate=False)

    def hint(self) -> str:
        """Check, or go on."""
        run = self.desk.run
        if run.phase == "checking":
            return "Checking.  Ctrl+X stops"
        if run.phase == "ready":
            return "All checks passed, the source is off.  Ctrl+N: on to the sweep"
        if run.live:
            return "The sweep is under way.  Ctrl+N: watch it"
        if any(line.verdict == "fail" for line in run.checks) or run.fault is not None:
            return "Mend what failed, then C: check again.  P: change the plan"
        if self._search.is_running:
            return "Finding the best plan beside the screen.  B: give it up"
        if self._search.found(self.desk) is not None:
            return "P: the plan, filled with what was found.  C: check the plan that stands"
        return "C: run the checks, a gentle trial point last.  P: the plan.  B: the best one"

    def copy_text(self) -> str:
        """Plan and checks."""
        return "\n".join([self._plan_text(), *self._best_lines(), "", *self._lines()])

    def action_check(self) -> None:
        """Run the checks; on hardware only after a word, since the trial point drives."""
        run = self.desk.run
        if run.phase in ("checking", "sweeping", "paused", "ending"):
            self.notify("a session is under way; Ctrl+X stops it", severity="warning")
            return
        if run.phase == "ready":
            self.bench.keeper.finish_then(self._ask)
        else:
            self._ask()

    def _ask(self) -> None:
        from tui.bench import drives_hardware

        desk, plan = self.desk, self._planned
        try:
            if plan is None:
                self.notify("the plan is being read; once more, please", severity="warning")
                return
            if isinstance(plan, LashbenchError):
                raise plan
            real = drives_hardware(desk.url)
        except LashbenchError as error:
            self.bench.show_error("The plan is refused", error)
            return
        if not real or (desk.identity is not None and desk.identity.simulated):
            self._check()
            return
        text = (
            f"The checks end with a trial point: {desk.url} is driven with "
            f"{min(plan.levels_vpk):g} V peak at {plan.visited_hz[0]:g} Hz."
        )
        dialog = QuestionDialog("Drive the unit?", text, "Drive", no="Leave it")
        self.app.push_screen(dialog, lambda yes: self._check() if yes else None)

    def _check(self) -> None:
        self.bench.keeper.start(hold=True)
        self.show()

    def action_plan(self) -> None:
        """Change the plan; a session that holds on the old one is ended."""
        desk = self.desk
        if desk.run.phase in ("checking", "sweeping", "paused", "ending"):
            self.notify("a session is under way; its plan stays", severity="warning")
            return
        plan = None if isinstance(self._planned, LashbenchError) else self._planned
        recipe = NO_RECIPE if desk.recipe is None else desk.recipe
        found = self._search.found(desk)
        if found is None:
            dialog = PlanDialog(plan, desk.options, recipe, self._judge_plan)
        else:
            # It was found within the limits of bench and unit, whatever a recipe says.
            name, unit = ("r", "") if found.quantity == "contribution_ratio" else ("b_t", " deg")
            heading = f"Found; expected error of {name} {found.expected_std:.2g}{unit}"
            options = PlanOptions(spacing="log")
            dialog = PlanDialog(found.plan, options, NO_RECIPE, self._judge_plan, heading)
        self.app.push_screen(dialog, self._take_plan)

    @property
    def _search(self) -> PlanSearch:
        return self.bench.analyses.search

    def action_best(self) -> None:
        """Find the sweep that tells most, or give that up."""
        desk = self.desk
        if self._search.is_running:
            self._search.stop()
            self.notify("the search was given up")
            self.show()
            return
        if desk.unit is None:
            return

        def begin(minutes: float | None) -> None:
            if minutes is not None:
                desk.plan_minutes = minutes
                self._search.begin(self.bench.beside, desk, minutes, self._found)
                self.show()

        minutes = desk.plan_minutes or USUAL_MIN
        self.app.push_screen(BestPlanDialog(desk.unit.name, minutes), begin)

    def _found(self) -> None:
        if self.is_current:
            self.show()
        elif self._search.found(self.desk) is not None:
            self.notify("the best plan was found: step 3")

    def _show_search(self) -> None:
        if self.is_current and self._search.is_running:
            self._show_best()

    def _show_best(self) -> None:
        self.query_one("#best", Words).update("\n".join([*self._best_lines(), ""]))

    def _best_lines(self) -> list[str]:
        """How far the search is, or what it found."""
        search = self._search
        if search.is_running:
            left_s = self._pace.remaining_s(search.share)
            left = "" if left_s is None else f", {duration(left_s)} left"
            words = f"finding the best plan of {search.minutes:g} min"
            return [f"{words}: {100 * search.share:.0f} %{left}; B gives it up"]
        if search.fault:
            return [f"NO BEST PLAN: {search.fault}"]
        found = search.found(self.desk)
        return [] if found is None else [f"BEST of {search.minutes:g} min, {found.summary()[0]}",
                                         *found.summary()[1:]]  # fmt: skip

    def _judge_plan(self, dialog: PlanDialog, choice: PlanChoice) -> None:
        """Ask the limits beside the screen; the dialog stays open where they forbid it."""
        asked = _with_choice(replace(self.desk), choice)

        def refuse(error: LashbenchError) -> None:
            dialog.refuse(str(error))

        def accept(_request: object) -> None:
            dialog.accept(choice)

        title = "The plan is refused; the old one stays"
        self.bench.beside.do("plan change", asked.request, accept, title, refuse)

    def _take_plan(self, choice: PlanChoice | None) -> None:
        if choice is None:
            return
        # A session that holds on the old plan leaves its own on the desk when it ends.
        if self.desk.run.phase == "ready":
            self.bench.keeper.finish_then(lambda: self._apply(choice))
        else:
            self._apply(choice)

    def _apply(self, choice: PlanChoice) -> None:
        if self.bench.keeper.busy:
            self.notify("a session is under way; its plan stays", severity="warning")
            return
        _with_choice(self.desk, choice)
        self._search.put_away()
        self.show()

    def _work_out(self) -> None:
        """Have the plan made of its files beside the screen, where the desk is another."""
        desk = replace(self.desk, run=RunView(), results=Results(), reference=None)
        if desk != self._planned_for:
            self._planned = None
        elif self._is_fresh:
            return
        self._planned_for, self._is_fresh = desk, True
        self.bench.beside.do("plan", partial(_plan_of, desk), self._take_planned, "No plan")

    def _take_planned(self, planned: SweepPlan | LashbenchError) -> None:
        self._planned = planned
        self.show()

    def _plan_text(self) -> str:
        desk, plan = self.desk, self._planned
        if plan is None:
            return "reading the plan"
        if isinstance(plan, LashbenchError):
            return f"REFUSED: {plan}"
        lines = plan_words(plan, desk.url)
        lines.append(self._governed(plan))
        if desk.resume is not None:
            lines.append(f"going on with measurement {desk.resume}: only missing points are taken")
            lines.append("P: a new plan, and a new measurement, in its place")
        if desk.options.adaptive:
            lines.append("then refined around anti-resonance and resonance")
        return "\n".join(lines)

    def _governed(self, plan: SweepPlan) -> str:
        """Which files limit the sweep."""
        desk = self.desk
        parts = [f"bench {desk.bench}"]
        if desk.given_plan is None and desk.resume is None:
            recipe = desk.recipe
            parts.append("no recipe" if recipe is None else f"recipe {recipe} (P: another or none)")
        words = f"limits: unit, {', '.join(parts)}"
        if len(plan.levels_vpk) < LEVELS:
            words += f"; a diagnosis wants {LEVELS} levels"
        return words

    def _lines(self) -> list[str]:
        run = self.desk.run
        if run.phase == "none":
            return ["not checked yet; nothing has driven the source"]
        lines = [f"{_MARKS[line.verdict]} {line.name}: {line.text}" for line in run.checks]
        lines += [f"[note] {text}" for text in run.warnings]
        if run.phase == "checking":
            lines.append("[....] checking")
        elif run.phase == "ready":
            lines.append("[ ok ] all passed; the session holds with the source off")
        if run.fault is not None:
            lines.append(f"[FAIL] {run.fault}")
        elif run.finished is not None and run.finished.state != "complete":
            lines.append(f"[{run.finished.state}] {run.finished.reason}")
        return lines


def _with_choice(desk: Desk, choice: PlanChoice) -> Desk:
    """Put what was typed on a desk, in place of what was proposed or is to be gone on with."""
    known = NO_RECIPE if desk.recipe is None else desk.recipe
    if choice.recipe != known:
        desk.recipe_asked = choice.recipe
    desk.options, desk.given_plan, desk.resume = choice.options, None, None
    return desk


def _plan_of(desk: Desk) -> SweepPlan | LashbenchError:
    """The plan that a desk asks for, or why there is none."""
    try:
        return desk.plan()
    except LashbenchError as error:
        return error
