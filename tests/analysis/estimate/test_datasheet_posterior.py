"""What an estimate says of datasheet values, on drives whose values are known."""

import numpy as np
import pytest

from analysis.estimate import estimate_response
from analysis.estimate.datasheet_posterior import datasheet_lines
from daq.plan import SweepPlan
from sim.response import simulate
from sim.unit import load_unit

UNIT = load_unit("adss").with_tolerance(
    {"default": 0.0, "J_L": 0.15, "R_m": 0.08, "k_g1": 0.15, "k_ts": 0.05}
)
PLAN = SweepPlan(
    tuple(np.geomspace(80.0, 220.0, 17).tolist()), (2.5,), settle_cycles=6, integrate_cycles=6
)


@pytest.fixture(scope="module")
def answer():
    """Of a drive whose load is 15 % heavier than the datasheet says."""
    true = UNIT.with_parameters(J_L=1.15 * UNIT.parameters["J_L"])
    return estimate_response(simulate(true, 0.4, PLAN, seed=5), UNIT)


def test_heavier_load_is_measured(answer):
    load = answer.to_json()["datasheet"]["J_L"]
    assert load["determined"]
    assert load["std"] < 0.6 * load["datasheet_std"]
    assert load["value"] - load["datasheet"] > 0.5 * 0.15 * load["datasheet"]
    assert abs(load["value"] - 1.15 * load["datasheet"]) < 3.0 * load["std"]


def test_undetermined_value_stays_at_datasheet(answer):
    mesh = answer.to_json()["datasheet"]["k_g1"]
    assert not mesh["determined"]
    assert mesh["std"] == pytest.approx(mesh["datasheet_std"], rel=0.1)
    assert mesh["value"] == pytest.approx(mesh["datasheet"], rel=0.1)


def test_summary_tells_both_kinds(answer):
    text = "\n".join(answer.summary())
    assert "measured against the datasheet: J_L +" in text
    assert "k_g1" in text.partition("not determined by this sweep: ")[2].partition("\n")[0]


def test_exact_values_are_not_told(answer):
    assert set(answer.to_json()["datasheet"]) == {"J_L", "R_m", "k_g1", "k_ts"}


def test_value_of_zero_is_not_told():
    nothing = dict.fromkeys(("datasheet", "datasheet_std", "value", "std"), 0.0)
    assert datasheet_lines({"datasheet": {"B_m": nothing | {"determined": False}}}) == []
