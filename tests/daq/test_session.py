"""What a session does when all goes well, and what it does when a person wants otherwise."""

import threading

import numpy as np
import pytest
from fake_analyser import FakeAnalyser, known_gain

from daq.adaptive import Refinement
from daq.analyser import Identity, SourceState
from daq.control import SessionControl
from daq.errors import InputError, LimitError, MeasurementError
from daq.frf import PointFlag
from daq.limits import Limits
from daq.plan import SweepPlan, spaced_frequencies
from daq.session import Session
from daq.session_events import (
    CheckLine,
    Finished,
    GoingOn,
    Opened,
    Paused,
    PointStored,
    RunIn,
    SourceSafe,
    Warned,
)
from daq.session_request import SessionRequest
from daq.store import Store
from daq.store_records import MeasurementHeader

PLAN = SweepPlan(
    spaced_frequencies(100.0, 180.0, 9), (0.5, 1.0), settle_cycles=2, integrate_cycles=3
)
LIMITS = (Limits("bench", source_vpk=2.0, start_hz=10.0, stop_hz=500.0, duration_s=100.0),)


@pytest.fixture
def store(tmp_path):
    with Store(tmp_path / "bench.db", create=True) as opened:
        yield opened


def new(plan: SweepPlan = PLAN, **changes) -> SessionRequest:
    header = MeasurementHeader("ADSS", "7", plan, "fake:", "lashbench test")
    return SessionRequest(**({"header": header, "limits": LIMITS} | changes))


def again(measurement: int, **changes) -> SessionRequest:
    return SessionRequest(header=None, limits=LIMITS, resume=measurement, **changes)


def of(kind, events) -> list:
    return [event for event in events if isinstance(event, kind)]


def measured(store, request=None, analyser=None, control=None) -> list:
    analyser = analyser or FakeAnalyser()
    events = list(Session(analyser, store, request or new(), control).run())
    assert analyser.level_vpk == 0.0
    assert analyser.log[-1] == ("make_safe",)
    assert isinstance(events[-1], Finished)
    return events


class Watch:
    """Runs a session and acts on its control when a number of points is there."""

    def __init__(self, session, points: int, act):
        self.session, self.points, self.act = session, points, act

    def run(self) -> list:
        events = []
        for event in self.session.run():
            events.append(event)
            if isinstance(event, PointStored) and event.done == self.points:
                self.act()
        return events


def test_a_measurement_is_complete_and_holds_the_response(store):
    events = measured(store)
    finished = events[-1]
    assert (finished.state, finished.source_state) == ("complete", SourceState.CONFIRMED_OFF)
    assert (finished.points, finished.flagged) == (18, 0)
    assert finished.error is None
    response = store.response(finished.measurement)
    np.testing.assert_array_equal(response.gain, [known_gain(f) for f in response.frequency_hz])
    np.testing.assert_array_equal(response.levels_vpk, [0.5, 1.0])
    found = store.measurement(finished.measurement)
    assert (found.state, found.source_state) == ("complete", SourceState.CONFIRMED_OFF)
    assert found.instrument.serial == "MY1"
    assert found.readback == {"SWE:STIM": "5 CYCLE"}


def test_the_order_of_things(store):
    analyser = FakeAnalyser()
    events = measured(store, analyser=analyser)
    assert [entry[0] for entry in analyser.log] == [
        "identify",
        "source_state",
        "make_safe",
        "prepare",
        "sweep",
        "prepare",
        "sweep",
        "prepare",
        "sweep",
        "make_safe",
    ]
    assert isinstance(events[0], Opened)
    assert [line.name for line in of(CheckLine, events)] == [
        "limits",
        "identity",
        "options",
        "source",
        "trial point",
        "input range 1",
        "input range 2",
    ]
    assert isinstance(events[-2], SourceSafe)
    # The trial is driven at the lowest level and is no point of the measurement.
    assert analyser.driven[0] == (0.5, 100.0)
    assert analyser.driven[1:] == [(v, f) for v in (0.5, 1.0) for f in PLAN.frequencies_hz]


def test_downwards_is_downwards(store):
    plan = SweepPlan(PLAN.frequencies_hz, (1.0,), direction="down")
    analyser = FakeAnalyser()
    measured(store, new(plan), analyser)
    assert [f for _, f in analyser.driven[1:]] == sorted(PLAN.frequencies_hz, reverse=True)


def test_every_point_is_on_disk_before_it_is_told(store):
    with Store(store.path, read_only=True) as reader:
        for event in Session(FakeAnalyser(), store, new()).run():
            if isinstance(event, PointStored):
                assert reader.points(1)[-1] == event.stored
                assert reader.measurement(1).state == "interrupted"
                assert reader.measurement(1).source_state is SourceState.ON


