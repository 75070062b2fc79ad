"""A session that a request, its watcher or a key ends: it ends in time, and safely."""

import signal
import threading
import time

import numpy as np
import pytest
from instruments.fake_analyser import FakeAnalyser, known_gain
from instruments.session_runs import OFF, Watch, again, measured, new, of, request

from daq.analyser import SourceState
from daq.control import SessionControl
from daq.errors import InputError
from daq.frf import PointFlag
from daq.session import Session
from daq.session_events import PointStored, RunIn


def test_stop_keeps_current_point_and_can_resume(store):
    control = SessionControl()
    session = Session(FakeAnalyser(), store, new(), control)
    events = Watch(session, 5, lambda: control.stop("enough")).run()
    assert (events[-1].state, events[-1].points, events[-1].reason) == ("interrupted", 5, "enough")
    analyser = FakeAnalyser()
    rest = measured(store, again(1), analyser)
    assert rest[0].done == 5
    assert rest[-1].state == "complete"
    # Trial, the level once more from its beginning, then the rest; none marked as retaken.
    assert [f for _, f in analyser.driven[:7]] == [100.0, 100.0, 110.0, 120.0, 130.0, 140.0, 150.0]
    assert len(of(RunIn, rest)) == 5
    assert len(of(PointStored, rest)) == 13
    assert not np.any(store.response(1).flags)


def test_interrupt_ends_current_point_and_retakes_it(store):
    control = SessionControl()
    slow = FakeAnalyser({("point", 6): lambda: control.interrupt("Ctrl-C")}, point_s=0.05)
    events = measured(store, analyser=slow, control=control)
    assert (events[-1].state, events[-1].points) == ("interrupted", 4)
    assert events[-1].error is None
    measured(store, again(1))
    response = store.response(1)
    retaken = response.frequency_hz[response.flags == PointFlag.RETAKEN]
    np.testing.assert_array_equal(retaken, [140.0])
    np.testing.assert_array_equal(response.gain, [known_gain(f) for f in response.frequency_hz])
    assert store.measurement(1).flagged == 0


def test_abort_is_final_and_keeps_the_points(store):
    control = SessionControl()
    analyser = FakeAnalyser({("point", 6): lambda: control.abort("smoke")}, point_s=0.05)
    events = measured(store, analyser=analyser, control=control)
    assert (events[-1].state, events[-1].points, events[-1].reason) == ("aborted", 4, "smoke")
    assert len(store.points(1)) == 4
    with pytest.raises(InputError, match="was aborted"):
        list(Session(FakeAnalyser(), store, again(1)).run())
    assert store.measurement(1).state == "aborted"


@pytest.mark.parametrize(
    ("asked", "state"),
    [
        (("stop", "interrupt", "abort"), "aborted"),
        (("abort", "stop"), "aborted"),
        (("interrupt", "stop"), "interrupted"),
        (("stop",), "interrupted"),
    ],
)
def test_the_harder_request_wins(store, asked, state):
    control = SessionControl()
    for name in asked:
        getattr(control, name)(name)
    events = measured(store, control=control)
    assert (events[-1].state, events[-1].points) == (state, 0)


def test_request_before_first_byte_drives_nothing(store):
    control = SessionControl()
    control.interrupt()
    analyser = FakeAnalyser()
    measured(store, analyser=analyser, control=control)
    assert analyser.log == [("make_safe",)]


def test_stop_at_last_point_completes_measurement(store):
    control = SessionControl()
    session = Session(FakeAnalyser(), store, new(), control)
    assert Watch(session, 18, control.stop).run()[-1].state == "complete"


@pytest.mark.parametrize("cut", ["interrupt", "abort"])
def test_an_endless_point_is_ended_at_once(store, cut):
    control = SessionControl()
    analyser = FakeAnalyser()

    def wait():
        threading.Timer(0.3, getattr(control, cut)).start()
        analyser.wait(60.0, bound_s=60.0)

    analyser.faults[("point", 4)] = wait
    began = time.monotonic()
    finished = list(Session(analyser, store, request(), control).run())[-1]
    assert time.monotonic() - began < 2.0
    assert finished.points == 2
    assert finished.source_state is OFF


@pytest.mark.parametrize("cut", ["stop", "interrupt", "abort"])
def test_end_requested_at_any_moment_is_honoured(store, cut):
    for moment in range(1, 12):
        control = SessionControl()
        analyser = FakeAnalyser({("point", moment): getattr(control, cut)})
        finished = list(Session(analyser, store, request(), control).run())[-1]
        assert finished.source_state is OFF
        expected = "aborted" if cut == "abort" else "interrupted"
        # A stop that comes with the last point finds nothing left to stop.
        last = moment == 10 if cut == "stop" else False
        assert finished.state == ("complete" if last or moment == 11 else expected)
        assert analyser.log[-1] == ("make_safe",)
        assert analyser.level_vpk == 0.0
        assert store.measurement(finished.measurement).state == finished.state


@pytest.mark.parametrize("presses", [1, 2, 5])
def test_ctrl_c_without_handlers_keeps_safe_off(store, presses):
    """A script that uses the engine and installs no handler of its own."""
    left = [presses]
    tried = []

    def press():
        left[0] -= 1
        tried.append("safe")
        if left[0] > 0:
            analyser.faults["safe"] = press
        signal.raise_signal(signal.SIGINT)

    analyser = FakeAnalyser()

    def first():
        analyser.faults["safe"] = press
        signal.raise_signal(signal.SIGINT)

    analyser.faults[("point", 5)] = first
    with pytest.raises(KeyboardInterrupt):
        list(Session(analyser, store, request()).run())
    assert len(tried) == presses
    assert analyser.level_vpk == 0.0
    assert analyser.log[-1] == ("make_safe",)
    found = store.measurement(1)
    assert (found.state, found.source_state, found.points) == ("interrupted", OFF, 3)


def test_leaving_watcher_ends_session_safely(store):
    analyser = FakeAnalyser()
    run = Session(analyser, store, new()).run()
    for event in run:
        if isinstance(event, PointStored) and event.done == 3:
            break
    run.close()
    assert analyser.level_vpk == 0.0
    assert analyser.log[-1] == ("make_safe",)
    found = store.measurement(1)
    assert (found.state, found.source_state) == ("interrupted", SourceState.CONFIRMED_OFF)


def test_failing_watcher_ends_session_safely(store):
    analyser = FakeAnalyser()

    def watch():
        session = Session(analyser, store, request()).run()
        try:
            for event in session:
                if isinstance(event, PointStored) and event.done == 3:
                    raise ZeroDivisionError("in the watcher")
        finally:
            session.close()

    with pytest.raises(ZeroDivisionError):
        watch()
    assert analyser.level_vpk == 0.0
    assert analyser.log[-1] == ("make_safe",)
    assert store.measurement(1).points == 3
