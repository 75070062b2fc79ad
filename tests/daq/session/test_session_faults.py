"""Whatever breaks in the analyser: the session keeps the points and is truthful of the source."""

import pytest
from instruments.fake_analyser import FakeAnalyser, known_gain
from instruments.session_runs import NO_LIMITS, OFF, UNCONFIRMED, UNKNOWN, broken, request

from daq.analyser import SourceState
from daq.errors import (
    BenchTimeout,
    InstrumentError,
    LimitError,
    LinkError,
    MeasurementError,
    ProtocolError,
)
from daq.frf import PointFlag
from daq.session import Session
from daq.session_events import CheckLine
from daq.session_request import SessionRequest

ERRORS = [
    LinkError("cable pulled"),
    ProtocolError("garbage came"),
    BenchTimeout("no reply"),
    InstrumentError("-240 hardware"),
    MeasurementError("parked"),
    LimitError("out of band"),
    RuntimeError("a mistake of ours"),
]
every_error = pytest.mark.parametrize("fault", ERRORS, ids=lambda e: type(e).__name__)


@pytest.mark.parametrize("fault", ERRORS[::3], ids=lambda e: type(e).__name__)
@pytest.mark.parametrize(
    ("moment", "kept"),
    [
        ("identify", 0),
        ("source_state", 0),
        ("prepare", 0),
        (("point", 1), 0),
        (("point", 2), 0),
        (("point", 6), 4),
        (("after", 6), 5),
        (("point", 10), 8),
        (("after", 10), 9),
    ],
)
def test_fault_at_any_moment_switches_off(store, fault, moment, kept):
    analyser = FakeAnalyser({moment: fault})
    finished, error = broken(store, analyser)
    assert error is fault
    assert (finished.state, finished.points, finished.source_state) == ("interrupted", kept, OFF)
    assert analyser.level_vpk == 0.0
    assert str(fault) in finished.reason
    # Nothing stands in the way of going on, up to the same result as without the fault.
    rest = SessionRequest(None, NO_LIMITS, resume=1)
    assert list(Session(FakeAnalyser(), store, rest).run())[-1].state == "complete"
    response = store.response(1)
    assert list(response.gain) == [known_gain(f) for f in response.frequency_hz]


def test_expired_wait_ends_session(store):
    analyser = FakeAnalyser()
    analyser.faults[("point", 4)] = lambda: analyser.wait(60.0, bound_s=0.1)
    finished, error = broken(store, analyser)
    assert isinstance(error, BenchTimeout)
    assert finished.points == 2


@every_error
def test_raising_safe_off_proves_nothing(store, fault):
    analyser = FakeAnalyser({("point", 6): LinkError("gone")})
    analyser.faults["safe"] = None

    def break_safe():
        analyser.faults["safe"] = fault

    analyser.faults[("point", 5)] = break_safe
    finished, error = broken(store, analyser)
    assert finished.source_state is UNKNOWN
    assert str(error) == "gone"


@pytest.mark.parametrize("state", [UNCONFIRMED, UNKNOWN, SourceState.ON])
def test_unproven_source_is_not_called_off(store, state):
    analyser = FakeAnalyser({("point", 6): LinkError("gone")}, safe=(OFF, state))
    finished, _ = broken(store, analyser)
    assert finished.source_state is state


@pytest.mark.parametrize("state", [UNCONFIRMED, UNKNOWN, SourceState.ON])
def test_unproven_source_off_drives_nothing(store, state):
    analyser = FakeAnalyser(safe=(state,))
    finished, error = broken(store, analyser)
    assert "switch it off by hand" in str(error)
    assert analyser.driven == []
    assert finished.source_state is state


def test_source_found_driving_is_switched_off_first(store):
    analyser = FakeAnalyser(found=SourceState.ON)
    events = list(Session(analyser, store, request()).run())
    lines = [e for e in events if isinstance(e, CheckLine) and e.name == "source"]
    assert [line.verdict for line in lines] == ["note", "pass"]
    assert "was found driving" in lines[0].text
    names = [entry[0] for entry in analyser.log]
    assert names.index("make_safe") < names.index("prepare")


def test_spoilt_point_keeps_flag_and_sweep_continues(store):
    flags = {4: PointFlag.OVERLOAD, 6: PointFlag.SPOILT}
    finished = list(Session(FakeAnalyser(flags=flags), store, request()).run())[-1]
    assert (finished.state, finished.points, finished.flagged) == ("complete", 9, 2)
    assert [int(p.point.flags) for p in store.points(1)] == [0, 0, 1, 0, 16, 0, 0, 0, 0]


def test_missing_points_are_an_error(store):
    class Short(FakeAnalyser):
        def sweep(self, frequencies_hz):
            return super().sweep(frequencies_hz[:4])

    finished, error = broken(store, Short())
    assert "ended its sweep before the point at 140 Hz" in str(error)
    assert finished.points == 4


def test_surplus_points_are_an_error(store):
    class Long(FakeAnalyser):
        def sweep(self, frequencies_hz):
            more = [200.0] if len(frequencies_hz) > 1 else []
            return super().sweep([*frequencies_hz, *more])

    finished, error = broken(store, Long())
    assert "more points than were asked for" in str(error)
    assert finished.points == 9
