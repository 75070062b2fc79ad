"""What a session does when all goes well, and what it refuses before it begins."""

import numpy as np
import pytest
from instruments.fake_analyser import FakeAnalyser, known_gain
from instruments.session_runs import LIMITS, PLAN, again, measured, new, of

from daq.adaptive import Refinement
from daq.analyser import SourceState
from daq.errors import InputError, LimitError
from daq.limits import Limits
from daq.plan import SweepPlan
from daq.session import Session
from daq.session_events import CheckLine, Opened, PointStored, SourceSafe
from daq.session_request import SessionRequest
from daq.store import Store


def test_measurement_is_complete_with_its_response(store):
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


def test_session_acts_are_in_order(store):
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


def test_downward_sweep_descends(store):
    plan = SweepPlan(PLAN.frequencies_hz, (1.0,), direction="down")
    analyser = FakeAnalyser()
    measured(store, new(plan), analyser)
    assert [f for _, f in analyser.driven[1:]] == sorted(PLAN.frequencies_hz, reverse=True)


def test_point_is_on_disk_before_its_event(store):
    with Store(store.path, read_only=True) as reader:
        for event in Session(FakeAnalyser(), store, new()).run():
            if isinstance(event, PointStored):
                assert reader.points(1)[-1] == event.stored
                assert reader.measurement(1).state == "interrupted"
                assert reader.measurement(1).source_state is SourceState.ON


def test_progress_rises_and_its_estimate_falls(store):
    told = of(PointStored, measured(store, analyser=FakeAnalyser(point_s=0.004)))
    assert [event.done for event in told] == list(range(1, 19))
    assert {event.total for event in told} == {18}
    assert told[-1].remaining_s == 0.0
    estimates = [event.remaining_s for event in told[6:]]
    actual = [told[-1].elapsed_s - event.elapsed_s for event in told[6:]]
    np.testing.assert_allclose(estimates, actual, atol=0.06)


def test_limit_is_checked_before_sending_or_storing(store):
    analyser = FakeAnalyser()
    session = Session(analyser, store, new(SweepPlan((100.0,), (2.5,))))
    with pytest.raises(LimitError, match="source level 2.5 V peak is above the 2 V peak"):
        list(session.run())
    assert analyser.log == []
    assert store.measurements() == []


def test_resumed_measurement_obeys_present_limits(store):
    measured(store, new())
    tight = SessionRequest(None, (Limits("bench", source_vpk=0.7),), resume=1)
    analyser = FakeAnalyser()
    with pytest.raises(LimitError):
        list(Session(analyser, store, tight).run())
    assert analyser.log == []


def test_invalid_request_is_refused():
    with pytest.raises(InputError, match="either a new measurement or one to resume"):
        SessionRequest(None, LIMITS)
    with pytest.raises(InputError, match="lower frequency first"):
        again(1, remeasure_hz=(200.0, 100.0))
    with pytest.raises(InputError, match="someone to judge"):
        again(1, refinement=Refinement(0.1, 9))
