"""The unit file that commissioning writes, read back as a unit."""

from datetime import date
from pathlib import Path

import numpy as np
import pytest

from analysis.commissioning import Commissioned, Parameter, commissioned_unit_text
from analysis.observation.joint import unit_doubts
from daq.configs import config_path
from daq.errors import ConfigurationError
from daq.formats import read_response
from daq.untrusted.bounded_text import parse_toml
from sim.unit import load_unit, unit_from_mapping

DATA = Path(__file__).parents[2] / "data" / "practice"
DATASHEET = config_path("units", "adss").read_text()


def found(total_backlash=False):
    parameters = [
        Parameter("R_m", 4.10, 0.08, 4.4, 0.04, 0.004),
        Parameter("J_L", 2.75e-3, 0.08, 2.6e-3, 0.03, 0.0002),
        Parameter("contribution_ratio", None, None, 0.31, 0.02, 0.01),
    ]
    if total_backlash:
        parameters.append(Parameter("b_t_deg", 0.066, 0.5, 0.08, 0.1, 0.05))
    sweep = {"sha256": "ab" * 32, "levels_vpk": [1.5, 4.0], "start_hz": 100.0, "stop_hz": 180.0,
             "points": 122}  # fmt: skip
    std = np.array([one.std for one in parameters])
    return Commissioned(
        load_unit("adss"), tuple(parameters), np.diag(std**2), 2, 1.0, (sweep,), None, (), 1.0, 1.0
    )


def read(text):
    return unit_from_mapping(parse_toml(text), "unit")


def test_identified_values_replace_those_of_the_datasheet():
    unit = read(commissioned_unit_text(DATASHEET, found(), "A7", date(2026, 11, 2)))
    plain = load_unit("adss").parameters
    assert unit.name == "A7"
    assert unit.parameters == pytest.approx(plain | {"R_m": 4.4, "J_L": 2.6e-3})
    assert unit.limits == load_unit("adss").limits


def test_tolerance_is_conditional_on_other_values():
    unit = read(commissioned_unit_text(DATASHEET, found(), "A7", date(2026, 11, 2)))
    held = {symbol: share for symbol, share in unit.tolerances.items() if share}
    # An analyser knows no gain better than a thousandth.
    assert held == pytest.approx({"R_m": 0.004, "J_L": 0.001})


def test_file_records_how_it_was_identified():
    unit = read(commissioned_unit_text(DATASHEET, found(True), "A7", date(2026, 11, 2)))
    said = unit.commissioning
    assert (said.date, said.sweeps[0].points) == ("2026-11-02", 122)
    assert said.datasheet["R_m"] == 4.10
    assert (said.contribution_ratio, said.contribution_ratio_std) == (0.31, 0.02)
    np.testing.assert_allclose(np.diag(said.covariance), [0.0016, 0.0009, 0.0004, 0.01])
    assert unit.backlash.b_t_deg == pytest.approx(0.08)


def test_sweep_of_datasheet_unit_fits_commissioned_one():
    unit = read(commissioned_unit_text(DATASHEET, found(), "A7", date(2026, 11, 2)))
    sweep = read_response(DATA / "practice-09.csv")
    assert unit_doubts([sweep], unit) == []
    assert unit_doubts([sweep], load_unit("edss"))


LIMITED = (
    DATASHEET
    + """
[acceptance]
b_t_deg = { upper = 0.09 }
"""
)


def test_limits_of_acceptance_stay():
    unit = read(commissioned_unit_text(LIMITED, found(True), "A7", date(2026, 11, 2)))
    assert unit.acceptance == read(LIMITED).acceptance
    assert unit.backlash.b_t_deg == pytest.approx(0.08)


def without(text, section):
    """A text without one of its tables."""
    head, _, rest = text.partition(f"\n[{section}]\n")
    return head + "\n" + rest[rest.index("\n[") :]


@pytest.mark.parametrize(
    "written",
    ["load = {{ J_L = {J_L}, T_f_L = {T_f_L} }}", "load.J_L = {J_L}\nload.T_f_L = {T_f_L}",
     '"load" = {{ "J_L" = {J_L}, T_f_L = {T_f_L} }}'],
)  # fmt: skip
def test_values_are_replaced_in_any_table_form(written):
    known = load_unit("adss").parameters
    text = f"{written.format(**known)}\n{without(DATASHEET, 'load')}"
    assert read(text) == load_unit("adss")
    unit = read(commissioned_unit_text(text, found(), "A7", date(2026, 11, 2)))
    assert unit.parameters == pytest.approx(known | {"R_m": 4.4, "J_L": 2.6e-3})


def test_text_that_is_no_unit_is_refused():
    with pytest.raises(ConfigurationError, match="motor"):
        commissioned_unit_text(without(DATASHEET, "motor"), found(), "A7", date(2026, 11, 2))


def test_comments_stay():
    text = commissioned_unit_text(DATASHEET, found(), "A7", date(2026, 11, 2))
    assert "armature resistance" in text
    assert "Source of every number" in text


def test_commissioning_again_replaces_the_first():
    once = commissioned_unit_text(DATASHEET, found(), "A7", date(2026, 11, 2))
    twice = commissioned_unit_text(once, found(), "A8", date(2026, 12, 2))
    assert twice.count("[commissioning]") == 1
    assert read(twice).commissioning.date == "2026-12-02"


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("std = 0.04", "std = -0.04", "std"),
        ('"ab', '"xy', "sha256"),
        ("order = [", 'order = ["k_t", ', "covariance"),
    ],
)
def test_a_damaged_file_is_refused_by_key(old, new, told):
    text = commissioned_unit_text(DATASHEET, found(), "A7", date(2026, 11, 2))
    text = text.replace("ab" * 32, "xy" * 32) if "xy" in new else text
    text = text.replace("R_m = 0.04\n", "R_m = -0.04\n") if "std" in old else text
    text = text.replace(old, new)
    with pytest.raises(ConfigurationError, match=told):
        read(text)


def test_origin_of_values_is_not_physics():
    unit = read(commissioned_unit_text(DATASHEET, found(), "A7", date(2026, 11, 2)))
    bare = unit.model_copy(update={"commissioning": None})
    assert unit.physics == bare.physics
    assert unit.with_parameters(R_m=5.0).commissioning == unit.commissioning
