"""A planned sweep: what it says of a unit, and that it is one that can be measured."""

import math
import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds import drives

from analysis.execution.executor import LocalExecutor
from analysis.planning import plan_sweep
from daq.configs import config_names
from daq.errors import InputError
from daq.recipe import Recipe
from daq.untrusted.bounded_text import parse_toml
from sim.datasheet import natural_frequencies
from sim.effect import shaft_at_load
from sim.unit import load_unit


class FewCycles(LocalExecutor):
    """Simulates 9 cycles of each point in place of 50."""

    def each(self, work, tasks, progress=None):
        return super().each(work, [[shorter(one) for one in lot] for lot in tasks], progress)


def shorter(family):
    plans = [
        (replace(plan, settle_cycles=3, integrate_cycles=6), rows) for plan, rows in family.plans
    ]
    return replace(family, plans=tuple(plans))


@pytest.fixture(scope="module")
def planned():
    return plan_sweep(load_unit("adss"), 2.0, executor=FewCycles())


def test_plan_is_within_limits_and_time(planned):
    unit, plan = load_unit("adss"), planned.plan
    assert plan.duration_s <= 120.0
    assert planned.minutes == pytest.approx(plan.duration_s / 60.0)
    assert max(plan.levels_vpk) <= unit.limits.source_vpk
    assert unit.limits.start_hz <= plan.frequencies_hz[0]
    assert plan.frequencies_hz[-1] <= unit.limits.stop_hz


def test_features_agree_with_paper(planned):
    """Between 125 and 155 Hz, whatever the ratio; the band of the sweep holds both."""
    assert 115.0 < planned.arf_hz[1] < 150.0
    assert planned.arf_hz[1] < planned.rf_hz[1] < 170.0
    f = planned.plan.frequencies_hz
    assert f[0] < planned.arf_hz[0]
    assert planned.rf_hz[1] < f[-1]


def test_planned_sweep_determines_the_ratio(planned):
    """A ratio of which nothing is known has a standard deviation of 0.29."""
    assert 0.01 < planned.expected_std < 0.15


def test_several_levels_determine_ratio_better(planned):
    assert len(planned.plan.levels_vpk) > 1
    assert planned.expected_std < 0.9 * planned.usual_std


def test_printed_recipe_is_valid(planned):
    recipe = Recipe.model_validate(parse_toml(planned.recipe()))
    assert recipe.plan().levels_vpk == planned.plan.levels_vpk
    # A rounded end could lie outside of the unit's limits.
    assert recipe.plan().frequencies_hz == pytest.approx(planned.plan.frequencies_hz, rel=1e-12)


@given(st.text(min_size=1, max_size=64))
def test_any_unit_name_gives_a_recipe(planned, name):
    recipe = Recipe.model_validate(parse_toml(replace(planned, unit=name).recipe()))
    assert (recipe.name, recipe.plan().levels_vpk) == (name, planned.plan.levels_vpk)


def test_features_outside_limits_are_reported():
    unit = load_unit("adss")
    narrow = unit.limits.model_copy(update={"stop_hz": 40.0})
    with pytest.raises(InputError, match="its features lie near"):
        plan_sweep(unit.model_copy(update={"limits": narrow}), 1.0)


@pytest.mark.parametrize("name", ["feed-axis", "r3-1"])
def test_too_short_time_states_shortest_sweep(name):
    """One stage is no fault, and couplings, which place the features, leave these in the limits."""
    with pytest.raises(InputError, match="the shortest useful sweep"):
        plan_sweep(load_unit(name), 1e-6)


@pytest.mark.parametrize(
    ("name", "most_min"),
    [("feed-axis", 0.2), pytest.param("srv02-torsion", 0.3, marks=pytest.mark.long)],
)
def test_slow_drives_get_few_cycles(name, most_min):
    """Of 50 cycles at 11 points the shortest sweeps took 0.45 and 1.3 min."""
    with pytest.raises(InputError, match="the shortest useful sweep") as told:
        plan_sweep(load_unit(name), 1e-6)
    assert 0.01 < float(re.search(r"takes (\S+) min", str(told.value))[1]) < most_min


@pytest.mark.study
def test_one_stage_drive_plans_for_total_backlash():
    """The screw of a feed axis; a minute or two of a processor."""
    unit = load_unit("feed-axis")
    found = plan_sweep(unit, 2.0)
    said = found.to_json()
    assert "contribution_ratio" not in said
    assert 0.0 < said["b_t_deg"]["expected_std"] < 0.5 * unit.backlash.b_t_deg
    assert f"total backlash {found.expected_std:.2g} deg" in "\n".join(found.summary())
    modes = natural_frequencies(unit)
    assert found.plan.frequencies_hz[0] < modes.anti_resonances_hz[0]
    assert modes.resonances_hz[0] < found.plan.frequencies_hz[-1] < 3.0 * modes.resonances_hz[0]


@pytest.mark.parametrize("name", config_names("units"))
def test_load_frequency_scale_is_near_anti_resonance(name):
    """With couplings in series: of every drive the load swings within a factor of 1.5 of it."""
    unit = load_unit(name)
    scale = math.sqrt(shaft_at_load(unit) / unit.load.J_L) / (2.0 * math.pi)
    assert scale == pytest.approx(natural_frequencies(unit).anti_resonances_hz[0], rel=0.5)


@pytest.mark.long
@pytest.mark.parametrize("name", ["accelerometer at the load", "motor current"])
def test_plan_names_what_the_sensor_shows(name):
    """Neither a load nor a current shows ARF; RF lies where a tachometer has it, by the sensor."""
    sections = drives.DRIVES[name]
    unit = drives.unit(sections, "one-stage").with_tolerance({"default": 0.05})
    found = plan_sweep(unit, 0.5)
    assert found.arf_hz is None
    assert 90.0 < found.rf_hz[1] < 105.0
