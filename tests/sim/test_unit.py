"""Units under test: Table 1 arrives whole, and nothing wrong gets in."""

import math
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.configs import config_path
from daq.errors import ConfigurationError
from sim.unit import load_unit, stage_backlash, unit_from_mapping

COMMON = {
    "L_a": 8.50e-4, "R_m": 4.10, "k_b": 3.44e-2, "k_t": 3.49e-2, "J_m": 8.60e-6, "B_m": 1.6e-4,
    "T_f_m": 1.40e-2, "k_a": 4.11, "k_ts": 8.60e-2, "filter_numerator": 723439.0,
}  # fmt: skip
TABLE_1 = {
    "adss": {
        "N_1": 5.94, "k_g1": 3.40e4, "J_g1": 2.34e-5, "k_s1": 22.8, "J_s1": 8.30e-8,
        "J_p2": 2.21e-7, "N": 10.5, "k_2": 7.74e4, "J_L": 2.75e-3, "T_f_L": 7.0e-3,
        "b_t_deg": 0.066,
    },
    "edss": {
        "N_1": 6.41, "k_g1": 4.74e4, "J_g1": 3.69e-5, "k_s1": 154.0, "J_s1": 2.04e-7,
        "J_p2": 4.84e-7, "N": 7.75, "k_2": 2.54e5, "J_L": 1.44e-2, "T_f_L": 7.1e-3,
        "b_t_deg": 0.276,
    },
}  # fmt: skip


def document():
    return tomllib.loads(config_path("units", "adss").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ["adss", "edss"])
def test_shipped_units_hold_the_published_table(name):
    unit = load_unit(name)
    assert unit.name == name.upper()
    assert unit.parameters == COMMON | TABLE_1[name]
    assert unit.electronics.filter_denominator == (1.0, 1710.0, 723439.0)


def test_all_faults_are_named_with_file_key(tmp_path):
    wrong = tmp_path / "wrong.toml"
    text = config_path("units", "adss").read_text(encoding="utf-8")
    text = text.replace("R_m = 4.10", "R_m = -4.10").replace("k_ts = 8.60e-2", 'k_ts = "much"')
    text = text.replace("J_L = 2.75e-3", "J_l = 2.75e-3").replace(
        "b_t_deg = 0.066", "b_t_deg = nan"
    )
    wrong.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError) as caught:
        load_unit(str(wrong))
    message = str(caught.value)
    assert str(wrong) in message
    for key in ("motor.R_m", "electronics.k_ts", "load.J_L", "load.J_l", "backlash.b_t_deg"):
        assert key in message
    assert "-4.1" in message
    assert "much" in message
    assert "\n" not in message
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"schema = ", "not valid TOML"),
        (b"\xff\xfe", "cannot be read"),
        (b"", "motor"),
        (b"schema = 2", "schema"),
        (b"schema = true", "schema"),
    ],
)
def test_file_that_is_no_unit_is_refused(tmp_path, content, said):
    path = tmp_path / "unit.toml"
    path.write_bytes(content)
    with pytest.raises(ConfigurationError, match=said):
        load_unit(str(path))


@pytest.mark.parametrize("name", ["nosuch", "../units", "/", "a\0b"])
def test_unknown_name_is_refused_with_known_ones(name):
    with pytest.raises(ConfigurationError, match="adss, edss"):
        load_unit(name)


def paths(value, at=()):
    if isinstance(value, dict):
        for key, item in value.items():
            yield from paths(item, (*at, key))
    else:
        yield at


@given(data=st.data())
def test_single_bad_value_refuses_the_unit(data):
    bad = document()
    *sections, key = data.draw(st.sampled_from(sorted(paths(bad))))
    place = bad
    for section in sections:
        place = place[section]
    good = place[key]
    place[key] = data.draw(
        st.sampled_from([None, "", "1.0", [], {}, math.nan, math.inf, -1.0, -math.inf, True])
    )
    if key == "name" and place[key] == "1.0":
        return
    with pytest.raises(ConfigurationError, match=key):
        unit_from_mapping(bad, source="here")
    if sections == ["tolerance"]:  # what is not named there has a default
        return
    del place[key]
    with pytest.raises(ConfigurationError, match=rf"{key}.*[Rr]equired"):
        unit_from_mapping(bad, source="here")
    place[key] = good
    place[f"{key}_too"] = good
    with pytest.raises(ConfigurationError, match=f"{key}_too"):
        unit_from_mapping(bad, source="here")


def test_integers_are_numbers_but_booleans_are_not():
    written = document()
    written["stage2"]["N"] = 10
    assert unit_from_mapping(written, source="here").stage2.N == 10.0
    written["electronics"]["filter_denominator"] = [1, 1710, 723439]
    assert unit_from_mapping(written, source="here").electronics.filter_denominator[1] == 1710.0
    written["electronics"]["filter_denominator"] = [1, 1710]
    with pytest.raises(ConfigurationError, match="filter_denominator"):
        unit_from_mapping(written, source="here")


def test_changed_parameter_is_checked_like_a_file():
    unit = load_unit("adss")
    changed = unit.with_parameters(k_s1=30.0, b_t_deg=0)
    assert changed.parameters == unit.parameters | {"k_s1": 30.0, "b_t_deg": 0.0}
    assert unit.stage1.k_s1 == 22.8
    with pytest.raises(ConfigurationError, match=r"no parameter 'k_s2'.*k_s1"):
        unit.with_parameters(k_s2=1.0)
    with pytest.raises(ConfigurationError, match=r"stage1\.k_s1.*-1"):
        unit.with_parameters(k_s1=-1.0)


@given(
    ratio=st.floats(0.0, 1.0),
    b_t_deg=st.floats(0.0, 10.0),
    N=st.floats(1.0, 200.0),
)
def test_stage_backlash_adds_up_to_the_total(ratio, b_t_deg, N):
    b = stage_backlash(ratio, b_t_deg, N)
    assert b.b2_deg + b.b1_deg / N == pytest.approx(b_t_deg, abs=1e-12)
    if b_t_deg > 1e-9:
        assert b.b1_deg / N / b_t_deg == pytest.approx(ratio, abs=1e-12)
    delta_1, delta_2 = b.half_plays_rad
    assert 2.0 * math.degrees(delta_1) == pytest.approx(b.b1_deg)
    assert 2.0 * math.degrees(delta_2) == pytest.approx(b.b2_deg)


def test_stage_backlash_of_azimuth_at_a_quarter():
    b = stage_backlash(0.25, 0.066, 10.5)
    assert (b.b1_deg, b.b2_deg) == (pytest.approx(0.17325), pytest.approx(0.0495))


@pytest.mark.parametrize("ratio", [-0.01, 1.01, math.nan, math.inf])
def test_ratio_outside_0_to_1_is_refused(ratio):
    with pytest.raises(ConfigurationError, match="outside 0 to 1"):
        stage_backlash(ratio, 0.066, 10.5)
