"""A production line on a screen: scan, sweep, judge, the result in large letters, next.

Owns what is shown and where typed lines go. What is asked, measured and kept is the dialogue of
`lashbench line`, which runs unchanged in a thread of its own.
"""

from __future__ import annotations

import logging
import queue
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.message import Message

from analysis.execution.pace import duration
from daq.control import SessionControl
from daq.errors import LashbenchError
from daq.session_events import SessionEvent
from daq.untrusted.visible_text import visible_line
from tui.app.dialogs.dialogs import HelpDialog
from tui.app.line.letters import large
from tui.app.run_view import RunView
from tui.app.style import STYLE
from tui.app.terminal_app import TerminalApp
from tui.app.widgets.key_footer import KeyFooter
from tui.app.widgets.plain import Caption, Field, Words
from tui.exit_codes import INTERRUPTED
from tui.line.dialogue import Dialogue, Duplicates
from tui.line.hook import Hook
from tui.line.results import Result, Results
from tui.line.tally import tally_lines
from tui.text.output import Console

if TYPE_CHECKING:
    from tui.line.unit import Line

__all__ = ["LineApp"]

_LOG = logging.getLogger("lashbench.line")
_NOTES = 200
_REDRAW_S = 0.1
_HELP = """Scan or type a serial number and press Enter: the unit is swept and judged.

Enter on an empty line goes on with a unit that is not finished.
?   counts, in the messages
.   ends the line

Ctrl+X  ends the sweep at once, the source off; the unit can be gone on with
Ctrl+Q  leaves; a sweep is ended first

Each result is on the disk before it is shown. After a crash the same command goes on with the unit
that was on the bench."""
_CLASSES = {"PASS": "-pass", "FAIL": "-fail", "STOPPED": "-fail", "FAULT": "-fail"}
_LINE_STYLE = """
#verdict { height: 7; content-align: center middle; text-align: center; text-style: bold; }
#verdict.-pass { background: #004d00; color: #ffffff; }
#verdict.-fail { background: #7a0000; color: #ffffff; }
#unit { height: auto; max-height: 5; }
#work { height: 1fr; }
#counts { width: 1fr; height: 100%; overflow-y: auto; }
#notes { width: 1fr; height: 100%; overflow-y: auto; }
#asked { height: auto; }
#question { height: auto; max-height: 3; text-style: bold; }
.-narrow #work { layout: vertical; }
.-narrow #counts { height: auto; max-height: 4; width: 100%; }
.-narrow #notes { height: 1fr; width: 100%; }
"""


class _Said(Message):
    """The dialogue said, or began, or kept something."""

    def __init__(self, act: Callable[[], None]) -> None:
        super().__init__()
        self.act = act


@dataclass(frozen=True, slots=True)
class _ScreenConsole(Console):
    """Words of the dialogue, on the screen in place of a terminal's lines."""

    app: LineApp | None = None

    def __post_init__(self) -> None:
        """No stream is touched."""

    def data(self, text: str) -> None:
        """A label, or the counts."""
        self._tell(text)

    def note(self, text: str) -> None:
        """Narration."""
        _LOG.info("%s", text)
        self._tell(text)

    def error(self, text: str) -> None:
        """What was refused."""
        _LOG.error("%s", text)
        self._tell(f"error: {text}")

    def prompt(self, text: str) -> None:
        """What is asked."""
        if (app := self.app) is not None:
            app.post_message(_Said(lambda: app.ask(text)))

    def progress(self, fraction: float, text: str = "", remaining_s: float | None = None) -> None:
        """How far a judgement is."""
        if (app := self.app) is not None:
            app.post_message(_Said(lambda: app.show_progress(fraction, text, remaining_s)))

    @contextmanager
    def unhurried(self) -> Iterator[None]:
        """Nothing here waits for a reader."""
        yield

    def _tell(self, text: str) -> None:
        if (app := self.app) is not None:
            app.post_message(_Said(lambda: app.tell(text)))


