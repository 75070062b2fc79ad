"""What is told of a drive with three stages: the play of the last one is known, and in doubt."""

import numpy as np
import pytest

from analysis.ensemble.datasheet_spread import spread_of
from analysis.estimate.backlash import backlash_of_places
from daq.configs import config_path
from sim.unit import load_unit

THREE = load_unit(str(config_path("templates", "three-stage")))


def known(unit, ratio, b_t_deg=0.12):
    """The backlash of each stage where ratio and total are known."""
    return backlash_of_places(unit, np.array([ratio]), np.array([b_t_deg]), np.ones(1))


@pytest.mark.parametrize("ratio", [0.0, 0.3, 1.0])
def test_backlash_is_as_simulated(ratio):
    told, plays = known(THREE.with_tolerance({"b3_deg": 0.0}), ratio), THREE.split(ratio)
    assert (told.b1_deg.value, told.b2_deg.value) == pytest.approx((plays.b1_deg, plays.b2_deg))
    assert (told.b3_deg.value, told.b3_deg.std) == (plays.b3_deg, 0.0)
    assert set(told.to_json()) == {"contribution_ratio", "b1_deg", "b2_deg", "b3_deg", "b_t_deg"}
    assert any(line.split(", ")[1:2] == ["b3"] for line in told.lines(""))


def test_doubt_of_third_stage_widens_others():
    unit = THREE.with_tolerance({"b3_deg": 0.2})
    told = known(unit, 0.4)
    std = 0.2 * unit.stage3.b3_deg
    assert told.b3_deg.std == pytest.approx(std, rel=0.03)
    assert told.b1_deg.std == pytest.approx(0.4 * std * unit.output_ratio, rel=0.03)
    assert told.b2_deg.std == pytest.approx(0.6 * std * unit.last_ratio, rel=0.03)
    low, high = told.b2_deg.interval95
    assert low < told.b2_deg.value < high


def test_play_of_third_stage_is_drawn_alone():
    """No linear response shows it; runs of the datasheet vary it all the same."""
    spread = spread_of(THREE)
    place = spread.symbols.index("b3_deg")
    (alone,) = np.flatnonzero(spread.ways[:, place])
    assert np.count_nonzero(spread.ways[alone]) == 1
    assert spread.sigmas[alone] == pytest.approx(THREE.tolerances["b3_deg"])
