"""Starting, holding and ending sessions for the application; one thing at a time on the instrument.

Owns the control of the session in hand, whether the instrument's worker is
busy, and what is to follow when it is free again. It draws nothing; what
people must know it hands to the application.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from tui.app.run_view import RunView
from tui.app.state import bench_owner
from tui.app.state.host import Host

if TYPE_CHECKING:
    from daq.session_events import Finished

__all__ = ["SessionKeeper"]


class SessionKeeper:
    """The sessions of one application.

    Parameters
    ----------
    app
        Whose workers run them and whose desk says what to do.
    """

    def __init__(self, app: Host) -> None:
        from daq.control import SessionControl

        self._app = app
        self._control = SessionControl()
        self._then: Callable[[], None] | None = None
        self._before = RunView()
        self.busy = False
        """Whether the instrument's worker has something to do."""

    # ------------------------------------------------------------ on the worker

    def look(self) -> None:
        """Ask who answers at the desk's address."""
        desk = self._app.desk
        if desk.unit is not None and self._free("the instrument is in use; wait, or stop it"):
            self._work(partial(bench_owner.look_at, self._app.post_message, desk.url, desk.unit))

    def start(self, hold: bool, remeasure_hz: tuple[float, float] | None = None) -> bool:
        """Begin a session; whether it is on its way.

        Parameters
        ----------
        hold
            Wait after the checks, source off, until `go_on`.
        remeasure_hz
            Band to take again, of the measurement that the desk resumes.
        """
        from daq.control import SessionControl

        desk = self._app.desk
        if desk.unit is None or not self._free("a session is under way; stop it first"):
            return False
        run = RunView(hold=hold, source=desk.run.source)
        # In this order: whoever sees a session that lives finds its own control.
        self._control = SessionControl()
        if hold:
            self._control.pause()
        run.begin()
        # Files and the history are read by the worker, from the desk as it is now.
        asked = partial(replace(desk).request, remeasure_hz)
        self._before, desk.run = desk.run, run
        work = partial(
            bench_owner.run_session,
            self._app.post_message, desk.url, desk.unit, desk.db, asked, self._control,
        )  # fmt: skip
        self._work(work)
        return True

    def stop_now(self) -> str:
        """End whatever drives, at once; says in words what is done."""
        desk = self._app.desk
        self._then = None
        if desk.run.live:
            desk.run.stop_asked = True
            self._control.interrupt("stopped by the operator")
            return "stopping: the source is being made safe"
        if self.busy:
            self._then = self._app.action_stop_source
            return "the source is switched off as soon as the instrument has answered"
        if desk.identity is None or desk.unit is None:
            return "no instrument is connected; nothing can drive"
        work = partial(bench_owner.stop_source, self._app.post_message, desk.url, desk.unit)
        self._work(work)
        return "switching the source off"

    def cut(self) -> None:
        """End the session in hand at once; may be called from any thread, and waits for nothing."""
        if self._app.desk.run.live:
            self._control.interrupt("stopped by the operator")

    # ------------------------------------------------------------ requests to the session

    def pause(self) -> None:
        """Hold after the point in hand."""
        self._control.pause()

    def go_on(self) -> None:
        """Go on after a hold."""
        self._control.go_on()

    def abort(self) -> None:
        """End at once and for good."""
        self._app.desk.run.stop_asked = True
        self._control.abort()

    @property
    def pausing(self) -> bool:
        """Whether a pause is asked for."""
        return self._control.paused

    def finish_then(self, then: Callable[[], None]) -> None:
        """Do something when the instrument is free; a session ends after its point."""
        if not self.busy:
            then()
            return
        self._then = then
        self._control.stop("stopped for what comes next")

    def interrupt_then(self, then: Callable[[], None]) -> None:
        """As `finish_then`, without waiting for the point in hand."""
        if not self.busy:
            then()
            return
        self.stop_now()
        self._then = then

    # ------------------------------------------------------------ told by the application

    def released(self, follow: bool = True) -> None:
        """The worker is done; what was to follow follows, if it may."""
        self.busy = False
        then, self._then = self._then, None
        if follow and then is not None:
            then()

    def put_back(self) -> None:
        """The session never began: what was there of the one before is still so."""
        self._app.desk.run = self._before

    def settle(self, finished: Finished) -> None:
        """Put what came of a session on the desk."""
        desk = self._app.desk
        desk.resume = desk.given_plan = None
        if finished.points:
            self._app.analyses.view(finished.measurement)
        if finished.state == "interrupted":
            desk.resume = finished.measurement
            desk.given_plan = desk.run.plan

    def _free(self, complaint: str) -> bool:
        if self.busy:
            self._app.notify(complaint, severity="warning")
        return not self.busy

    def _work(self, work: Callable[[], None]) -> None:
        self.busy = True
        self._app.run_worker(
            work, thread=True, group="instrument", name="instrument", exit_on_error=False
        )
