"""Whatever breaks: the session ends in time, keeps the points, and is truthful of the source."""

import signal
import sqlite3
import threading
import time

import pytest
from fake_analyser import FakeAnalyser, known_gain

from daq.analyser import SourceState
from daq.control import SessionControl
from daq.errors import (
    BenchTimeout,
    InstrumentError,
    LimitError,
    LinkError,
    MeasurementError,
    ProtocolError,
)
from daq.frf import PointFlag
from daq.limits import Limits
from daq.plan import SweepPlan, spaced_frequencies
from daq.preflight import Plausibility
from daq.session import Session
from daq.session_events import CheckLine, Finished, PointStored
from daq.session_request import SessionRequest
from daq.store import Store
from daq.store_records import MeasurementHeader

PLAN = SweepPlan(spaced_frequencies(100.0, 180.0, 9), (0.5,), settle_cycles=2, integrate_cycles=3)
LIMITS = (Limits("bench"),)
OFF, UNCONFIRMED, UNKNOWN = (
    SourceState.CONFIRMED_OFF,
    SourceState.UNCONFIRMED,
    SourceState.UNKNOWN,
)


@pytest.fixture
def store(tmp_path):
    with Store(tmp_path / "bench.db", create=True) as opened:
        yield opened


def request(plan: SweepPlan = PLAN, **changes) -> SessionRequest:
    header = MeasurementHeader("ADSS", "7", plan, "fake:", "lashbench test")
    return SessionRequest(header, LIMITS, **changes)


def broken(store, analyser, wanted=None, control=None) -> tuple[Finished, Exception]:
    """Run a session that must fail; its last record and its error."""
    events, error = [], None
    try:
        for event in Session(analyser, store, wanted or request(), control).run():
            events.append(event)
    except Exception as fault:
        error = fault
    assert error is not None
    finished = events[-1]
    assert isinstance(finished, Finished)
    assert finished.error is error
    assert analyser.log[-1] == ("make_safe",)
    kept = [e.stored for e in events if isinstance(e, PointStored)]
    assert store.points(1) == kept
    assert finished.points == len(kept)
    found = store.measurement(1)
    assert (found.state, found.source_state) == (finished.state, finished.source_state)
    assert store.events(1)[-1].kind == "end"
    return finished, error


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
def test_a_fault_at_any_moment(store, fault, moment, kept):
    analyser = FakeAnalyser({moment: fault})
    finished, error = broken(store, analyser)
    assert error is fault
    assert (finished.state, finished.points, finished.source_state) == ("interrupted", kept, OFF)
    assert analyser.level_vpk == 0.0
    assert str(fault) in finished.reason
    # Nothing stands in the way of going on, up to the same result as without the fault.
    rest = SessionRequest(None, LIMITS, resume=1)
    assert list(Session(FakeAnalyser(), store, rest).run())[-1].state == "complete"
    response = store.response(1)
    assert list(response.gain) == [known_gain(f) for f in response.frequency_hz]


@every_error
def test_a_safe_off_that_raises_against_its_promise_proves_nothing(store, fault):
    analyser = FakeAnalyser({("point", 6): LinkError("gone")})
    analyser.faults["safe"] = None

    def break_safe():
        analyser.faults["safe"] = fault

    analyser.faults[("point", 5)] = break_safe
    finished, error = broken(store, analyser)
    assert finished.source_state is UNKNOWN
    assert str(error) == "gone"


@pytest.mark.parametrize("state", [UNCONFIRMED, UNKNOWN, SourceState.ON])
def test_what_cannot_be_proven_is_not_called_off(store, state):
    analyser = FakeAnalyser({("point", 6): LinkError("gone")}, safe=(OFF, state))
    finished, _ = broken(store, analyser)
    assert finished.source_state is state


@pytest.mark.parametrize("state", [UNCONFIRMED, UNKNOWN, SourceState.ON])
def test_nothing_is_driven_while_the_source_is_not_proven_off(store, state):
    analyser = FakeAnalyser(safe=(state,))
    finished, error = broken(store, analyser)
    assert "switch it off by hand" in str(error)
    assert analyser.driven == []
    assert finished.source_state is state


def test_a_source_found_driving_is_switched_off_first_and_said(store):
    analyser = FakeAnalyser(found=SourceState.ON)
    events = list(Session(analyser, store, request()).run())
    lines = [e for e in events if isinstance(e, CheckLine) and e.name == "source"]
    assert [line.verdict for line in lines] == ["note", "pass"]
    assert "was found driving" in lines[0].text
    names = [entry[0] for entry in analyser.log]
    assert names.index("make_safe") < names.index("prepare")


