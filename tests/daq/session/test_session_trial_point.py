"""What the trial point and the ranges show before the sweep, and when that ends it."""

import pytest
from instruments.fake_analyser import FakeAnalyser
from instruments.session_runs import broken, request

from daq.frf import PointFlag
from daq.plan import SweepPlan
from daq.preflight import Plausibility
from daq.session import Session
from daq.session_events import CheckLine


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
def test_implausible_trial_point_ends_session(store, gain, said):
    analyser = FakeAnalyser(gain=gain)
    finished, error = broken(store, analyser)
    assert said in str(error)
    assert "check cables" in str(error)
    assert len(analyser.driven) == 1
    assert finished.points == 0


def test_overloaded_trial_point_ends_session(store):
    _, error = broken(store, FakeAnalyser(flags={1: PointFlag.OVERLOAD}))
    assert "an input is overloaded" in str(error)


def test_judge_of_trial_point_is_obeyed(store):
    wanted = request(plausible=Plausibility(judge=lambda point: "no servo answers like this"))
    _, error = broken(store, FakeAnalyser(), wanted)
    assert "no servo answers like this" in str(error)


def test_too_small_fixed_range_is_noted(store):
    plan = SweepPlan((120.0, 140.0), (0.1, 4.0))
    wanted = request(plan, input_range_vpk=(5.0, 0.5))
    events = list(Session(FakeAnalyser(gain=lambda f: 0.3), store, wanted).run())
    lines = {e.name: e for e in events if isinstance(e, CheckLine)}
    assert lines["input range 1"].verdict == "pass"
    assert lines["input range 2"].verdict == "note"
    assert "overloads will be flagged" in lines["input range 2"].text
