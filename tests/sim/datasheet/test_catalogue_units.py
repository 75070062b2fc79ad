"""Catalogue units: each factor against one that is published, each spelling, each refusal."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.datasheet import parse_quantity, units_of

# NIST SP 811 (2008), appendix B.8, to the digits printed there; multiples of SI units follow.
PUBLISHED = {
    ("T_f_m", "oz.in"): 7.061552e-3,
    ("T_f_m", "lb.in"): 1.129848e-1,
    ("T_f_m", "lb.ft"): 1.355818,
    ("T_f_m", "kgf.cm"): 9.80665e-2,
    ("T_f_m", "gf.cm"): 9.80665e-5,
    ("T_f_m", "mN.m"): 1e-3,
    ("T_f_m", "N.cm"): 1e-2,
    ("T_f_m", "N.mm"): 1e-3,
    ("J_m", "lb.ft^2"): 4.214011e-2,
    ("J_m", "lb.in^2"): 2.926397e-4,
    ("J_m", "oz.in^2"): 2.926397e-4 / 16,
    ("J_m", "oz.in.s^2"): 7.061552e-3,
    ("J_m", "lb.in.s^2"): 1.129848e-1,
    ("J_m", "kg.cm^2"): 1e-4,
    ("J_m", "kg.mm^2"): 1e-6,
    ("J_m", "g.cm^2"): 1e-7,
    ("J_m", "g.mm^2"): 1e-9,
    ("k_b", "V/rpm"): 1 / 1.047198e-1,
    ("k_b", "V/krpm"): 1e-3 / 1.047198e-1,
    ("k_b", "mV/rpm"): 1e-3 / 1.047198e-1,
    ("k_b", "V.s/deg"): 1 / 1.745329e-2,
    ("k_b", "mV.s/rad"): 1e-3,
    ("k_b", "rpm/V"): 1 / 1.047198e-1,
    ("k_b", "rad/s/V"): 1.0,
    ("B_m", "mN.m.s/rad"): 1e-3,
    ("B_m", "N.m/krpm"): 1e-3 / 1.047198e-1,
    ("B_m", "mN.m/krpm"): 1e-6 / 1.047198e-1,
    ("B_m", "N.m/rpm"): 1 / 1.047198e-1,
    ("B_m", "mN.m/rpm"): 1e-3 / 1.047198e-1,
    ("B_m", "N.m.s/deg"): 1 / 1.745329e-2,
    ("B_m", "oz.in/krpm"): 7.061552e-3 * 1e-3 / 1.047198e-1,
    ("k_s1", "N.m/arcmin"): 1 / 2.908882e-4,
    ("k_s1", "N.m/deg"): 1 / 1.745329e-2,
    ("k_s1", "kN.m/rad"): 1e3,
    ("k_s1", "N.m/mrad"): 1e3,
    ("k_s1", "oz.in/rad"): 7.061552e-3,
    ("k_s1", "lb.in/rad"): 1.129848e-1,
    ("k_s1", "lb.in/deg"): 1.129848e-1 / 1.745329e-2,
    ("k_s1", "lb.in/arcmin"): 1.129848e-1 / 2.908882e-4,
    ("k_s1", "kgf.m/rad"): 9.80665,
    ("k_s1", "kgf.m/arcmin"): 9.80665 / 2.908882e-4,
    ("b_t_deg", "arcmin"): 2.908882e-4 / 1.745329e-2,
    ("b_t_deg", "arcsec"): 4.848137e-6 / 1.745329e-2,
    ("b_t_deg", "mrad"): 1e-3 / 1.745329e-2,
    ("b_t_deg", "rad"): 1 / 1.745329e-2,
    ("L_a", "mH"): 1e-3,
    ("L_a", "uH"): 1e-6,
    ("R_m", "mohm"): 1e-3,
    ("R_m", "kohm"): 1e3,
    ("start_hz", "kHz"): 1e3,
    ("start_hz", "rad/s"): 1.591549e-1,
    ("radius_m", "mm"): 1e-3,
    ("radius_m", "cm"): 1e-2,
    ("radius_m", "in"): 2.54e-2,
    ("k_acc", "V/(m/s^2)"): 1.0,
    ("k_acc", "mV/(m/s^2)"): 1e-3,
    ("k_acc", "V/g"): 1 / 9.80665,
    ("k_acc", "mV/g"): 1e-3 / 9.80665,
    ("k_angular", "V/(rad/s^2)"): 1.0,
    ("k_angular", "mV/(rad/s^2)"): 1e-3,
    ("k_angular", "mV/(deg/s^2)"): 1e-3 / 1.745329e-2,
    ("k_current", "mV/A"): 1e-3,
    ("k_current", "mV/mA"): 1.0,
    ("source_vpk", "mV"): 1e-3,
    ("source_vpk", "V rms"): 1.414214,
    ("source_vpk", "V pp"): 0.5,
}


@pytest.mark.parametrize(("symbol", "name"), PUBLISHED)
def test_a_factor_is_the_published_one(symbol, name):
    value, unit = parse_quantity(symbol, f"1 {name}")
    assert value == pytest.approx(PUBLISHED[symbol, name], rel=5e-7)
    assert unit.name == name
    per_four = 1 / 4 if unit.reciprocal else 4
    assert parse_quantity(symbol, f"4{name}")[0] == pytest.approx(per_four * value, rel=1e-15)


def test_every_unit_matches_its_published_factor():
    same = {"k_t": ("T_f_m", "/A"), "k_ts": ("k_b", ""), "T_f_L": ("T_f_m", "")}
    for symbol in ("L_a", "R_m", "k_b", "k_t", "k_ts", "J_m", "B_m", "T_f_m", "k_s1", "b_t_deg",
                   "start_hz", "source_vpk", "radius_m", "k_acc", "k_angular",
                   "k_current"):  # fmt: skip
        first, *others = units_of(symbol)
        assert first.factor == 1.0
        as_symbol, ending = same.get(symbol, (symbol, ""))
        for unit in others:
            published = PUBLISHED[as_symbol, unit.name.removesuffix(ending)]
            assert unit.factor == pytest.approx(published, rel=5e-7)


@pytest.mark.parametrize(
    ("symbol", "text", "value"),
    [
        ("J_m", "86 gcm2", 8.6e-6),
        ("J_m", "86 g·cm²", 8.6e-6),
        ("J_m", "86G-CM^2", 8.6e-6),
        ("k_t", "34.9mNm/A", 0.0349),
        ("k_t", "10 oz-in/A", 0.07061552),
        ("k_t", "10 in-oz/A", 0.07061552),
        ("k_t", "1 in-lb/A", 0.1129848),
        ("k_b", "3.6 V/1000rpm", 0.03437747),
        ("k_b", "3.6 V/(1000 rpm)", 0.03437747),
        ("k_b", "277.6 RPM/V", 0.03439946),
        ("k_b", "0.0344 V/(rad/s)", 0.0344),
        ("k_b", "6e-4 V/(deg/s)", 0.03437747),
        ("B_m", "0.1 mNm/(rad/s)", 1e-4),
        ("R_m", "4.1 Ω", 4.1),
        ("k_acc", "100 mV/g", 0.01019716),
        ("k_acc", "10.2 mV/(m/s²)", 0.0102),
        ("L_a", "850 µH", 8.5e-4),
        ("b_t_deg", "4'", 4 / 60),
        ("b_t_deg", "0.1 °", 0.1),
        ("source_vpk", "2 Vrms", 2 * math.sqrt(2)),
        ("source_vpk", "2 Vpp", 1.0),
        ("N_1", "72/12", 6.0),
        ("N_1", "72 : 12", 6.0),
        ("N_1", ".5e1", 5.0),
    ],
)
def test_spellings_of_catalogues_are_read(symbol, text, value):
    assert parse_quantity(symbol, text)[0] == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize(
    ("symbol", "text", "said"),
    [
        ("k_t", "", "not a number"),
        ("k_t", "much", "not a number"),
        ("k_t", "3,6 mNm/A", "decimal point"),
        ("k_t", "nan", "not a number"),
        ("k_t", "1e999", "too large"),
        ("k_t", "3.6 V/krpm", "is no unit of k_t; use one of: N.m/A, mN.m/A"),
        ("k_t", "3.6 MNm/A", "is no unit of k_t"),
        ("k_b", "0 rpm/V", "no inverse"),
        ("N_1", "72/0", "a ratio"),
        ("N_1", "72 teeth", "a ratio"),
        ("k_t", "1 N\nm/A", "not a number"),
    ],
)
def test_invalid_quantity_is_refused(symbol, text, said):
    with pytest.raises(ValueError, match=said):
        parse_quantity(symbol, text)


@given(st.sampled_from(["k_b", "J_m", "N_1", "b_t_deg", "source_vpk"]), st.text(max_size=20))
def test_any_text_is_finite_number_or_refused(symbol, text):
    try:
        value, _ = parse_quantity(symbol, text)
    except ValueError:
        return
    assert math.isfinite(value)
