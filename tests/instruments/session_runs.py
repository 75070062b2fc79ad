"""Requests of sessions over the fake analyser, and runs of them that hold what every run must."""

from instruments.fake_analyser import FakeAnalyser

from daq.analyser import SourceState
from daq.limits import Limits
from daq.plan import SweepPlan, spaced_frequencies
from daq.session import Session
from daq.session_events import Finished, PointStored
from daq.session_request import SessionRequest
from daq.store_records import MeasurementHeader

PLAN = SweepPlan(
    spaced_frequencies(100.0, 180.0, 9), (0.5, 1.0), settle_cycles=2, integrate_cycles=3
)
LIMITS = (Limits("bench", source_vpk=2.0, start_hz=10.0, stop_hz=500.0, duration_s=100.0),)

ONE_LEVEL = SweepPlan(
    spaced_frequencies(100.0, 180.0, 9), (0.5,), settle_cycles=2, integrate_cycles=3
)
NO_LIMITS = (Limits("bench"),)

OFF, UNCONFIRMED, UNKNOWN = (
    SourceState.CONFIRMED_OFF,
    SourceState.UNCONFIRMED,
    SourceState.UNKNOWN,
)


def new(plan: SweepPlan = PLAN, **changes) -> SessionRequest:
    """A new measurement under LIMITS."""
    header = MeasurementHeader("ADSS", "7", plan, "fake:", "lashbench test")
    return SessionRequest(**({"header": header, "limits": LIMITS} | changes))


def request(plan: SweepPlan = ONE_LEVEL, **changes) -> SessionRequest:
    """A new measurement that no limit stops."""
    return new(plan, limits=NO_LIMITS, **changes)


def again(measurement: int, **changes) -> SessionRequest:
    """A measurement taken up again under LIMITS."""
    return SessionRequest(header=None, limits=LIMITS, resume=measurement, **changes)


def of(kind, events) -> list:
    return [event for event in events if isinstance(event, kind)]


def measured(store, wanted=None, analyser=None, control=None) -> list:
    """Run a session that must end without an error; its events."""
    analyser = analyser or FakeAnalyser()
    events = list(Session(analyser, store, wanted or new(), control).run())
    assert analyser.level_vpk == 0.0
    assert analyser.log[-1] == ("make_safe",)
    assert isinstance(events[-1], Finished)
    return events


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
