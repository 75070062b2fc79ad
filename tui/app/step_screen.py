"""The frame that every step's screen stands in: trail, banner, body, hint, keys.

Owns what all steps have in common. A step fills the body, names what to press
next, and redraws itself from the desk when the application tells it to.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, ClassVar, cast

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container
from textual.content import Content
from textual.events import Key
from textual.screen import Screen
from textual.style import Style

from daq.analyser import SourceState
from daq.errors import LashbenchError
from tui.app.command_lines import commands_of
from tui.app.dialogs.dialogs import CommandDialog
from tui.app.dialogs.limits import LimitsDialog
from tui.app.widgets.key_footer import KeyFooter
from tui.app.widgets.plain import Caption, Field, Words

if TYPE_CHECKING:
    from tui.app.app_state import AppState
    from tui.app.state.desk import Desk

__all__ = ["STEPS", "StepScreen"]

STEPS = ("unit", "instrument", "check", "sweep", "result", "diagnosis", "history")
"""The steps in order; `_TITLES` are their names for people."""
_TITLES = ("Unit", "Instrument", "Check", "Sweep", "Result", "Diagnosis", "Report")
_WIDE = 100
_SIDE = 140
"""Columns from which on master and detail stand side by side."""

_TALL = 34


class StepScreen(Screen[None]):
    """A step; final classes say what is in it.

    `STEP` is its number from 1, `HELP` what F1 says about it.
    """

    STEP: ClassVar[int] = 0
    HELP: ClassVar[str] = ""
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (_WIDE, "-wide"), (_SIDE, "-side")]
    VERTICAL_BREAKPOINTS = [(0, "-short"), (_TALL, "-tall")]
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+n", "next", "Next", id="step.next", tooltip="Go on to the next step"),
        Binding("escape", "back", "Back", id="step.back", tooltip="Go back one step", show=False),
        Binding(
            "z,ctrl+z",
            "undo",
            "Undo",
            id="step.undo",
            show=False,
            tooltip="Undo the last entry: unit, remarks, bench, limits, address, plan",
        ),
        Binding(
            "j",
            "judge",
            "Judge by",
            id="step.judge",
            show=False,
            tooltip="Choose the limits that decide PASS, FAIL or UNDECIDED",
        ),
        Binding(
            "f2",
            "command",
            "Command",
            id="step.command",
            show=False,
            tooltip="The lashbench commands that do the same",
        ),
    ]

    @property
    def bench(self) -> AppState:
        """The application, as far as a step may ask it."""
        return cast("AppState", self.app)

    @property
    def desk(self) -> Desk:
        """What was chosen so far."""
        return self.bench.desk

    def compose(self) -> ComposeResult:
        """The frame, with the step's own widgets in it."""
        yield Words(id="step-bar")
        yield Words(id="banner")
        with Container(id="body"):
            yield from self.body()
        yield Words(id="hint")
        yield KeyFooter(compact=True)

    def body(self) -> ComposeResult:
        """The step's own widgets."""
        yield from ()

    def on_mount(self) -> None:
        """First drawing; what is drawn has the colours of the theme."""
        self.app.theme_changed_signal.subscribe(self, lambda _: self._redraw_if_on_top())
        self.arrive()
        self.show()

    def _redraw_if_on_top(self) -> None:
        if self.is_current:
            self.show()

    def on_screen_resume(self) -> None:
        """Back on top."""
        if self.is_mounted and self.query("#banner"):
            # Whoever comes by a key has commands in mind, and not the field of before.
            self.leave_field()
            self.arrive()
            self.show()

    async def on_key(self, event: Key) -> None:
        """A letter is the same key with Shift: the hints print capitals."""
        if not (len(event.key) == 1 and event.key.isupper()):
            return
        found = self.active_bindings.get(event.key.lower())
        if found is not None and found.enabled:
            event.stop()
            await self.app.run_action(found.binding.action, found.node)

    def arrive(self) -> None:
        """Called whenever the step comes on top."""

    def show(self) -> None:
        """Draw everything anew from the desk."""
        self._show_frame()
        self.show_body()

    def show_body(self) -> None:
        """Draw the step's own widgets from the desk."""

    def hint(self) -> str:
        """What to press next, in words."""
        return ""

    def copy_text(self) -> str:
        """The step's result as text, for the clipboard."""
        return ""

    def action_next(self) -> None:
        """Go on to the next step."""
        self.bench.go(self.STEP + 1)

    def action_back(self) -> None:
        """Leave the field that is typed into, else go back one step."""
        if not self.leave_field():
            self.bench.go(self.STEP - 1)

    @property
    def typing_into(self) -> str | None:
        """The caption of the field that has the focus; None where keys are commands."""
        field = self.focused
        if not isinstance(field, Field) or field.parent is None:
            return None
        return str(field.parent.query_one(Caption).content)

    def leave_field(self) -> bool:
        """Move the focus from a field to what takes commands; whether there was one."""
        if not isinstance(self.focused, Field):
            return False
        others = [one for one in self.focus_chain if not isinstance(one, Field)]
        self.set_focus(others[0] if others else None)
        return True

    def action_undo(self) -> None:
        """Put back what stood before the last entry; nothing that was measured is touched."""
        bench = self.bench
        if bench.keeper.busy:
            self.notify("a session is under way; its entries stay", severity="warning")
            return
        unit, url = self.desk.unit, self.desk.url
        undone = bench.undo.back()
        if not undone:
            self.notify("there is no entry to undo")
            return
        if self.desk.unit is not unit:
            bench.put_away()
        if self.desk.url != url:
            self.desk.identity, self.desk.link_fault = None, ""
        self.notify(f"undone: {', '.join(undone)}")
        self.arrive()
        self.show()

    def action_judge(self) -> None:
        """Choose the limits to judge by; a wrong file keeps the dialog open."""

        def read(dialog: LimitsDialog, named: str) -> None:
            choice = replace(self.desk.limits_choice, asked=named)

            def refuse(error: LashbenchError) -> None:
                dialog.refuse(str(error))

            def accept(_found: object) -> None:
                dialog.accept(named)

            self.bench.beside.do("limits", choice.read, accept, "Not judged by it", refuse)

        def take(named: str | None) -> None:
            if named is not None:
                self.desk.judge_by = named
                self.bench.analyses.judge()
                self.arrive()
                self.show()

        self.app.push_screen(LimitsDialog(self.desk.judge_by, read), take)

    def action_command(self) -> None:
        """Show the commands of a shell that do what this step does."""
        desk = replace(self.desk)

        def tell(lines: list[str]) -> None:
            self.app.push_screen(CommandDialog("The same on the command line", lines))

        work = partial(commands_of, self.STEP, desk)
        self.bench.beside.do("command", work, tell, "There is no command")

    def unread(self) -> str:
        """What was typed on this step and not taken yet; the way on waits for it."""
        return ""

    def _show_frame(self) -> None:
        self.bench.undo.note()
        self.query_one("#step-bar", Words).update(_trail(self.STEP))
        banner = self.query_one("#banner", Words)
        banner.update(self.desk.banner_text())
        source = self.desk.run.source
        alarm = source in (SourceState.UNCONFIRMED, SourceState.UNKNOWN)
        banner.set_class(source is SourceState.ON, "-driving")
        banner.set_class(alarm, "-alarm")
        self.query_one("#hint", Words).update(f"> {self.hint()}" if self.hint() else "")


def _trail(here: int) -> Content:
    """The steps by name, the one on top marked, the others to be clicked."""
    parts: list[str | tuple[str, str | Style]] = []
    for number, title in enumerate(_TITLES, start=1):
        if parts:
            parts.append("  ")
        if number == here:
            parts.append((f"[{number} {title}]", "reverse bold"))
        else:
            action = Style.from_meta({"@click": f"app.go({number})"})
            parts.append((f"{number} {title}", action))
    return Content.assemble(*parts)