def test_progress_counts_up_and_its_estimate_down_to_nothing(store):
    told = of(PointStored, measured(store, analyser=FakeAnalyser(point_s=0.004)))
    assert [event.done for event in told] == list(range(1, 19))
    assert {event.total for event in told} == {18}
    assert told[-1].remaining_s == 0.0
    estimates = [event.remaining_s for event in told[6:]]
    actual = [told[-1].elapsed_s - event.elapsed_s for event in told[6:]]
    np.testing.assert_allclose(estimates, actual, atol=0.06)


def test_a_limit_is_checked_before_anything_is_sent_or_stored(store):
    analyser = FakeAnalyser()
    session = Session(analyser, store, new(SweepPlan((100.0,), (2.5,))))
    with pytest.raises(LimitError, match="source level 2.5 V peak is above the 2 V peak"):
        list(session.run())
    assert analyser.log == []
    assert store.measurements() == []


def test_a_resumed_measurement_is_held_to_the_limits_of_now(store):
    measured(store, new())
    tight = SessionRequest(None, (Limits("bench", source_vpk=0.7),), resume=1)
    analyser = FakeAnalyser()
    with pytest.raises(LimitError):
        list(Session(analyser, store, tight).run())
    assert analyser.log == []


# ---------------------------------------------------------------- stop, interrupt, abort


def test_stop_keeps_the_point_in_hand_and_can_be_resumed(store):
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


def test_interrupt_ends_the_point_in_hand_at_once_and_it_is_retaken(store):
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


def test_what_is_asked_before_the_first_byte_is_honoured_without_driving(store):
    control = SessionControl()
    control.interrupt()
    analyser = FakeAnalyser()
    measured(store, analyser=analyser, control=control)
    assert analyser.log == [("make_safe",)]


def test_a_stop_with_the_last_point_leaves_a_complete_measurement(store):
    control = SessionControl()
    session = Session(FakeAnalyser(), store, new(), control)
    assert Watch(session, 18, control.stop).run()[-1].state == "complete"


def test_a_watcher_who_leaves_ends_the_session_safely(store):
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


# ---------------------------------------------------------------- pause


def test_a_pause_switches_the_source_off_and_goes_on_with_a_run_in(store):
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


@pytest.mark.parametrize(
    ("cut", "state"), [("stop", "interrupted"), ("interrupt", "interrupted"), ("abort", "aborted")]
)
def test_a_pause_gives_way_to_any_end(store, cut, state):
    control = SessionControl()

    def hold():
        control.pause()
        threading.Timer(0.05, getattr(control, cut)).start()

    events = Watch(Session(FakeAnalyser(), store, new(), control), 4, hold).run()
    assert (events[-1].state, events[-1].points) == (state, 4)


def test_a_pause_that_cannot_prove_the_source_off_says_so(store):
    control = SessionControl()
    safe = (SourceState.CONFIRMED_OFF, SourceState.UNCONFIRMED, SourceState.CONFIRMED_OFF)
    analyser = FakeAnalyser(safe=safe)

    def hold():
        control.pause()
        threading.Timer(0.05, control.go_on).start()

    events = Watch(Session(analyser, store, new(), control), 4, hold).run()
    assert of(Paused, events)[0].source_state is SourceState.UNCONFIRMED
    assert "unconfirmed in the pause" in of(Warned, events)[0].text


# ---------------------------------------------------------------- resume and measuring again


def test_resuming_what_is_complete_only_looks_at_the_source(store):
    measured(store)
    analyser = FakeAnalyser()
    events = measured(store, again(1), analyser)
    assert (events[-1].state, events[-1].points) == ("complete", 18)
    assert analyser.driven == []
    assert [line.name for line in of(CheckLine, events)][-1] == "source"


def test_resuming_what_is_not_there(store):
    with pytest.raises(InputError, match="measurement 5 is not in"):
        list(Session(FakeAnalyser(), store, again(5)).run())


def test_after_a_kill_the_point_that_was_in_hand_is_marked(store):
    # A killed program leaves its measurement as it last wrote it.
    run = Session(FakeAnalyser(), store, new()).run()
    for event in run:
        if isinstance(event, PointStored) and event.done == 12:
            break
    copy = Store(store.path)
    before = copy.measurement(1)
    assert before.source_state is SourceState.ON
    events = measured(copy, again(1))
    assert events[-1].state == "complete"
    flags = {(p.source_vpk, p.requested_hz): p.point.flags for p in copy.points(1)}
    assert [key for key, flag in flags.items() if flag] == [(1.0, 130.0)]
    copy.close()
    run.close()


