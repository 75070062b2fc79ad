"""A diagnosis of a drive with one gear stage: its causes, where no ratio is to be told."""

import pytest

from analysis.diagnosis import diagnose_response
from daq.configs import config_path
from daq.plan import SweepPlan, spaced_frequencies
from sim.catalogue import CATALOGUE
from sim.effects import EffectSetting
from sim.response import simulate
from sim.unit import load_unit

FEW = {"load-inertia", "motor-inertia", "total-backlash", "mesh1-stiffness", "mesh2-stiffness"}


GROWN = 1.6
"""Load over that of the datasheet: named alone with three seeds of three among few causes. At 1.4
so few points tell it in two of four only, at 1.8 it is near the end of its range."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "seeds"),
    [
        (FEW, (77,)),
        pytest.param(FEW, (79,), marks=pytest.mark.long),
        pytest.param(set(CATALOGUE), (77, 79), marks=pytest.mark.long),
    ],
)
def test_heavier_load_is_found_on_one_stage(asked, seeds, tmp_path):
    unit = load_unit(str(config_path("templates", "one-stage")))
    plan = SweepPlan(
        spaced_frequencies(30.0, 150.0, 14, "log"), (1.5, 4.0), settle_cycles=4, integrate_cycles=6
    )
    hidden = EffectSetting("load-inertia", {"J_L": GROWN * unit.load.J_L})
    words = []
    for seed in seeds:
        response = simulate(unit, 1.0, plan, effects=[hidden], seed=seed)
        found = diagnose_response(
            response, unit, without=set(CATALOGUE) - asked, cache=tmp_path
        ).to_json()
        words.append(found["verdict"])
        named = [cause["effect"] for cause in found["causes"]]
        # So few points leave a good drive possible with one seed of two: then it is told as open.
        assert named or any("load-inertia" in one["causes"] for one in found["rivals"][:2])
        for cause in found["causes"]:
            assert cause["effect"] == "load-inertia"
            assert abs(cause["parameters"]["J_L"]["value"] / (GROWN * unit.load.J_L) - 1.0) < 0.2
        assert found["contribution_ratio"]["extended"] | {"interval95": None} == {
            "value": 1.0,
            "std": 0.0,
            "interval95": None,
        }
        assert not any("mesh2" in name for rival in found["rivals"] for name in rival["causes"])
        # The posterior is borrowed, where one was asked at all.
        searched = "refine" in [one["stage"] for one in found["info"]]
        assert any("lashbench prepare" in text for text in found["warnings"]) == searched
    # Among all causes of the catalogue the borrowed network spends too few runs on this one.
    assert "explained" in words or asked != FEW
