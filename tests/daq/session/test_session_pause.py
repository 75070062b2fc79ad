"""A pause: the source is off in it, and what was begun goes on or ends as asked."""

import threading

import numpy as np
import pytest
from instruments.fake_analyser import FakeAnalyser
from instruments.session_runs import Watch, new, of

from daq.analyser import SourceState
from daq.control import SessionControl
from daq.session import Session
from daq.session_events import GoingOn, Paused, PointStored, RunIn, Warned


def test_pause_switches_source_off_then_runs_in(store):
    control, analyser = SessionControl(), FakeAnalyser()
    seen_off = []

    def hold():
        control.pause()
        threading.Timer(0.15, go_on).start()

    def go_on():
        seen_off.append(analyser.level_vpk == 0.0 and analyser.log[-1] == ("make_safe",))
        control.go_on()

    events = Watch(Session(analyser, store, new(), control), 4, hold).run()
    kinds = [type(e) for e in events if isinstance(e, PointStored | RunIn | Paused | GoingOn)]
    assert kinds == ([PointStored] * 4 + [Paused, GoingOn] + [RunIn] * 4 + [PointStored] * 14)
    assert seen_off == [True]
    assert of(Paused, events)[0].source_state is SourceState.CONFIRMED_OFF
    assert events[-1].state == "complete"
    assert not np.any(store.response(1).flags)


def test_pause_counts_as_no_measuring_time(store):
    control, paused_s = SessionControl(), 2.0

    def hold():
        control.pause()
        threading.Timer(paused_s, control.go_on).start()

    session = Session(FakeAnalyser(point_s=0.01), store, new(), control)
    told = of(PointStored, Watch(session, 6, hold).run())
    assert told[6].elapsed_s - told[5].elapsed_s > paused_s
    for event in told[6:]:
        assert event.remaining_s == pytest.approx(told[-1].elapsed_s - event.elapsed_s, abs=0.5)


@pytest.mark.parametrize(
    ("cut", "state"), [("stop", "interrupted"), ("interrupt", "interrupted"), ("abort", "aborted")]
)
def test_any_end_request_ends_a_pause(store, cut, state):
    control = SessionControl()

    def hold():
        control.pause()
        threading.Timer(0.05, getattr(control, cut)).start()

    events = Watch(Session(FakeAnalyser(), store, new(), control), 4, hold).run()
    assert (events[-1].state, events[-1].points) == (state, 4)


def test_pause_reports_unproven_source_off(store):
    control = SessionControl()
    safe = (SourceState.CONFIRMED_OFF, SourceState.UNCONFIRMED, SourceState.CONFIRMED_OFF)
    analyser = FakeAnalyser(safe=safe)

    def hold():
        control.pause()
        threading.Timer(0.05, control.go_on).start()

    events = Watch(Session(analyser, store, new(), control), 4, hold).run()
    assert of(Paused, events)[0].source_state is SourceState.UNCONFIRMED
    assert "unconfirmed in the pause" in of(Warned, events)[0].text