def test_a_band_measured_again_supersedes_and_keeps_the_old_points(store):
    measured(store)
    analyser = FakeAnalyser(gain=lambda f: 2.0 * known_gain(f))
    events = measured(store, again(1, remeasure_hz=(115.0, 135.0)), analyser)
    assert events[0].done == 14
    assert [e.stored.requested_hz for e in of(PointStored, events)] == [120.0, 130.0] * 2
    assert (events[-1].state, events[-1].points) == ("complete", 18)
    response = store.response(1)
    inside = (response.frequency_hz > 115.0) & (response.frequency_hz < 135.0)
    expected = np.array([known_gain(f) for f in response.frequency_hz])
    np.testing.assert_allclose(response.gain, np.where(inside, 2.0, 1.0) * expected)
    every = store.points(1, superseded=True)
    assert len(every) == 22
    assert sum(p.superseded_by is not None for p in every) == 4


def test_a_band_without_points_changes_nothing(store):
    measured(store)
    analyser = FakeAnalyser()
    measured(store, again(1, remeasure_hz=(300.0, 400.0)), analyser)
    assert analyser.driven == []


def test_a_run_in_point_that_does_not_repeat_is_told(store):
    control = SessionControl()
    Watch(Session(FakeAnalyser(), store, new(), control), 5, control.stop).run()
    changed = FakeAnalyser(gain=lambda f: 1.1 * known_gain(f))
    events = measured(store, again(1), changed)
    (warning,) = of(Warned, events)
    assert "5 points came again within 0.83 dB" in warning.text
    assert "conditions are not those of before" in warning.text
    assert [e.kind for e in store.events(1)].count("warning") == 1


@pytest.mark.parametrize("points", [0, 2, 100])
def test_a_shorter_run_in_can_be_asked_for(store, points):
    control = SessionControl()
    Watch(Session(FakeAnalyser(), store, new(), control), 14, control.stop).run()
    analyser = FakeAnalyser()
    measured(store, again(1, run_in_points=points), analyser)
    lead = [100.0, 110.0, 120.0, 130.0, 140.0][5 - min(points, 5) :]
    assert analyser.driven[1:] == [(1.0, f) for f in [*lead, 150.0, 160.0, 170.0, 180.0]]


def test_other_settings_than_before_are_told(store):
    control = SessionControl()
    Watch(Session(FakeAnalyser(), store, new(), control), 5, control.stop).run()
    events = measured(store, again(1), FakeAnalyser(readback={"SWE:STIM": "6 CYCLE"}))
    assert "SWE:STIM reads 6 CYCLE, and read 5 CYCLE" in of(Warned, events)[0].text


def test_another_instrument_is_told_and_a_simulated_one_refused(store):
    control = SessionControl()
    Watch(Session(FakeAnalyser(), store, new(), control), 5, control.stop).run()
    other = Identity("HEWLETT-PACKARD", "35670A", "MY2", "A.1", ("1D2",))
    simulated = Identity("HEWLETT-PACKARD", "35670A", "SIM", "A.1", ("1D2",), simulated=True)
    with pytest.raises(MeasurementError, match="begun on a real instrument"):
        list(Session(FakeAnalyser(identity=simulated), store, again(1)).run())
    events = measured(store, again(1), FakeAnalyser(identity=other))
    assert any(line.verdict == "note" and "MY1" in line.text for line in of(CheckLine, events))
    assert store.measurement(1).instrument.serial == "MY1"


# ---------------------------------------------------------------- refinement


def judge(points):
    """Both features, known the better the more points there are."""
    std_hz = 10.0 / len(points)
    return [(125.0, std_hz, 5.0), (153.0, std_hz, 5.0)]


def test_refinement_goes_on_after_the_plan_and_survives_a_stop(store):
    refinement = Refinement(target_std_hz=0.5, budget_points=30)
    plan = SweepPlan(PLAN.frequencies_hz, (1.0,))
    request = new(plan, refinement=refinement, judge=judge)
    whole = FakeAnalyser()
    measured(store, request, whole)
    frequencies = [f for _, f in whole.driven[1:]]
    assert len(set(frequencies)) > 20
    control = SessionControl()
    Watch(Session(FakeAnalyser(), store, request, control), 15, control.stop).run()
    measured(store, again(2, refinement=refinement, judge=judge))
    one, two = store.response(1), store.response(2)
    np.testing.assert_array_equal(one.frequency_hz, two.frequency_hz)
    np.testing.assert_array_equal(one.gain, two.gain)


def test_a_request_that_makes_no_sense_is_refused():
    with pytest.raises(InputError, match="either a new measurement or one to resume"):
        SessionRequest(None, LIMITS)
    with pytest.raises(InputError, match="lower frequency first"):
        again(1, remeasure_hz=(200.0, 100.0))
    with pytest.raises(InputError, match="someone to judge"):
        again(1, refinement=Refinement(0.1, 9))
