"""Values that cannot be are refused when a unit file is read; unusual ones are told."""

import re
import tomllib

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from daq.configs import config_names, config_path
from daq.errors import ConfigurationError
from sim.datasheet import find_impossible, find_unusual, natural_frequencies
from sim.unit import load_unit, unit_from_mapping

KRPM = 1000 * 2 * 3.141592653589793 / 60


def file_with(tmp_path, template="two-stage", **values):
    text = config_path("templates", template).read_text(encoding="utf-8")
    for symbol, value in values.items():
        text, found = re.subn(rf"(?m)^{symbol} = .*$", f"{symbol} = {value}", text)
        assert found == 1, symbol
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("kind", "names"),
    # The third template is parts that are added to one of these.
    [("units", config_names("units")), ("templates", ("one-stage", "two-stage"))],
)
def test_shipped_units_raise_no_remark(kind, names):
    for name in names:
        unit = load_unit(str(config_path(kind, name)))
        assert (find_impossible(unit), find_unusual(unit)) == ([], []), name


@pytest.mark.parametrize(
    ("values", "key", "remedy"),
    [
        # The template's motor: 4.6e-2, 1.4e-5, 1.5e-2; every value as its catalogue prints it.
        ({"k_b": 4.6e-2 * KRPM}, "motor.k_b 4.817", "if k_b is in V/krpm, give 0.046"),
        ({"k_b": 1 / 4.6e-2 / KRPM * 1000}, "motor.k_b 207.6", "if k_b is in rpm/V, give 0.046"),
        ({"k_b": 4.6e-2 * KRPM / 1000}, "motor.k_b 0.004817", "if k_b is in V/rpm, give 0.046"),
        ({"k_t": 46.0}, "motor.k_b 0.046", "if k_t is in mN.m/A, give 0.046"),
        ({"k_t": 6.514}, "motor.k_b 0.046", "if k_t is in oz.in/A, give 0.046"),
        ({"J_m": 140.0}, "motor.J_m 140 kg.m^2", "if J_m is in g.cm^2, give 1.4e-05"),
        ({"J_m": 0.14}, "motor.J_m 0.14 kg.m^2", "if J_m is in kg.cm^2, give 1.4e-05"),
        ({"J_L": 6.0e4}, "load.J_L 6e+04 kg.m^2", "if J_L is in g.cm^2, give 0.006"),
        ({"J_g1": 300.0}, "stage1.J_g1 300 kg.m^2", "if J_g1 is in g.cm^2, give 3e-05"),
        ({"T_f_m": 15.0}, "motor.T_f_m 15 N.m", "if T_f_m is in mN.m, give 0.015"),
        ({"L_a": 2.6, "R_m": 1.2}, "motor.L_a 2.6 H", "if L_a is in mH, give 0.0026"),
        ({"L_a": 1200.0}, "motor.L_a 1200 H", "if L_a is in uH, give 0.0012"),
        ({"N_1": 0.0}, "N_1", "greater than 0"),
        ({"N_1": 0.01}, "stage1.N_1 0.01", "turns of the faster side"),
        ({"start_hz": 600.0}, "limits.start_hz 600 Hz", "no band for a sweep"),
        ({"start_hz": 1e4, "stop_hz": 2e4}, "limits.start_hz 1e+04 Hz", "no allowed sweep"),
        ({"source_vpk": 0.02, "source_offset_v": 0.0}, "motor.T_f_m 0.015 N.m", "holds the motor"),
        ({"filter_denominator": "[1.0, 1.0, 1e-7]"}, "filter_numerator 9.87e+05", "equal"),
    ],
)  # fmt: skip
def test_impossible_file_is_refused_with_plausible_range(values, key, remedy, tmp_path):
    path = file_with(tmp_path, **values)
    with pytest.raises(ConfigurationError) as caught:
        load_unit(path)
    said = str(caught.value)
    assert said.startswith(path)
    assert key in said
    assert remedy in said
    assert "\n" not in said
    assert ("plausible: " in said) or values == {"N_1": 0.0} or "no allowed sweep" in said


