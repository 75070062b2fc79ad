"""The tolerance of a datasheet: what a unit file, an option and neither of them make of it."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.configs import config_path
from daq.errors import ConfigurationError
from sim.unit import load_unit, unit_from_mapping

SIX = ("R_m", "k_t", "k_a", "k_ts", "k_s1", "J_L")
EXACT = ("N_1", "N", "filter_numerator")


def unit_with(tolerance, name="adss"):
    document = tomllib.loads(config_path("units", name).read_text())
    del document["tolerance"]
    if tolerance is not None:
        document["tolerance"] = tolerance
    return unit_from_mapping(document, "mine.toml")


@pytest.mark.parametrize("name", ["adss", "edss"])
def test_the_shipped_units_are_believed_to_half_a_per_cent_in_six_values(name):
    believed = load_unit(name).believed
    for symbol, (share, origin) in believed.items():
        assert share == (0.005 if symbol in SIX else 0.0)
        assert origin == ("default" if symbol in EXACT else "unit file")


def test_a_file_that_says_nothing_is_believed_to_five_per_cent_but_for_teeth():
    believed = unit_with(None).believed
    assert "b_t_deg" not in believed
    assert set(believed) == set(load_unit("adss").parameters) - {"b_t_deg"}
    for symbol, (share, origin) in believed.items():
        assert (share, origin) == (0.0 if symbol in EXACT else 0.05, "default")


def test_a_name_counts_before_the_default_and_an_option_before_the_file():
    unit = unit_with({"default": 0.02, "R_m": 0.08, "N": 0.001, "k_a": 0})
    assert unit.believed["R_m"] == (0.08, "unit file")
    assert unit.believed["J_L"] == (0.02, "unit file")
    assert unit.believed["N"] == (0.001, "unit file")
    assert unit.believed["N_1"] == (0.0, "default")
    assert unit.believed["k_a"] == (0.0, "unit file")
    told = unit.with_tolerance({"default": 0.1, "J_L": 0.3})
    assert told.believed["R_m"] == (0.1, "option")
    assert told.believed["J_L"] == (0.3, "option")
    assert told.believed["N"] == (0.001, "unit file")
    # What simulates a changed unit still knows it, and the value is changed, not its tolerance.
    changed = told.with_parameters(R_m=5.0)
    assert changed.parameters["R_m"] == 5.0
    assert changed.believed == told.believed
    assert unit.believed["R_m"] == (0.08, "unit file")


@given(st.sampled_from(["k_s2", "r_m", "", "b_t_deg", "filter_denominator", "J_p2 "]))
def test_a_name_without_a_tolerance_is_refused_with_those_that_have_one(name):
    for refused in (lambda: unit_with({name: 0.01}),
                    lambda: load_unit("adss").with_tolerance({name: 0.01})):  # fmt: skip
        with pytest.raises(ConfigurationError) as caught:
            refused()
        message = str(caught.value)
        assert "\n" not in message
        assert ("total-backlash" if name == "b_t_deg" else "R_m, k_b") in message


@given(
    st.floats(max_value=-1e-9) | st.floats(min_value=0.50001) | st.just(float("nan"))
    | st.booleans() | st.text(max_size=3) | st.none()
)  # fmt: skip
def test_what_is_no_share_is_refused(value):
    with pytest.raises(ConfigurationError, match=r"mine\.toml: tolerance"):
        unit_with({"R_m": value})


def test_a_drive_of_one_stage_has_no_tolerance_of_a_second():
    document = tomllib.loads(config_path("templates", "one-stage").read_text())
    assert "k_2" not in unit_from_mapping(document, "one").tolerances
    document["tolerance"] = {"k_2": 0.1}
    with pytest.raises(ConfigurationError, match="k_2"):
        unit_from_mapping(document, "one")
