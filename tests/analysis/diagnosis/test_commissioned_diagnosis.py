"""Diagnoses of drives that were commissioned: what has changed since."""

import json

import pytest
from worlds.known_drive import commissioned, seen_again

from analysis.diagnosis import diagnose_response


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
    assert any(effect in line for line in found.summary())


@pytest.mark.long
def test_what_no_value_explains_is_searched_for():
    """A load that swings is a cause that no value of the unit stands for."""
    unit = commissioned("walkman-b11")
    payload = {"J_p": 0.02, "f_p": 45.0, "zeta_p": 0.02}
    found = diagnose_response(seen_again(unit, 6, effect=("payload-flexibility", payload)), unit)
    assert found.verdict.word != "consistent"
    assert [stage.name for stage in found.stages][:2] == ["changes", "refine"]
    causes = {cause.effect for cause in found.causes}
    assert not causes or "payload-flexibility" in causes
