"""The bench session: an engine that measures, journals, yields, and always ends safe.

Owns the order of a measurement and its invariants: limits before the first
byte, checks before the first volt, a point committed before anyone is told,
the source off whenever nothing is measured and at every end there is. It
talks to no person: whoever iterates it watches, whoever holds its control may
hold it, stop it or abort it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

from daq.adaptive import AdaptiveSweep
from daq.analyser import Analyser, PointSettings, SourceState, SweepPoint
from daq.control import Cancelled, SessionControl
from daq.errors import Interrupted, LashbenchError, MeasurementError
from daq.frf import PointFlag
from daq.preflight import (
    check_identity,
    check_source,
    check_trial,
    check_wire,
    limits_line,
    take_trial,
)
from daq.session.agenda import Pace
from daq.session.history import HeldHistory
from daq.session.points import end_early, next_point
from daq.session.recorder import Journal, Place
from daq.session.repeatability import compare
from daq.session.safe_instrument import HeldInstrument
from daq.session.watch import Watch
from daq.session_events import (
    Finished,
    GoingOn,
    LevelStarted,
    Opened,
    Paused,
    PointStored,
    RunIn,
    SessionEvent,
    SourceSafe,
    Warned,
)
from daq.session_request import SessionRequest
from daq.store import Store
from daq.store_records import MeasurementState
from daq.untrusted.bounded_calls import Aside

__all__ = ["Session"]

_LOOK_S = 0.05
"""How long a pause sleeps before it looks at the control again."""
_REFINED_RUN_IN = 8
"""Points of the plan driven before those that refinement asks for."""
_JUDGING_S = 300.0
"""Announced while it is computed, at level 0, where refinement goes on."""


class Session:
    """One run of a measurement; iterate `run` once.

    Parameters
    ----------
    analyser
        Connected. The session makes it safe and does not close it.
    store
        Open history, writable.
    request
        What to do.
    control
        Where a person asks for a pause or an end; one of its own if left out.
    reopen
        Connects to the same instrument once more, for making it safe when the
        connection was lost; None where there is no such way.
    watch
        Who stands by to make the source safe in the session's place; nobody if left out.
    aside
        Where calls of the history are made, which may never return; its own if left out.
    """

    def __init__(
        self,
        analyser: Analyser,
        store: Store,
        request: SessionRequest,
        control: SessionControl | None = None,
        reopen: Callable[[], Analyser] | None = None,
        watch: Watch | None = None,
        aside: Aside | None = None,
    ) -> None:
        self.control = control or SessionControl()
        self.finished: Finished | None = None
        """How it ended, also where nobody was there any more to be told."""
        self._watch = watch or Watch()
        self._instrument = HeldInstrument(analyser, self.control, reopen, self._watch)
        self._store = HeldHistory(store, aside or Aside("history"), self.control, self._watch)
        self._request = request
        self._pace = Pace()
        self._in_hand: Place | None = None
        self._all_taken = False
        self._refining = False
        self._unwritten: list[str] = []

    def run(self) -> Generator[SessionEvent, None, None]:
        """Measure, yielding what happens; the last record is `Finished`.

        Closing the iterator early ends the session as an interruption does.

        Raises
        ------
        LimitError
            If a limit forbids the plan; nothing was sent and nothing stored.
        InputError
            If the measurement to resume is not there or was aborted.
        Interrupted
            If an end was asked for before the measurement had its place in the history.
        LashbenchError
            After `Finished`: the fault that ended the session, if one did.
        """
        self._began_s = time.monotonic()
        try:
            self._journal = Journal(self._store, self._request)
        except Cancelled as cut:
            raise Interrupted(f"{cut}; nothing was driven") from cut
        self._plan, self._agenda = self._journal.plan, self._journal.agenda
        error: Exception | None = None
        try:
            yield self._opened()
            self._instrument.listen()
            yield from self._check()
            yield from self._measure()
        except Cancelled:
            pass
        except Exception as fault:
            error = self._cause_of(fault)
        except BaseException:
            # Whoever watched has left, or the program is told to end: the source is off before.
            self._close(None)
            self._instrument.let_go()
            raise
        finished = self._close(error)
        self._instrument.let_go()
        yield SourceSafe(finished.source_state)
        for text in self._unwritten:
            yield Warned(text)
        yield finished
        if finished.error is not None:
            raise finished.error

    # ------------------------------------------------------------ checks

    def _opened(self) -> Opened:
        agenda = self._agenda
        return Opened(
            self._journal.id, self._plan, agenda.done, agenda.total, agenda.remaining_cycles_s
        )

    def _check(self) -> Iterator[SessionEvent]:
        journal = self._journal
        yield from journal.told([limits_line(self._plan, self._request.limits)])
        self.control.check()
        identity = self._instrument.analyser.identify()
        yield from journal.told(
            check_identity(identity, journal.before.instrument if journal.before else None)
        )
        journal.instrument(identity)
        yield from journal.told(check_source(self._instrument.analyser))
        journal.source(SourceState.CONFIRMED_OFF)
        self.control.check()
        nothing_to_drive = self._agenda.finished and self._request.refinement is None
        if nothing_to_drive or self.control.cut is not None:
            return
        self._watch.stand_by(self.control.check)
        self._watch.beat()
        journal.source(SourceState.ON)
        point, trial = take_trial(
            self._instrument.analyser, self._plan, self._settings(min(self._plan.levels_vpk))
        )
        journal.note(
            "trial point",
            f"{point.frequency_hz:g} Hz at {trial.source_vpk:g} V peak",
            gain_re=point.gain.real,
            gain_im=point.gain.imag,
            flags=int(point.flags),
        )
        yield from journal.told(check_wire(self._instrument.analyser))
        yield from journal.told(check_trial(point, trial, self._plan, self._request.plausible))

    # ------------------------------------------------------------ measuring

    def _measure(self) -> Iterator[SessionEvent]:
        for level in self._plan.levels_vpk:
            for frequencies in self._rounds(level):
                self._agenda.extend(level, frequencies)
                while run := self._agenda.next_run(level, frequencies):
                    if self.control.paused:
                        yield from self._hold()
                    if self.control.cut is not None:
                        return
                    yield from self._sweep(level, run)
        self._all_taken = True

    def _rounds(self, source_vpk: float) -> Iterator[Sequence[float]]:
        """The frequencies of the plan, then those of refinement; stored ones may be among them."""
        request = self._request
        if request.refinement is None or request.judge is None:
            yield [float(hz) for hz in self._plan.visited_hz]
            return
        adaptive = AdaptiveSweep(self._plan, request.refinement, request.judge)
        self._refining = False
        while frequencies := adaptive.ask():
            yield frequencies
            self._refining = True
            self._watch.beat(_JUDGING_S)
            adaptive.tell([self._agenda.stored(source_vpk, hz).point for hz in frequencies])
        self._refining = False
        self._journal.note(
            "refinement",
            f"{adaptive.reason} at {source_vpk:g} V peak after {len(adaptive.points)} points",
        )

    def _sweep(self, source_vpk: float, run: Sequence[float]) -> Iterator[SessionEvent]:
        """Drive neighbouring points, with a run-in where the level was under way already."""
        plan = self._plan
        readback = self._instrument.analyser.prepare(
            min(plan.frequencies_hz), max(plan.frequencies_hz), self._settings(source_vpk)
        )
        yield from self._journal.settings(readback)
        lead = self._lead(source_vpk, run[0])
        self._journal.source(SourceState.ON)
        yield LevelStarted(source_vpk, len(run))
        yield from self._remarks()
        points = self._instrument.analyser.sweep([*lead, *run])
        try:
            yield from self._run_in(source_vpk, lead, points)
            if self.control.cut is not None:
                return
            for requested_hz in run:
                self._in_hand = source_vpk, requested_hz
                yield self._commit(self._in_hand, next_point(points, requested_hz))
                yield from self._remarks()
                if self.control.paused or self.control.cut is not None:
                    return
            if next(points, None) is not None:
                raise MeasurementError("the instrument gave more points than were asked for")
        finally:
            end_early(points)

    def _commit(self, place: Place, point: SweepPoint) -> PointStored:
        if place in self._journal.retake:
            point = replace(point, flags=point.flags | PointFlag.RETAKEN)
        before_s = self._agenda.remaining_cycles_s
        stored = self._store.add_point(self._journal.id, *place, point)
        self._in_hand = None
        self._agenda.store(stored)
        left_s = self._agenda.remaining_cycles_s
        return PointStored(
            stored,
            self._agenda.done,
            self._agenda.total,
            time.monotonic() - self._began_s,
            self._pace.remaining_s(before_s - left_s, left_s),
        )

    def _lead(self, source_vpk: float, first_hz: float) -> list[float]:
        """What is driven again before the sweep goes on, for the motion to arrive as it would."""
        if self._refining:
            return self._agenda.coarse_run_in(source_vpk, first_hz, _REFINED_RUN_IN)
        return self._agenda.run_in(source_vpk, first_hz, self._request.run_in_points)

    def _run_in(
        self, source_vpk: float, lead: Sequence[float], points: Iterator[SweepPoint]
    ) -> Iterator[SessionEvent]:
        pairs = []
        for requested_hz in lead:
            point = next_point(points, requested_hz)
            pairs.append((point, self._agenda.stored(source_vpk, requested_hz).point))
            yield RunIn(source_vpk, *pairs[-1])
            if self.control.cut is not None:
                return
        repeated = compare(pairs)
        if repeated is not None:
            self._journal.note("run-in", f"at {source_vpk:g} V peak: {repeated}")
            if repeated.differs:
                yield self._journal.warned(
                    f"driven again at {source_vpk:g} V peak: {repeated}; the conditions are not "
                    "those of before"
                )

    def _hold(self) -> Iterator[SessionEvent]:
        state = self._make_safe()
        self._pace.held()
        self._journal.source(state)
        self._journal.note("pause", f"holding; source {state.value}")
        if state is SourceState.CONFIRMED_OFF:
            self._watch.rest()
        yield Paused(state)
        if state is not SourceState.CONFIRMED_OFF:
            yield self._journal.warned(
                f"the source is {state.value} in the pause; switch it off by hand"
            )
        while self.control.paused and self.control.cut is None:
            time.sleep(_LOOK_S)
            self._watch.check()
            if state is not SourceState.CONFIRMED_OFF:
                self._watch.beat()
            yield from self._remarks()
        if self.control.cut is None:
            self._instrument.listen()
            self._journal.note("go on", "after a pause")
            yield GoingOn()

    def _remarks(self) -> Iterator[SessionEvent]:
        """Pass on what happened to the watchdog."""
        for text in self._watch.remarks():
            yield self._journal.warned(text)

    def _settings(self, source_vpk: float) -> PointSettings:
        return PointSettings(
            source_vpk=source_vpk,
            settle_cycles=self._plan.settle_cycles,
            integrate_cycles=self._plan.integrate_cycles,
            dc_offset_v=self._plan.dc_offset_v,
            slew_vpk_per_s=self._request.slew_vpk_per_s,
            input_range_vpk=self._request.input_range_vpk,
        )

    # ------------------------------------------------------------ the end

    def _close(self, error: Exception | None) -> Finished:
        """Make safe before anything else can fail, then say in the store how it ended."""
        self._store.is_closing = True
        source_state = self._make_safe()
        if source_state is SourceState.CONFIRMED_OFF:
            self._watch.rest()
        state, reason = self._verdict(error)
        points, flagged = self._agenda.done + self._agenda.again, 0
        try:
            found = self._journal.end(state, source_state, reason, self._in_hand)
            points, flagged = found.points, found.flagged
        except LashbenchError as fault:
            # Without its last line the measurement stands as interrupted, and what came first,
            # a fault or the wish to end, is the one to tell.
            if state == "complete" or self.control.cut is None:
                error = error or fault
            elif error is None:
                self._unwritten.append(f"its end is not in the history: {fault}")
            state = "interrupted"
        self.finished = Finished(
            measurement=self._journal.id,
            state=state,
            source_state=source_state,
            points=points,
            flagged=flagged,
            elapsed_s=time.monotonic() - self._began_s,
            reason=reason,
            error=error,
        )
        return self.finished

    def _cause_of(self, fault: Exception) -> Exception:
        """What a fault comes from: an instrument that was taken away answers anything."""
        try:
            self._watch.check()
        except MeasurementError as lost:
            lost.__cause__ = None if lost is fault else fault
            return lost
        return fault

    def _verdict(self, error: Exception | None) -> tuple[MeasurementState, str]:
        cut = self.control.cut
        if cut is not None and cut[0] == "abort":
            return "aborted", cut[1]
        if error is not None:
            return "interrupted", str(error)
        if self._all_taken:
            return "complete", "all points are taken"
        return "interrupted", cut[1] if cut is not None else "nobody watched any more"

    def _make_safe(self) -> SourceState:
        had_new = self._instrument.is_new_connection
        state = self._instrument.make_safe()
        if self._instrument.is_new_connection and not had_new:
            # A journal that cannot be written does not change what is known.
            with suppress(LashbenchError):
                self._journal.note("reconnected", f"over a new connection: source {state.value}")
        return state
