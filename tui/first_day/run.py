"""One run of the checks: lock, watchdog, wire, signals, and a report after each finding.

Owns that the source ends off and that the report says how it ended, whatever ends it. It prints
no result.
"""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from daq.analyser import Identity, SourceState
from daq.control import Cancelled, SessionControl
from daq.driving import first_day as checks
from daq.driving.first_day import Finding, FirstDay, NotAtRest
from daq.errors import Interrupted, LashbenchError, LinkError, MeasurementError
from daq.session.bench_lock import BenchLock
from daq.session.safe_instrument import HeldInstrument
from daq.session.watch import Watch
from daq.session.watchdog import Watchdog
from tui.bench import connect, connect_wire
from tui.first_day.folder import Folder
from tui.first_day.person import Person
from tui.signals import listening

if TYPE_CHECKING:
    from daq.driving.entry import Driver
    from daq.transports.base import Transport
    from sim.unit import Unit
    from tui.text.output import Console

__all__ = ["FirstDayRun"]

_LOOK_S = 0.05
_NOT_ENDED = "not yet: the checks run, or the program was killed"


@dataclass(slots=True)
class FirstDayRun:
    """What is asked for, and what came of it.

    Parameters
    ----------
    url, unit
        Address of the instrument, and what is behind a simulated one.
    level_vpk
        Highest level driven, V peak.
    is_real
        Whether something outside of this program may move.
    """

    url: str
    unit: Unit
    level_vpk: float
    folder: Folder
    is_real: bool
    console: Console
    findings: list[Finding] = field(default_factory=list)
    ended: Literal["complete", "interrupted", "early"] = "early"
    reason: str = ""
    state: SourceState = SourceState.UNKNOWN
    """What the instrument reads back in the end."""
    contradiction: str = ""
    """Why the read-back is not to be believed; empty if nothing speaks against it."""
    error: LashbenchError | None = None
    """The fault that ended it."""

    @property
    def source(self) -> str:
        """What is known of the source in the end, in words."""
        if self.contradiction:
            return f"DISPUTED: {self.contradiction}; in the end it reads back {self.state.value}"
        return self.state.value

    @property
    def source_state(self) -> str:
        """The same in the words of the documents: confirmed-off, unconfirmed or unknown."""
        if self.contradiction or self.state is SourceState.ON:
            return SourceState.UNCONFIRMED.value
        return self.state.value

    def run(self) -> None:
        """Go through the checks of the driver.

        Raises
        ------
        LashbenchError
            If lock, watchdog or instrument cannot be had: nothing was driven, nothing is kept.
        Interrupted
            If an end was asked for before that.
        """
        control = SessionControl()
        with ExitStack() as stack:
            lock = watchdog = None
            if self.is_real:
                lock = stack.enter_context(BenchLock(self.folder.history, instrument=self.url))
            stack.enter_context(self.console.unhurried())
            stack.enter_context(listening(control, self.console.note))
            if lock is not None:
                watchdog = Watchdog(self.url, self.folder.history, lock.descriptor)
                # Twice does no harm: where the source is not proven off it was left to work.
                stack.callback(watchdog.dismiss)
            driver, transport = connect_wire(self.url, self.unit, self.folder.transcript)
            if control.cut is not None:
                transport.close()
                raise Interrupted("interrupted; nothing was sent")
            self._go_through(driver, transport, control, watchdog)

    def _go_through(
        self,
        driver: Driver,
        transport: Transport,
        control: SessionControl,
        watchdog: Watchdog | None,
    ) -> None:
        assert driver.first_day is not None
        analyser = driver.drive(transport)
        watch = watchdog or Watch()
        reopen = (lambda: connect(self.url, self.unit)) if self.is_real else None
        held = HeldInstrument(analyser, control, reopen, watch)
        person = Person(self.console.prompt, self.level_vpk)

        def listen() -> None:
            """Let whoever waits end where it is asked for, and where the watchdog took over."""
            if held.is_new_connection:
                raise LinkError(
                    f"{self.url}: the connection was lost, and opened anew to make the source safe"
                )
            held.listen()
            self._hold(control, watch)
            person.on_wait = held.analyser.on_wait or person.on_wait
            person.on_wait()

        day = FirstDay(analyser, transport, self.level_vpk, person.look, held.make_safe, listen)
        try:
            self._write(day, _NOT_ENDED)
            if watchdog is not None:
                watchdog.stand_by(control.check)
            for finding in checks.run(day, driver.first_day()):
                self.findings.append(finding)
                self._write(day, _NOT_ENDED)
                self.console.note(f"  {finding.verdict}: {finding.name}")
            self.ended = "complete"
        except Cancelled as cut:
            self.ended, self.reason = "interrupted", str(cut)
        except NotAtRest as error:
            self.error, self.contradiction = error, str(error)
        except LashbenchError as error:
            self.error = error
        except Exception as error:
            self.error = MeasurementError(f"internal error: {type(error).__name__}: {error}")
        finally:
            self.state = held.make_safe()
            held.let_go()
            analyser.close()
        self.reason = self.reason or str(self.error or "")
        ended = self.ended + (f": {self.reason}" if self.reason else "")
        self._write_last(day, ended)
        # Only where the instrument is the one that the driver drives.
        may_drive = "identity" in day.kept and self.state is not SourceState.CONFIRMED_OFF
        if watchdog is not None and may_drive:
            self._leave_it_to(watchdog, control)
            self._write_last(day, ended)

    def _hold(self, control: SessionControl, watch: Watch) -> None:
        """Between two checks the source is off: wait here for as long as somebody wants."""
        told = False
        while control.paused and control.cut is None:
            if not told:
                self.console.note("paused; the source is off")
            told = True
            time.sleep(_LOOK_S)
            watch.check()
            watch.beat()
        cut = control.cut
        if cut is not None:
            raise Cancelled(cut[1])

    def _leave_it_to(self, watchdog: Watchdog, control: SessionControl) -> None:
        self.console.note(
            f"the source is {self.state.value}; the watchdog opens the instrument anew and goes on "
            "trying; waiting for it, an interrupt ends that"
        )
        asked = control.asked
        said = watchdog.see_to_it(lambda: control.asked == asked)
        if said:
            self.console.note(f"the watchdog: source {said}")
            self.state = SourceState(said)

    def _write_last(self, day: FirstDay, ended: str) -> None:
        try:
            self._write(day, ended)
        except LashbenchError as error:
            self.error = self.error or error

    def _write(self, day: FirstDay, ended: str) -> None:
        identity = day.kept.get("identity")
        known = identity if isinstance(identity, Identity) else None
        is_over = ended is not _NOT_ENDED
        source = self.source if is_over else "not known: the program was killed, if it runs no more"
        self.folder.write(
            checks.report(
                self.url, known, self.findings, source, ended, self.folder.transcript.name
            )
        )
