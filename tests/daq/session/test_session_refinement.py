"""Refinement after the plan: the points that it adds are the same with a stop between."""

import numpy as np
from instruments.fake_analyser import FakeAnalyser
from instruments.session_runs import PLAN, Watch, again, measured, new

from daq.adaptive import Refinement
from daq.control import SessionControl
from daq.plan import SweepPlan
from daq.session import Session


def judge(points):
    """Both features, known the better the more points there are."""
    std_hz = 10.0 / len(points)
    return [(125.0, std_hz, 5.0), (153.0, std_hz, 5.0)]


def test_refinement_follows_plan_and_survives_stop(store):
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
