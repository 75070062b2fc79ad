"""The estimate on a drive with one gear stage: its play, when nothing is to be shared out."""

import pytest

from analysis.advice import advise
from analysis.answer import accept_model
from analysis.estimate import estimate_features, estimate_response
from daq.configs import config_path
from daq.errors import InputError
from daq.plan import SweepPlan, spaced_frequencies
from sim.response import simulate
from sim.unit import load_unit

ONE = load_unit(str(config_path("templates", "one-stage")))


@pytest.fixture(scope="module")
def measured():
    worn = ONE.with_parameters(b_t_deg=0.21)
    return simulate(worn, 1.0, SweepPlan(spaced_frequencies(50, 130, 14, "lin"), (2.0,)), seed=5)


@pytest.mark.slow
def test_backlash_is_found_despite_wrong_file(measured):
    # Believed by its kind it is 0.041 to 0.050 wide in five seeds: a stiffness of 15 % looks like
    # play. So it is 0.027 to 0.031.
    found = estimate_response(measured, ONE.with_tolerance({"default": 0.05})).to_json()
    b_t = found["b_t_deg"]
    assert abs(b_t["value"] - 0.21) < 3.0 * b_t["std"]
    assert b_t["std"] < 0.036
    assert found["b1_deg"] == b_t
    assert (found["b2_deg"]["value"], found["contribution_ratio"]["value"]) == (0.0, 1.0)
    assert found["contribution_ratio"]["interval95"] == [1.0, 1.0]
    advice = advise(accept_model(found), ONE)
    assert advice.headline.startswith("There is one gear stage")
    (stage,) = advice.stages
    assert "no limit set" in stage.line


def test_one_stage_refuses_stage_features():
    with pytest.raises(InputError, match="one gear stage"):
        estimate_features(62.0, 101.0, ONE)