@pytest.mark.parametrize(
    ("values", "key", "remedy"),
    [
        ({"k_b": 0.08}, "motor.k_b 0.08 V.s/rad: 1.74 times k_t", "AC motors"),
        ({"R_m": 1000.0, "k_a": 200.0}, "motor.R_m 1000 ohm", "if R_m is in mohm, give 1"),
        ({"L_a": 1.2}, "motor.L_a 1.2 H", "if L_a is in mH, give 0.0012"),
        ({"b_t_deg": 7.2}, "backlash.b_t_deg 7.2 deg", "if b_t_deg is in arcmin, give 0.12"),
        ({"J_L": 60.0}, "load.J_L 60 kg.m^2", "if J_L is in kg.cm^2, give 0.006"),
        ({"J_L": 2e-6}, "load.J_L 2e-06 kg.m^2", "times J_m"),
        ({"B_m": 0.1}, "motor.B_m 0.1 N.m.s/rad", "if B_m is in mN.m.s/rad, give 0.0001"),
        ({"T_f_L": 7.0}, "load.T_f_L 7 N.m", "if T_f_L is in mN.m, give 0.007"),
        ({"N_1": "0.16667"}, "stage1.N_1 0.1667", "turns of the faster side"),
        ({"N": "1.0"}, "stage2.N 1", "a drive with one stage has no [stage2]"),
        ({"k_ts": 7.0}, "electronics.k_ts 7 V.s/rad", "if k_ts is in V/krpm, give 0.06685"),
        ({"k_s1": 0.0175}, "linear ARF 2.", "if k_s1 is in N.m/arcmin, give 60.16"),
        ({"stop_hz": 60.0}, "limits.stop_hz 60 Hz: the linear ARF 125.4 Hz", "limits are right"),
        ({"filter_numerator": 500.0, "filter_denominator": "[1.0, 32.0, 500.0]"},
         "electronics.filter_denominator 500: the filter's corner", "rad/s"),
        ({"filter_denominator": "[1.0, 10.0, 986960.0]"}, "damping ratio is 0.005", "omega"),
    ],
)  # fmt: skip
def test_unusual_value_is_reported_in_one_sentence(values, key, remedy, tmp_path):
    (said,) = find_unusual(load_unit(file_with(tmp_path, **values)))
    assert key in said
    assert remedy in said


def test_two_unit_slips_are_reported_together(tmp_path):
    with pytest.raises(ConfigurationError) as caught:
        load_unit(file_with(tmp_path, k_b=4.8, L_a=1200.0))
    assert "motor.k_b" in str(caught.value)
    assert "motor.L_a" in str(caught.value)


def scaled(size, template="two-stage"):
    """The example as a drive of another size: lengths times `size`, the same materials."""
    document = tomllib.loads(config_path("templates", template).read_text(encoding="utf-8"))
    power = {"k_t": 2, "k_b": 2, "B_m": 4, "T_f_m": 4, "T_f_L": 4, "L_a": -0.5, "R_m": -1}
    power |= dict.fromkeys(("J_m", "J_g1", "J_s1", "J_p2", "J_L"), 5)
    power |= dict.fromkeys(("k_g1", "k_s1", "k_2"), 3)
    for section in ("motor", "electronics", "stage1", "stage2", "load", "limits"):
        for symbol in document.get(section, ()):
            if symbol in power:
                document[section][symbol] *= size ** power[symbol]
            if symbol in ("start_hz", "stop_hz"):
                document[section][symbol] /= size
    return unit_from_mapping(document, source="here")


@settings(max_examples=20)
@given(
    size=st.floats(0.2, 5.0),
    template=st.sampled_from(["one-stage", "two-stage"]),
    shares=st.lists(st.floats(0.6, 1.6), min_size=4, max_size=4),
)
def test_drive_of_another_size_is_accepted(size, template, shares):
    unit = scaled(size, template)
    symbols = ("J_L", "k_s1", "T_f_m", "R_m")
    values = {s: unit.parameters[s] * share for s, share in zip(symbols, shares, strict=True)}
    assert find_impossible(unit.with_parameters(**values)) == []


SLIPS = [
    (symbol, factor)
    for symbols, factors in [
        (("k_t",), (1e3, 1e2, 141.6, 10.197)),
        (("k_b",), (104.72, 0.10472, 1e3)),
        (("J_m", "J_L", "J_g1"), (1e7, 1e9)),
        (("J_m",), (1e4, 1e6)),
        (("T_f_m",), (1e3,)),
    ]
    for symbol in symbols
    for factor in factors
]


@settings(max_examples=20)
@given(size=st.floats(0.5, 2.0), slip=st.sampled_from(SLIPS))
@example(size=1.0, slip=("J_L", 1e7))
def test_unit_slip_is_refused_naming_its_value(size, slip):
    unit, (symbol, factor) = scaled(size), slip
    wrong = unit.with_parameters(**{symbol: unit.parameters[symbol] * factor})
    (said,) = find_impossible(wrong)
    assert f"if {symbol} is in " in said
    given_back = [
        float(v) for v in re.findall(rf"if {symbol} is in [^,;]+, give ([\d.e+-]+)", said)
    ]
    right = unit.parameters[symbol]
    assert min(abs(value / right - 1.0) for value in given_back) < 30.0


@pytest.mark.parametrize(
    ("name", "arf_hz", "rf_hz"), [("adss", 149.0, 154.7), ("edss", 125.0, 158.9)]
)
def test_linear_frequencies_are_of_closed_drive(name, arf_hz, rf_hz):
    import numpy as np

    from sim.drivetrain import paper_drivetrain

    unit = load_unit(name)
    found = natural_frequencies(unit)
    assert found.anti_resonances_hz[0] == pytest.approx(arf_hz, rel=1e-3)
    assert found.resonances_hz[0] == pytest.approx(rf_hz, rel=1e-3)
    # The response of the engine's own matrices has its deepest point there.
    f = np.linspace(0.9 * arf_hz, 1.1 * arf_hz, 4001)
    gain = np.abs(paper_drivetrain(unit, 1.0).system().transfer(f))
    assert f[np.argmin(gain)] == pytest.approx(found.anti_resonances_hz[0], rel=2e-3)