@pytest.mark.parametrize(
    ("gain", "said"),
    [
        (lambda f: 0.0, "exactly zero"),
        (lambda f: 1e-5, "is below -80 dB"),
        (lambda f: 2e3, "is above 60 dB"),
        (lambda f: complex("nan"), "no number"),
        (lambda f: complex("inf"), "no number"),
    ],
)
def test_an_implausible_trial_point_ends_it(store, gain, said):
    analyser = FakeAnalyser(gain=gain)
    finished, error = broken(store, analyser)
    assert said in str(error)
    assert "check cables" in str(error)
    assert len(analyser.driven) == 1
    assert finished.points == 0


def test_an_overloaded_trial_point_ends_it(store):
    _, error = broken(store, FakeAnalyser(flags={1: PointFlag.OVERLOAD}))
    assert "an input is overloaded" in str(error)


def test_a_judge_of_the_trial_point_is_heard(store):
    wanted = request(plausible=Plausibility(judge=lambda point: "no servo answers like this"))
    _, error = broken(store, FakeAnalyser(), wanted)
    assert "no servo answers like this" in str(error)


def test_a_fixed_range_that_will_be_too_small_is_noted(store):
    plan = SweepPlan((120.0, 140.0), (0.1, 4.0))
    wanted = request(plan, input_range_vpk=(5.0, 0.5))
    events = list(Session(FakeAnalyser(gain=lambda f: 0.3), store, wanted).run())
    lines = {e.name: e for e in events if isinstance(e, CheckLine)}
    assert lines["input range 1"].verdict == "pass"
    assert lines["input range 2"].verdict == "note"
    assert "overloads will be flagged" in lines["input range 2"].text


def test_a_spoilt_point_stays_with_its_flag_and_the_sweep_goes_on(store):
    flags = {4: PointFlag.OVERLOAD, 6: PointFlag.SPOILT}
    finished = list(Session(FakeAnalyser(flags=flags), store, request()).run())[-1]
    assert (finished.state, finished.points, finished.flagged) == ("complete", 9, 2)
    assert [int(p.point.flags) for p in store.points(1)] == [0, 0, 1, 0, 16, 0, 0, 0, 0]


def test_fewer_points_than_asked_for(store):
    class Short(FakeAnalyser):
        def sweep(self, frequencies_hz):
            return super().sweep(frequencies_hz[:4])

    finished, error = broken(store, Short())
    assert "ended its sweep before the point at 140 Hz" in str(error)
    assert finished.points == 4


def test_more_points_than_asked_for(store):
    class Long(FakeAnalyser):
        def sweep(self, frequencies_hz):
            more = [200.0] if len(frequencies_hz) > 1 else []
            return super().sweep([*frequencies_hz, *more])

    finished, error = broken(store, Long())
    assert "more points than were asked for" in str(error)
    assert finished.points == 9


def test_a_full_disk_stops_the_source_and_keeps_the_points(tmp_path):
    path = tmp_path / "bench.db"
    analyser = FakeAnalyser()
    store = Store(path, create=True)
    events = []

    def fill_the_disk():
        with store._writer.connect() as connection:
            pages = connection.exec_driver_sql("PRAGMA page_count").scalar_one()
            connection.exec_driver_sql(f"PRAGMA max_page_count = {pages}")

    plan = SweepPlan(spaced_frequencies(100.0, 180.0, 900), (0.5,))
    analyser.faults[("point", 20)] = fill_the_disk

    def run():
        for event in Session(analyser, store, request(plan)).run():
            events.append(event)

    with pytest.raises(MeasurementError, match="disk refused the data"):
        run()
    assert analyser.level_vpk == 0.0
    assert analyser.log[-1] == ("make_safe",)
    finished = events[-1]
    assert (finished.state, finished.source_state) == ("interrupted", OFF)
    kept = [e.stored for e in events if isinstance(e, PointStored)]
    assert 18 <= len(kept) < 900
    store.close()
    with Store(path) as again:
        assert again.points(1) == kept
        assert again.measurement(1).state == "interrupted"


def test_a_store_that_fails_at_the_end_does_not_hide_what_came_first(store, monkeypatch):
    def refuse(*_args):
        raise MeasurementError("disk gone")

    monkeypatch.setattr(store, "finish", refuse)
    analyser = FakeAnalyser({("point", 6): LinkError("cable pulled")})
    events = []

    def run():
        events.extend(Session(analyser, store, request()).run())

    with pytest.raises(LinkError, match="cable pulled"):
        run()
    assert analyser.log[-1] == ("make_safe",)


