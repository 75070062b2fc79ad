"""Hidden backlash is found by an accelerometer on the load, or by the motor's current."""

import pytest
from oracle import drive_plant
from worlds import drives

from analysis.diagnosis import diagnose_response
from analysis.estimate import estimate_response
from daq.plan import SweepPlan, spaced_frequencies
from sim.catalogue import CATALOGUE
from sim.effects import EffectSetting
from sim.reading import response_of_cycles
from sim.response import simulate

ONE = drives.unit(
    {"sensor": drives.LOAD_ACCELEROMETER, "electronics": {"k_ts": 0.0102}, "filter": None},
    "one-stage",
).with_tolerance({"default": 0.05})


@pytest.mark.slow
def test_accelerometer_on_load_shows_hidden_backlash():
    """A datasheet of 0.12 deg, and 0.21 deg in the drive: three seeds were within 0.8 errors."""
    plan = SweepPlan(spaced_frequencies(50, 130, 12, "lin"), (2.0,))
    worn = ONE.with_parameters(b_t_deg=0.21)
    found = estimate_response(simulate(worn, 1.0, plan, seed=5), ONE).to_json()["b_t_deg"]
    assert abs(found["value"] - 0.21) < 3.0 * found["std"]
    assert found["std"] < 0.03


@pytest.mark.long
def test_current_shows_hidden_backlash_of_one_stage():
    unit = drives.unit(drives.DRIVES["motor current"], "one-stage")
    unit = unit.with_tolerance({"default": 0.05})
    plan = SweepPlan(spaced_frequencies(50, 130, 12, "lin"), (2.0, 4.0))
    worn = unit.with_parameters(b_t_deg=0.21)
    found = estimate_response(simulate(worn, 1.0, plan, seed=5), unit).to_json()["b_t_deg"]
    assert abs(found["value"] - 0.21) < 3.0 * found["std"]
    assert found["std"] < 0.03


@pytest.mark.long
@pytest.mark.parametrize("ratio", [0.3, 0.7])
def test_ratio_is_found_in_independent_plant(ratio):
    sections = drives.DRIVES["accelerometer at the load"]
    unit = drives.unit(sections).with_tolerance({"default": 0.05})
    plan = SweepPlan(spaced_frequencies(60, 175, 20, "lin"), (1.5, 2.5, 4.0), settle_cycles=20,
                     integrate_cycles=30)  # fmt: skip
    read = [
        drive_plant.sweep(drives.document(sections), ratio, plan.frequencies_hz, volts, 20, 30)
        for volts in plan.levels_vpk
    ]
    stated = simulate(unit, ratio, SweepPlan((100.0,), (2.0,), integrate_cycles=30)).provenance
    response = response_of_cycles(drives.cycles(read), plan, unit.name, stated)
    found = estimate_response(response, unit).to_json()["contribution_ratio"]
    assert abs(found["value"] - ratio) < 3.0 * found["std"]
    assert found["std"] < 0.12


@pytest.mark.long
def test_heavier_load_is_named_by_accelerometer(tmp_path):
    asked = {"load-inertia", "motor-inertia", "total-backlash", "mesh1-stiffness"}
    plan = SweepPlan(spaced_frequencies(30.0, 150.0, 14, "log"), (1.5, 4.0), settle_cycles=4,
                     integrate_cycles=6)  # fmt: skip
    hidden = EffectSetting("load-inertia", {"J_L": 1.6 * ONE.load.J_L})
    response = simulate(ONE, 1.0, plan, effects=[hidden], seed=77)
    told = diagnose_response(response, ONE, without=set(CATALOGUE) - asked, cache=tmp_path)
    document = told.to_json()
    named = [cause["effect"] for cause in document["causes"]] or document["rivals"][0]["causes"]
    assert named == ["load-inertia"]
