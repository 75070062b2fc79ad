"""Diagnoses of drives that were commissioned, or are known by a datasheet with tolerances alone."""

import json

import pytest
from worlds.known_drive import commissioned, seen_again

from analysis.diagnosis import diagnose_response
from sim.unit import load_unit


@pytest.mark.parametrize(
    ("symbol", "factor", "effect"),
    [
        ("J_m", 1.1, "motor-inertia"),
        pytest.param("J_L", 0.9, "load-inertia", marks=pytest.mark.long),
        pytest.param("k_a", 1.1, "amplifier-gain", marks=pytest.mark.long),
    ],
)
def test_diagnosis_names_the_changed_value(symbol, factor, effect):
    """Alone, with a size that holds the true one within three errors, and as JSON."""
    unit = commissioned("walkman-b11")
    found = diagnose_response(seen_again(unit, 5, **{symbol: factor}), unit)
    document = json.loads(json.dumps(found.to_json()))
    assert document["verdict"] == "explained"
    (cause,) = document["causes"]
    assert cause["effect"] == effect
    size = cause["parameters"][symbol]
    assert abs(size["value"] - factor * unit.parameters[symbol]) < 3.0 * size["std"]
    assert size["datasheet"] == unit.parameters[symbol]
    assert document["info"][0]["stage"] == "changes"
    # No network chose what was asked.
    assert not any("posterior" in text for text in document["warnings"])
    assert any(effect in line for line in found.summary())


OFF = {"J_m": 0.93, "J_L": 1.06, "k_s1": 1.07, "T_f_m": 1.08, "k_a": 0.95, "c_s1": 0.95}
"""Values that are off their datasheet by one to one and a half standard deviations of 5 %."""


@pytest.mark.parametrize(
    ("factor", "seed"),
    [(2.0, 1), pytest.param(0.5, 2, marks=pytest.mark.long)],
)
def test_backlash_is_named_on_any_datasheet(factor, seed):
    """Alone, within three errors, though the other values are off as far as tolerances allow.

    The answer tells of these values, too.
    """
    unit = load_unit("walkman-b11").with_tolerance({"default": 0.05})
    found = diagnose_response(seen_again(unit, seed, b_t_deg=factor, **OFF), unit).to_json()
    assert found["verdict"] == "explained"
    (cause,) = found["causes"]
    assert cause["effect"] == "total-backlash"
    size = cause["parameters"]["b_t_deg"]
    assert abs(size["value"] - factor * unit.backlash.b_t_deg) < 3.0 * size["std"]
    told = found["datasheet"]
    assert {"k_s1", "J_L"} <= {symbol for symbol, one in told.items() if one["determined"]}
    for symbol, share in OFF.items():
        true = share * unit.parameters[symbol]
        assert abs(told[symbol]["value"] - true) < 3.5 * told[symbol]["std"]


@pytest.mark.parametrize("seed", [3, pytest.param(4, marks=pytest.mark.long)])
def test_values_within_tolerance_are_no_cause(seed):
    """Nothing is searched for: values leave no more of the sweep than of any such drive."""
    unit = load_unit("walkman-b11").with_tolerance({"default": 0.05})
    found = diagnose_response(seen_again(unit, seed, **OFF), unit)
    assert found.verdict.word == "consistent"
    assert "refine" not in [stage.name for stage in found.stages]
    assert found.to_json()["datasheet"]["k_s1"]["determined"]


@pytest.mark.long
def test_what_no_value_explains_is_searched_for():
    """A load that swings is a cause that no value of the unit stands for."""
    unit = commissioned("walkman-b11")
    payload = {"J_p": 0.02, "f_p": 45.0, "zeta_p": 0.02}
    found = diagnose_response(seen_again(unit, 6, effect=("payload-flexibility", payload)), unit)
    assert found.verdict.word != "consistent"
    assert [stage.name for stage in found.stages][:2] == ["changes", "refine"]
    assert any("no posterior was trained" in text for text in found.warnings)
    causes = {cause.effect for cause in found.causes}
    assert not causes or "payload-flexibility" in causes