def test_a_store_that_fails_at_the_very_end_is_told(store, monkeypatch):
    def refuse(*_args):
        raise MeasurementError("disk gone")

    monkeypatch.setattr(store, "finish", refuse)
    analyser = FakeAnalyser()
    with pytest.raises(MeasurementError, match="disk gone"):
        list(Session(analyser, store, request()).run())
    assert analyser.log[-1] == ("make_safe",)
    assert store.measurement(1).state == "interrupted"


def test_another_program_that_holds_the_file_is_survived_or_told(store, monkeypatch):
    monkeypatch.setattr("daq.store_file._BUSY_S", 0.2)
    blocker = sqlite3.connect(store.path, isolation_level=None)
    analyser = FakeAnalyser({("point", 6): lambda: blocker.execute("BEGIN IMMEDIATE")})
    with Store(store.path) as quick, pytest.raises(MeasurementError, match="held by another"):
        list(Session(analyser, quick, request()).run())
    assert analyser.level_vpk == 0.0
    assert analyser.log[-1] == ("make_safe",)
    blocker.execute("ROLLBACK")
    blocker.close()
    assert len(store.points(1)) == 4


# ---------------------------------------------------------------- waits and key presses


@pytest.mark.parametrize("cut", ["interrupt", "abort"])
def test_an_endless_point_is_ended_at_once(store, cut):
    control = SessionControl()
    analyser = FakeAnalyser()
    analyser.faults[("point", 4)] = lambda: analyser.wait(60.0, bound_s=60.0)
    threading.Timer(0.3, getattr(control, cut)).start()
    began = time.monotonic()
    finished = list(Session(analyser, store, request(), control).run())[-1]
    assert time.monotonic() - began < 2.0
    assert finished.points == 2
    assert finished.source_state is OFF


def test_a_wait_that_runs_out(store):
    analyser = FakeAnalyser()
    analyser.faults[("point", 4)] = lambda: analyser.wait(60.0, bound_s=0.1)
    finished, error = broken(store, analyser)
    assert isinstance(error, BenchTimeout)
    assert finished.points == 2


@pytest.mark.parametrize("presses", [1, 2, 5])
def test_ctrl_c_without_handlers_does_not_skip_safe_off(store, presses):
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


def test_a_fault_in_the_watcher_ends_the_session_safely(store):
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


@pytest.mark.parametrize("cut", ["stop", "interrupt", "abort"])
def test_an_end_asked_for_at_any_moment_is_kept_to(store, cut):
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


# ---------------------------------------------------------------- a lost connection


def test_a_lost_connection_is_opened_again_to_make_the_source_safe(store):
    dead = FakeAnalyser({("point", 6): LinkError("cable pulled")}, safe=(OFF, UNKNOWN))
    fresh = FakeAnalyser()
    fresh.level_vpk = 0.5
    events, session = [], Session(dead, store, request(), reopen=lambda: fresh)

    def run():
        events.extend(session.run())

    with pytest.raises(LinkError):
        run()
    assert dead.closed
    assert fresh.log == [("make_safe",)]
    assert fresh.level_vpk == 0.0
    assert fresh.closed
    assert store.measurement(1).source_state is OFF
    assert "reconnected" in [event.kind for event in store.events(1)]


def test_a_connection_that_stays_lost_leaves_the_source_unknown(store):
    def refuse():
        raise LinkError("no route")

    dead = FakeAnalyser({("point", 6): LinkError("cable pulled")}, safe=(OFF, UNKNOWN))
    with pytest.raises(LinkError, match="cable pulled"):
        list(Session(dead, store, request(), reopen=refuse).run())
    assert store.measurement(1).source_state is UNKNOWN


def test_an_answer_without_proof_is_no_reason_to_connect_again(store):
    def never():
        raise AssertionError("opened again")

    dead = FakeAnalyser({("point", 6): LinkError("gone")}, safe=(OFF, UNCONFIRMED))
    with pytest.raises(LinkError):
        list(Session(dead, store, request(), reopen=never).run())


def test_a_pause_survives_a_lost_connection(store):
    control = SessionControl()
    dead, fresh = FakeAnalyser(safe=(OFF, UNKNOWN)), FakeAnalyser()
    dead.faults[("point", 4)] = control.pause
    threading.Timer(0.3, control.go_on).start()
    finished = list(Session(dead, store, request(), control, reopen=lambda: fresh).run())[-1]
    assert finished.state == "complete"
    assert fresh.closed
    assert fresh.driven[0][1] == 100.0
