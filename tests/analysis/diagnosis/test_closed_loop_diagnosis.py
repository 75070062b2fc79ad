"""A diagnosis in closed loop: a hidden cause is named, and nothing is blamed for the loop."""

from pathlib import Path

import pytest

from analysis.diagnosis import diagnose_response
from daq.plan import SweepPlan, spaced_frequencies
from sim.catalogue import CATALOGUE
from sim.effects import EffectSetting
from sim.response import simulate
from sim.unit import load_unit

FEW = {"load-inertia", "shaft-stiffness", "amplifier-gain", "motor-viscous-friction"}
UNIT = load_unit(str(Path(__file__).parents[3] / "docs" / "examples" / "loop.toml"))
GROWN = 1.6


@pytest.mark.long
@pytest.mark.parametrize("hides", [False, True])
def test_heavier_load_is_found_in_closed_loop(hides, tmp_path):
    plan = SweepPlan(
        spaced_frequencies(70.0, 190.0, 14, "log"), (2.0, 4.5), settle_cycles=6, integrate_cycles=8
    )
    unit = UNIT.with_tolerance({"default": 0.02})
    hidden = [EffectSetting("load-inertia", {"J_L": GROWN * unit.load.J_L})] if hides else []
    response = simulate(unit, 0.4, plan, effects=hidden, seed=7)
    found = diagnose_response(
        response, unit, without=set(CATALOGUE) - FEW, cache=tmp_path
    ).to_json()
    named = {cause["effect"]: cause["parameters"] for cause in found["causes"]}
    assert set(named) == ({"load-inertia"} if hides else set())
    if hides:
        assert named["load-inertia"]["J_L"]["value"] == pytest.approx(
            GROWN * unit.load.J_L, rel=0.15
        )
    told = found["contribution_ratio"]["extended"]
    assert abs(told["value"] - 0.4) < 3.0 * told["std"] + 0.02
