"""The tolerance of a datasheet: what a unit file, an option and neither of them make of it."""

import re
import tomllib

import numpy as np
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
def test_shipped_units_state_six_tolerances(name):
    """Half a per cent each."""
    believed = load_unit(name).believed
    for symbol, (share, origin) in believed.items():
        assert share == (0.005 if symbol in SIX else 0.0)
        assert origin == ("default" if symbol in EXACT else "unit file")


KINDS = {
    0.08: {"R_m", "k_t", "k_b"},
    0.10: {"L_a", "J_m", "J_g1", "J_s1", "J_p2"},
    0.15: {"k_g1", "k_s1", "k_2"},
    0.30: {"B_m", "T_f_m", "T_f_L"},
    0.05: {"k_a", "k_ts", "J_L"},
    0.0: set(EXACT),
}


@pytest.mark.parametrize("tolerance", [None, {}, {"R_m": 0.2}])
def test_unstated_value_has_tolerance_of_its_kind(tolerance):
    believed = unit_with(tolerance).believed
    assert "b_t_deg" not in believed
    expected = {symbol: share for share, symbols in KINDS.items() for symbol in symbols}
    for symbol, (share, origin) in believed.items():
        if symbol in (tolerance or {}):
            assert (share, origin) == (0.2, "unit file")
        else:
            assert (share, origin) == (expected.pop(symbol), "default")
    assert set(expected) == set(tolerance or {})


@pytest.mark.parametrize("name", ["one-stage", "two-stage"])
def test_new_file_states_tolerances_by_kind(name):
    text = config_path("templates", name).read_text(encoding="utf-8")
    unit = unit_from_mapping(tomllib.loads(text), name)
    assert {origin for _, origin in unit.believed.values()} == {"default"}
    (said,) = re.findall(r"kind: (.*?)\. Counted", text, re.DOTALL)
    assert [float(word) for word in re.findall(r"0\.\d+", said)] == [0.08, 0.10, 0.15, 0.30, 0.05]


@given(
    st.floats(1e-6, 0.5),
    st.sampled_from([("uniform", 3.0**0.5), ("triangular", 6.0**0.5), ("normal", 1.96)]),
)
def test_limits_count_as_their_standard_deviation(within, kind):
    distribution, divisor = kind
    unit = unit_with({"R_m": {"within": within, "distribution": distribution}})
    assert unit.believed["R_m"] == (pytest.approx(within / divisor), "unit file")
    rng = np.random.default_rng(0)
    drawn = {
        "uniform": rng.uniform(-within, within, 20_000),
        "triangular": rng.triangular(-within, 0.0, within, 20_000),
        "normal": rng.normal(0.0, within / 1.959964, 20_000),
    }[distribution]
    assert unit.tolerances["R_m"] == pytest.approx(drawn.std(), rel=0.03)
    assert unit.with_parameters(J_L=0.003).believed == unit.believed


@pytest.mark.parametrize(
    "value",
    [{}, {"within": -0.1}, {"within": "a"}, {"within": 0.1, "distribution": "beta"},
     {"within": 0.1, "sigma": 2.0}, {"within": 2.0}, {"within": True}],
)  # fmt: skip
def test_invalid_limits_are_refused_in_one_line(value):
    with pytest.raises(ConfigurationError, match=r"mine\.toml: tolerance\.R_m") as caught:
        unit_with({"R_m": value})
    assert "\n" not in str(caught.value)


def test_tolerance_precedence_is_option_name_default():
    """An option counts before the file, a name before the default."""
    unit = unit_with({"default": 0.02, "R_m": 0.06, "N": 0.001, "k_a": 0})
    assert unit.believed["R_m"] == (0.06, "unit file")
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
    assert unit.believed["R_m"] == (0.06, "unit file")


@given(st.sampled_from(["k_s2", "r_m", "", "b_t_deg", "filter_denominator", "J_p2 "]))
def test_unknown_tolerance_name_lists_allowed_ones(name):
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
def test_invalid_tolerance_is_refused(value):
    with pytest.raises(ConfigurationError, match=r"mine\.toml: tolerance"):
        unit_with({"R_m": value})


def test_one_stage_drive_has_no_second_tolerance():
    document = tomllib.loads(config_path("templates", "one-stage").read_text())
    assert "k_2" not in unit_from_mapping(document, "one").tolerances
    document["tolerance"] = {"k_2": 0.1}
    with pytest.raises(ConfigurationError, match="k_2"):
        unit_from_mapping(document, "one")