class LineApp(TerminalApp):
    """The screen of a line.

    Parameters
    ----------
    belt, results, hook, duplicates
        As for `tui.line.dialogue.Dialogue`.
    """

    TITLE = "lashbench line"
    CSS = STYLE + _LINE_STYLE
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (120, "-wide")]
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+x", "stop_source", "STOP", priority=True),
        Binding("f1", "help", "Help"),
        Binding("ctrl+q", "quit", "Leave", priority=True),
    ]

    def __init__(
        self, belt: Line, results: Results, hook: Hook | None, duplicates: Duplicates
    ) -> None:
        super().__init__()
        console = _ScreenConsole(app=self)
        self._belt = replace(belt, console=console, watcher=self)
        self._results = results
        self._dialogue = Dialogue(
            self._belt, results, hook, self, duplicates, console, is_watched=True,
            began=lambda serial: self._post(lambda: self.show_begun(serial)),
            kept=lambda result: self._post(lambda: self.show_result(result)),
        )  # fmt: skip
        self._typed: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._control = SessionControl()
        self._thread: threading.Thread | None = None
        self._run = RunView()
        self._word, self._serial, self._lines = "READY", "", list[str]()
        self._notes: deque[str] = deque(maxlen=_NOTES)
        self._is_leaving, self._is_told_to_end = False, False
        self._is_stale = False

    def run_to_end(self) -> int:
        """Show the screen until it is left, and wait for what it has under way; the exit code."""
        code = self.run()
        self._end()
        if self._thread is not None:
            self._thread.join()
        return code or 0

    # ------------------------------------------------------------ for the dialogue's thread

    def line(self) -> str | None:
        """The next line that is typed or scanned."""
        return self._typed.get()

    def control(self) -> SessionControl:
        """What the session that begins now is ended by."""
        self._control = SessionControl()
        if self._is_leaving:
            self._control.interrupt("the screen was left")
        return self._control

    def take(self, event: SessionEvent) -> None:
        """A session told something."""
        self._post(lambda: self._take(event))

    def _post(self, act: Callable[[], None]) -> None:
        self.post_message(_Said(act))

    def _work(self) -> None:
        word, said, code = "", "", 0
        try:
            code = self._dialogue.run()
            word = "STOPPED" if code == INTERRUPTED else ""
        except LashbenchError as error:
            word, said, code = "FAULT", str(error), error.exit_code
        except Exception as error:
            _LOG.exception("the line ended by a fault")
            word, said, code = "FAULT", f"internal: {type(error).__name__}: {error}", 1
        self._post(lambda: self._sitting_over(word, said, code))

    # ------------------------------------------------------------ what is shown

    def compose(self) -> ComposeResult:
        """Banner, result, counts and messages, and the line that is typed."""
        yield Words(id="banner")
        yield Words(id="verdict")
        yield Words(id="unit", classes="pane")
        with Horizontal(id="work"):
            yield Words(id="counts", classes="pane")
            yield Words(id="notes", classes="pane")
        with Vertical(classes="pane", id="asked"):
            yield Words(id="question")
            with Horizontal(classes="field"):
                yield Caption("scan or type")
                yield Field(id="line", compact=True)
        yield KeyFooter()

    def on_mount(self) -> None:
        """Begin the dialogue; the field is ready for the scanner."""
        self.query_one("#line", Field).focus()
        self.set_interval(_REDRAW_S, self._redraw)
        self._begin()

    def _begin(self) -> None:
        self._thread = threading.Thread(target=self._work, name="line")
        self._thread.start()
        self._show()

    def on__said(self, message: _Said) -> None:
        """Do in the loop what the dialogue's thread asked for."""
        message.act()
        self._is_stale = True

    def ask(self, question: str) -> None:
        """Show what is asked; a serial number needs no words."""
        self.query_one("#question", Words).update("" if question == "serial> " else question)

    def tell(self, text: str) -> None:
        """Add to the messages."""
        self._notes.extend(text.splitlines())

    def show_begun(self, serial: str) -> None:
        """A unit is being measured."""
        self._word, self._serial, self._lines = "SWEEP", serial, []
        self._run = RunView()
        self._run.begin()

    def show_progress(self, fraction: float, text: str, remaining_s: float | None) -> None:
        """A judgement is under way."""
        left = "" if remaining_s is None else f", {duration(remaining_s)} left"
        self._lines = [f"judging: {100 * fraction:.0f} % {visible_line(text)}{left}"]

    def show_result(self, result: Result) -> None:
        """A result is kept."""
        self._word, self._serial = result.verdict, result.serial
        retest = f"retest {result.attempt - 1}, " if result.attempt > 1 else ""
        self._lines = [f"{retest}#{result.measurement}, {result.elapsed_s:.0f} s", *result.reasons]

    def _take(self, event: SessionEvent) -> None:
        self._run.take(event)

    def _redraw(self) -> None:
        if self._is_stale:
            self._is_stale = False
            self._show()

    def _show(self) -> None:
        run, belt = self._run, self._belt
        parts = ["SIMULATED"] if belt.instrument.partition("?")[0].endswith("sim:") else []
        parts += [run.source_text, f"{belt.unit.name} by {belt.recipe}"]
        if run.measurement is not None:
            parts.append(f"#{run.measurement} {run.done}/{run.total}")
        banner = self.query_one("#banner", Words)
        banner.update(visible_line(" " + " | ".join(parts)))
        banner.set_class("ON" in run.source_text.split(), "-driving")
        banner.set_class("switch it off" in run.source_text, "-alarm")
        verdict = self.query_one("#verdict", Words)
        verdict.update(large(self._word, self.size.width - 4))
        verdict.set_class(_CLASSES.get(self._word) == "-pass", "-pass")
        verdict.set_class(_CLASSES.get(self._word) == "-fail", "-fail")
        lines = list(self._lines)
        if self._word == "SWEEP" and run.total and not lines:
            left = "" if run.remaining_s is None else f", {duration(run.remaining_s)} left"
            lines = [f"{run.done} of {run.total} points{left}"]
        head = f"{self._serial}: " if self._serial else "scan a serial number"
        self.query_one("#unit", Words).update("\n".join([head + "".join(lines[:1]), *lines[1:5]]))
        self.query_one("#counts", Words).update("\n".join(tally_lines(self._results.all)))
        notes = self.query_one("#notes", Words)
        room = max(notes.size.height, 1)
        self.query_one("#notes", Words).update("\n".join(list(self._notes)[-room:]))

    # ------------------------------------------------------------ what is typed

    def on_input_submitted(self, event: Field.Submitted) -> None:
        """A line, as a scanner or a person ends it."""
        text, event.input.value = event.value, ""
        self.ask("")
        if self._thread is not None and self._thread.is_alive():
            self._typed.put(text)
            return
        # The last sitting ended by a stop or a fault: what was left is asked for anew.
        self._word, self._lines = "READY", []
        if text.strip():
            self._typed.put(text)
        self._begin()

    def action_stop_source(self) -> None:
        """End the sweep at once."""
        self._run.stop_asked = True
        self._control.interrupt("stopped by the operator")
        self.notify("stopping: the source is being made safe", severity="warning")

    def stop_at_once(self) -> None:
        """The same, told by the thread that reads keys or by a signal."""
        self._control.interrupt("stopped by the operator")

    def action_help(self) -> None:
        """Keys and words."""
        self.push_screen(HelpDialog("A production line", _HELP))

    async def action_quit(self) -> None:
        """Leave; a sweep is ended first, and the dialogue with it."""
        self._end()
        if self._thread is None or not self._thread.is_alive():
            self._leave(0)

    def end_at_once(self) -> None:
        """A signal, or a terminal that is gone."""
        self._is_told_to_end = True
        self._end()
        if self._thread is None or not self._thread.is_alive():
            self._leave(INTERRUPTED)

    def _end(self) -> None:
        self._is_leaving = True
        self._control.interrupt("the screen was left")
        self._typed.put(None)

    def _sitting_over(self, word: str, said: str, code: int) -> None:
        self._run.end(None)
        if self._is_leaving or not word:
            self._leave(INTERRUPTED if self._is_told_to_end else code, said)
            return
        self._word = word
        self._lines = [said or "not finished; scan it again, or press Enter, to go on"]
        self._show()
        self.ask("Enter goes on, Ctrl+Q leaves")

    def _leave(self, code: int, said: str = "") -> None:
        self.exit(code, code, Text(visible_line(f"error: {said}")) if said else None)
