"""A planned sweep: what it says of a unit, and that it is one that can be measured."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.planning import plan_sweep
from daq.errors import InputError
from daq.recipe import Recipe
from daq.untrusted.bounded_text import parse_toml
from sim.unit import load_unit


@pytest.fixture(scope="module")
def planned():
    return plan_sweep(load_unit("adss"), 0.5)


def test_it_lies_within_limits_and_time(planned):
    unit, plan = load_unit("adss"), planned.plan
    assert plan.duration_s <= 30.0
    assert planned.minutes == pytest.approx(plan.duration_s / 60.0)
    assert max(plan.levels_vpk) <= unit.limits.source_vpk
    assert unit.limits.start_hz <= plan.frequencies_hz[0]
    assert plan.frequencies_hz[-1] <= unit.limits.stop_hz


def test_features_lie_where_the_paper_found_them(planned):
    """Between 125 and 155 Hz, whatever the ratio; the band of the sweep holds both."""
    assert 115.0 < planned.arf_hz[1] < 150.0
    assert planned.arf_hz[1] < planned.rf_hz[1] < 170.0
    f = planned.plan.frequencies_hz
    assert f[0] < planned.arf_hz[0]
    assert planned.rf_hz[1] < f[-1]


def test_it_tells_the_ratio_better_than_nothing_does(planned):
    """A ratio of which nothing is known has a standard deviation of 0.29."""
    assert 0.01 < planned.ratio_std < 0.15


def test_several_levels_tell_it_better_than_one(planned):
    assert len(planned.plan.levels_vpk) > 1
    assert planned.ratio_std < 0.9 * planned.usual_std


def test_its_recipe_is_one(planned):
    recipe = Recipe.model_validate(parse_toml(planned.recipe()))
    assert recipe.plan().levels_vpk == planned.plan.levels_vpk
    # A rounded end could lie outside of the unit's limits.
    assert recipe.plan().frequencies_hz == pytest.approx(planned.plan.frequencies_hz, rel=1e-12)


@given(st.text(min_size=1, max_size=64))
def test_any_name_of_a_unit_makes_a_recipe(planned, name):
    recipe = Recipe.model_validate(parse_toml(replace(planned, unit=name).recipe()))
    assert (recipe.name, recipe.plan().levels_vpk) == (name, planned.plan.levels_vpk)


def test_features_outside_the_limits_are_told():
    unit = load_unit("adss")
    narrow = unit.limits.model_copy(update={"stop_hz": 40.0})
    with pytest.raises(InputError, match="its features lie near"):
        plan_sweep(unit.model_copy(update={"limits": narrow}), 1.0)


def test_one_stage_has_no_ratio_to_plan_for():
    two = load_unit("adss")
    document = {"stage2": None, "stage1": two.stage1.model_copy(update={"J_p2": None})}
    with pytest.raises(InputError, match="one gear stage"):
        plan_sweep(two.model_copy(update=document), 1.0)
