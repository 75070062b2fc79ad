"""The bench application: which screen is on top, which keys hold everywhere, who gets what.

Owns the way through the steps and the one key that stops the source. It
measures and computes nothing: sessions run under `session_keeper`, analyses
under `analyses`, and a step's screen draws what the desk holds.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import SystemCommand
from textual.binding import Binding, BindingType
from textual.screen import ModalScreen, Screen

from daq.analyser import SourceState
from daq.errors import LashbenchError
from daq.servers.place import HistoryPlace
from daq.session_events import Finished, PointStored, RunIn
from daq.untrusted.visible_text import visible, visible_line
from tui.app import messages
from tui.app.copied import keep_copy
from tui.app.dialogs.dialogs import KEYS, ErrorDialog, HelpDialog, QuestionDialog
from tui.app.plot.bode import BodePlot
from tui.app.run_view import RunView
from tui.app.screens import SCREENS
from tui.app.screens.instrument_screen import InstrumentScreen
from tui.app.state import bench_owner
from tui.app.state.analyses import Analyses
from tui.app.state.analysis_keeper import AnalysisKeeper
from tui.app.state.background import Beside
from tui.app.state.desk import Desk
from tui.app.state.session_keeper import SessionKeeper
from tui.app.state.sessions import one_session
from tui.app.state.undo import Undo
from tui.app.step_screen import STEPS, StepScreen
from tui.app.style import STYLE
from tui.app.system_commands import system_commands
from tui.app.terminal_app import TerminalApp
from tui.exit_codes import INTERRUPTED

if TYPE_CHECKING:
    from daq.store_records import Measurement

__all__ = ["BenchApp"]

_REDRAW_S = 0.1
"""Points are drawn at most this often, however fast they come."""
_LOG = logging.getLogger("lashbench.screen")


class BenchApp(TerminalApp):
    """The bench screen.

    Parameters
    ----------
    db
        File of the bench's history.
    analyses
        What is called for results; the real ones if left out.
    find
        Lists instruments; the real search if left out.
    log
        Where the log goes, for messages that point to it.
    bench
        Name or path of the bench file.
    judge
        Name or path of the limits to judge by; empty for those of bench or unit.
    """

    TITLE = "lashbench"
    CSS = STYLE
    SCREENS = dict(SCREENS)
    NOTIFICATION_TIMEOUT = 3.0
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            "ctrl+x", "stop_source", "STOP", id="stop", priority=True,
            tooltip="End whatever drives, at once; the measurement can be resumed",
        ),
        Binding("f1", "help", "Help", id="help", tooltip="What this step is for, and its keys"),
        Binding("ctrl+y", "copy", "Copy", id="copy", show=False, tooltip="Copy what is shown"),
        *(Binding(str(n), f"go({n})", name, show=False) for n, name in enumerate(STEPS, start=1)),
    ]  # fmt: skip

    def __init__(
        self,
        db: HistoryPlace = Path("lashbench.db"),
        analyses: Analyses | None = None,
        find: Callable[[bench_owner.Post], None] = bench_owner.find_instruments,
        log: Path | None = None,
        bench: str = "default",
        judge: str = "",
    ) -> None:
        super().__init__()
        self.desk = Desk(db, bench=bench, judge_by=judge)
        self.undo = Undo(self.desk)
        self.keeper = SessionKeeper(self)
        self.analyses = AnalysisKeeper(self, analyses or Analyses())
        self.beside = Beside(self)
        self._find = find
        self._log_file = log
        self._stale = False
        self._told_to_end = False

    # ------------------------------------------------------------ the way through

    def on_mount(self) -> None:
        """Steps ready, first one on top, nothing connected."""
        self.push_screen(STEPS[0])
        self.set_interval(_REDRAW_S, self._redraw)

    def on_unmount(self) -> None:
        """Whatever took the screen away: nobody could stop a session any more."""
        if self.desk.run.live:
            self.keeper.stop_now()

    def action_go(self, step: int) -> None:
        """Go to a step by number."""
        self.go(step)

    def go(self, step: int) -> None:
        """Put a step on top, if what it needs is there; else say what is missing."""
        if not 1 <= step <= len(STEPS) or isinstance(self.screen, ModalScreen):
            return
        missing = self._missing(step)
        if missing:
            self.notify(missing, severity="warning")
        elif self.screen is not self.get_screen(STEPS[step - 1]):
            self.switch_screen(STEPS[step - 1])

    def _missing(self, step: int) -> str:
        desk, here = self.desk, self.screen
        if isinstance(here, StepScreen) and here.STEP < step != 7 and (unread := here.unread()):
            return unread
        if step > 1 and step != 7 and desk.unit is None:
            return "choose a unit first"
        if step == 3 and desk.identity is None:
            return "connect an instrument first: step 2"
        if step == 4 and desk.run.phase == "none":
            return "the checks come first: step 3"
        if step in (5, 6) and desk.measurement is None:
            return "no measurement yet: sweep first, or open one in step 7"
        return ""

    # ------------------------------------------------------------ keys everywhere

    def stop_at_once(self) -> None:
        """End the session in hand, called by the thread that reads keys or by a signal handler."""
        self.keeper.cut()

    def action_stop_source(self) -> None:
        """The one key that stops the source."""
        self.notify(self.keeper.stop_now(), severity="warning")
        self.redraw_now()

    def action_help(self) -> None:
        """Explain the step on top."""
        screen = self.screen
        if isinstance(screen, StepScreen):
            title = f"Step {screen.STEP}: {STEPS[screen.STEP - 1]}"
            plots = f"{BodePlot.KEYS}\n\n" if screen.query(BodePlot) else ""
            self.push_screen(HelpDialog(title, f"{screen.HELP.strip()}\n\n{plots}{KEYS}"))

    def action_copy(self) -> None:
        """Copy the step's result; it is written to a file too, for terminals that take none."""
        screen = self.screen
        text = visible(screen.copy_text()) if isinstance(screen, StepScreen) else ""
        if not text:
            self.notify("there is nothing to copy here yet")
            return
        self.copy_to_clipboard(text)
        work = partial(keep_copy, self._log_file, text)
        self.beside.do("copy", work, self.notify, "The copy was not kept")

    async def action_quit(self) -> None:
        """Leave; a session in hand is ended first, safe, if that is meant."""
        if not self.keeper.busy:
            self._leave()
            return
        text = "A session is under way. It will be ended, the source off; it can be resumed."
        dialog = QuestionDialog("Quit?", text, "End it and quit", no="Stay")
        self.push_screen(dialog, lambda yes: self._end_and_leave() if yes else None)

    def _end_and_leave(self) -> None:
        self.keeper.interrupt_then(self._leave)

    def end_at_once(self) -> None:
        """A signal, or a terminal that is gone: nobody may be there to read a dialog."""
        self._told_to_end = True
        self._end_and_leave()

    def _leave(self) -> None:
        self.analyses.give_up()
        self.analyses.search.stop()
        run, code, line = self.desk.run, INTERRUPTED if self._told_to_end else 0, None
        if run.source not in (None, SourceState.CONFIRMED_OFF):
            code, line = LashbenchError.exit_code, f"error: {run.source_text}"
            _LOG.error("left with %s", run.source_text)
        self.exit(code, code, line and Text(visible_line(line)))

    def get_system_commands(self, screen: Screen) -> Iterable[SystemCommand]:
        """The palette: steps, keys of the step, and what Textual offers."""
        yield from system_commands(self, screen)
        for command in super().get_system_commands(screen):
            if command.title != "Screenshot":
                yield command

    # ------------------------------------------------------------ what people must know

    def show_error(self, title: str, error: Exception | str) -> None:
        """A dialog with an error whose text can be copied; no traceback."""
        text = str(error)
        if isinstance(error, Exception) and not isinstance(error, LashbenchError):
            _LOG.error(title, exc_info=error)
            text = (
                f"{type(error).__name__}: {error}\nThis is a fault of lashbench. {self.log_words}"
            )
        self.push_screen(ErrorDialog(title, text))

    @property
    def log_words(self) -> str:
        """Where whoever wants to know more should look."""
        return f"The log has it all: {self._log_file}" if self._log_file else "Please report it."

    def _fatal_error(self) -> None:
        error = self._exception
        _LOG.critical("the screen ended by a fault", exc_info=error)
        self.keeper.stop_now()
        self.analyses.give_up()
        line = f"error: internal: {type(error).__name__}: {error}. {self.log_words}"
        self._exit_renderables.append(Text(visible_line(line)))
        self._close_messages_no_wait()

    # ------------------------------------------------------------ sessions

    def on_session_told(self, message: messages.SessionTold) -> None:
        """Remember what a session told; points are drawn by the clock, the rest at once."""
        event = message.event
        self.desk.run.take(event)
        if isinstance(event, Finished):
            self.keeper.settle(event)
            self.undo.settle()
        if isinstance(event, PointStored | RunIn):
            self._stale = True
        else:
            self.redraw_now()

    def on_session_preloaded(self, message: messages.SessionPreloaded) -> None:
        """Draw what is there already."""
        self.desk.run.preload(message.points)
        self.redraw_now()

    def on_session_refused(self, message: messages.SessionRefused) -> None:
        """Nothing was begun; what was there of the session before is still so."""
        self.keeper.put_back()
        self.keeper.released()
        self.redraw_now()
        self.show_error("Nothing was started", message.error)

    def on_session_ended(self, message: messages.SessionEnded) -> None:
        """The instrument is free again; faults and a source not proven off need a decision."""
        run = self.desk.run
        run.end(message.error)
        self.redraw_now()
        finished = run.finished
        proven = finished is None or finished.source_state is SourceState.CONFIRMED_OFF
        if finished is not None and not proven:
            self.show_error(
                "SWITCH THE SOURCE OFF BY HAND",
                f"{run.source_text}. The session ended ({finished.reason}) and the source could "
                "not be proven off.",
            )
        elif message.error is not None:
            self._show_fault(message.error, finished)
        elif finished is not None:
            self.notify(f"{finished.state}: {finished.points} points, source confirmed off")
        # Whoever wanted to leave, or to go on, is to read that first.
        self.keeper.released(follow=proven or self._told_to_end)

    def _show_fault(self, error: Exception, finished: Finished | None) -> None:
        if finished is None:
            if self.desk.run.measurement is None:
                self.keeper.put_back()
                self.redraw_now()
            self.show_error("The session did not begin", error)
            return
        more = f"{finished.points} points are kept, the source is confirmed off."
        if finished.points and finished.state == "interrupted":
            more += " Go on with R in step 4, now or later."
        if isinstance(error, LashbenchError):
            self.show_error("The session was interrupted", f"{error}\n\n{more}")
        else:
            self.show_error("The session was interrupted", error)

    def on_instrument_found(self, message: messages.InstrumentFound) -> None:
        """Someone answered."""
        self.desk.identity, self.desk.link_fault = message.identity, ""
        self.desk.run.source = message.source
        self.keeper.released()
        self.redraw_now()

    def on_instrument_failed(self, message: messages.InstrumentFailed) -> None:
        """Nobody did; the step says what to try."""
        self.desk.identity = None
        self.keeper.released()
        self.desk.link_fault = str(message.error)
        self.redraw_now()

    def on_source_stopped(self, message: messages.SourceStopped) -> None:
        """The recipe ran outside of a session."""
        self.desk.run.source, self.desk.run.source_vpk = message.state, None
        proven = message.state is SourceState.CONFIRMED_OFF
        self.keeper.released(follow=proven or self._told_to_end)
        self.redraw_now()
        if not proven:
            self.show_error("SWITCH THE SOURCE OFF BY HAND", message.text)
        else:
            self.notify("source confirmed off")

    # ------------------------------------------------------------ analyses

    def on_analysis_progressed(self, message: messages.AnalysisProgressed) -> None:
        """Drawn by the clock."""
        self.analyses.progressed(message)
        self._stale = True

    def on_analysis_done(self, message: messages.AnalysisDone) -> None:
        """Drawn at once."""
        self.analyses.done(message)
        self.redraw_now()

    def on_analysis_failed(self, message: messages.AnalysisFailed) -> None:
        """As well."""
        self.analyses.failed(message)
        self.redraw_now()

    # ------------------------------------------------------------ history and search

    def find_instruments(self) -> None:
        """List instruments beside the screen."""
        work = partial(self._find, self.post_message)
        self.run_worker(work, thread=True, group="search", exit_on_error=False)

    def on_instruments_listed(self, message: messages.InstrumentsListed) -> None:
        """Show what a search found."""
        screen = self.get_screen("instrument")
        if isinstance(screen, InstrumentScreen) and screen.is_mounted:
            screen.listed(message)

    def on_work_done(self, message: messages.WorkDone) -> None:
        """Go on with what was read."""
        self.beside.done(message)

    def open_session(self, measurement: int) -> None:
        """Read a stored measurement and look at it."""
        read = partial(one_session, self.desk.db, measurement)
        self.beside.do("session", read, self.open_measurement, "It cannot be opened")

    def open_measurement(self, measurement: Measurement) -> None:
        """Look at a stored measurement: its result is the next screen."""
        if self.keeper.busy:
            self.notify("a session is under way; stop it first", severity="warning")
            return
        try:
            self.desk.choose_unit_of(measurement)
        except LashbenchError as error:
            self.show_error("The measurement cannot be opened", error)
            return
        self.desk.resume = self.desk.given_plan = None
        self.analyses.view(measurement.id)
        self.go(5)

    def put_away(self) -> None:
        """Another unit is on the desk: results and session of the one before are not about it."""
        self.desk.run = RunView(source=self.desk.run.source)
        self.desk.reference = None
        self.analyses.view(None)

    def redraw_now(self) -> None:
        """Draw the step on top."""
        self._stale = False
        for screen in [one for one in self.screen_stack if isinstance(one, StepScreen)][-1:]:
            if screen.is_mounted and screen.query("#banner"):
                screen.show()

    def _redraw(self) -> None:
        if self._stale:
            self.redraw_now()
