"""What a diagnosis says of datasheet values, of machines whose values are known."""

import numpy as np
import pytest
from outputs import report_makings as makings
from worlds.synthetic import ADSS, candidate, observation, read

from analysis.diagnosis.datasheet import learn_datasheet
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.datasheet_spread import spread_of
from analysis.estimate.datasheet_posterior import datasheet_lines

LOAD = ("load-inertia",)
UNIT = ADSS.with_tolerance({"default": 0.0, "J_L": 0.15, "R_m": 0.08, "k_s1": 0.1})
SPREAD = spread_of(UNIT)


def learned(effects=(), shares=(0.0, 0.0, 0.0), seed=1):
    """What is learned of a machine of which J_L, R_m and k_s1 are off by shares, by symbol."""
    off = SPREAD.along(tuple(zip(("J_L", "R_m", "k_s1"), shares, strict=True)))
    place = np.array([0.5, *[0.5] * len(effects)])
    seen = observation(read(effects, place, np.random.default_rng(seed), off, scatter=0.3))
    found = ParameterPosterior(place, 0.02**2 * np.eye(len(place)))
    values = learn_datasheet(candidate(seen, effects, seed, scatter=0.3, unit=UNIT), found)
    return {one.symbol: one for one in values}


@pytest.mark.parametrize("shares", [(0.2, 0.0, 0.0), (-0.1, 0.1, -0.1)])
def test_departures_from_datasheet_are_measured(shares):
    values = learned(shares=shares)
    for symbol, share in zip(("J_L", "R_m", "k_s1"), shares, strict=True):
        one = values[symbol]
        assert one.determined
        assert one.std < 0.5 * one.tolerance
        assert abs(one.value / one.datasheet - 1.0 - share) < 3.0 * one.std


def test_value_that_is_cause_is_left_out():
    assert set(learned()) == {"J_L", "R_m", "k_s1"}
    assert set(learned(LOAD)) == {"R_m", "k_s1"}


@pytest.mark.parametrize("named", [(), LOAD])
def test_accepted_model_states_datasheet(monkeypatch, named):
    found = makings.diagnosis(monkeypatch, named, [LOAD])
    document = found.to_json()
    assert document["verdict"] == ("explained" if named else "consistent")
    assert set(document["datasheet"]) == {
        symbol for symbol, share in ADSS.tolerances.items() if share > 0.0
    } - ({"J_L"} if named else set())
    assert {f"  {line}" for line in datasheet_lines(document)} <= set(found.summary())


def test_rejected_model_states_no_datasheet(monkeypatch):
    found = makings.diagnosis(monkeypatch, LOAD, [("shaft-stiffness",)])
    assert found.verdict.word == "unexplained"
    assert found.to_json()["datasheet"] == {}
