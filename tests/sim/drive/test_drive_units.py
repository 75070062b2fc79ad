"""Unit files of drives that are not the paper's: what is refused, and what stays as it was."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds import drives

from analysis.ensemble.model import every_single_cause
from daq.configs import config_names
from daq.errors import ConfigurationError
from sim.catalogue import BUILT_IN, not_of_unit
from sim.datasheet import describe_chain, find_impossible, natural_frequencies
from sim.drawn_effects import draw_effect
from sim.drivetrain import paper_drivetrain
from sim.effects import EffectSetting, drivetrain_with
from sim.unit import load_unit, unit_from_mapping

WRONG = (
    ({"sensor": drives.ENCODER}, "sampling"),
    ({"sampling": drives.SAMPLED, "sensor": {"kind": "encoder"}}, "sensor.counts"),
    ({"sampling": drives.SAMPLED, "sensor": drives.ENCODER | {"counts": 100.5}}, "100.5"),
    ({"sensor": {"kind": "tachometer", "counts": 4096.0}}, "counts"),
    ({"sensor": {"kind": "tachometer", "reads": "position"}}, "reads"),
    ({"sensor": {"kind": "tachometer", "held": True}}, "held"),
    ({"sensor": {"kind": "resolver"}}, "resolver"),
    ({"sensor": drives.LOAD_ACCELEROMETER | {"reads": "speed"}}, "reads"),
    ({"sensor": {"kind": "tachometer", "reads": "acceleration"}}, "reads"),
    ({"sensor": {"kind": "tachometer", "radius_m": 0.05}}, "radius_m"),
    ({"sensor": {"kind": "tachometer", "low_pass_hz": 500.0}}, "low_pass_hz"),
    ({"sensor": {"kind": "accelerometer"}, "filter": None}, "sensor.low_pass_hz"),
    ({"sensor": drives.LOAD_ACCELEROMETER | {"high_pass_hz": 1e3}}, "high_pass_hz"),
    ({"sensor": drives.LOAD_ACCELEROMETER | {"sampled": True}}, "sampling"),
    ({"sensor": {"kind": "current", "at": "load"}}, "sensor.at"),
    ({"sensor": {"kind": "current", "radius_m": 0.1}}, "radius_m"),
    ({"sensor": {"kind": "current"}, "amplifier": drives.CURRENT}, "whatever the drive does"),
    ({"sampling": {"rate_hz": 0.0}}, "rate_hz"),
    ({"sampling": {"rate_hz": 2e5}}, "rate_hz"),
    ({"sampling": {"rate_hz": 2000.0, "holds_command": False}}, "holds_command"),
    ({"sampling": {"rate_hz": 2000.0, "clock": 1.0}}, "clock"),
    ({"filter": None}, "filter_numerator"),
    ({"motor_coupling": {"k_cm": 50.0}}, "J_cm"),
    ({"load_coupling": {"k_cL": -1.0, "J_cL": 1e-4}}, "k_cL"),
)


@pytest.mark.parametrize(("sections", "named"), WRONG)
def test_a_wrong_section_is_refused_by_name(sections, named):
    with pytest.raises(ConfigurationError) as error:
        drives.unit(sections)
    assert named in str(error.value)
    assert "\n" not in str(error.value)
    assert "Value error" not in str(error.value)


def test_useless_values_beside_current_amplifier_are_refused():
    with_both = drives.document({}) | {"amplifier": drives.CURRENT}
    with pytest.raises(ConfigurationError, match="leave out L_a, R_m, k_b"):
        unit_from_mapping(with_both, "both.toml")
    without = drives.document({})
    del without["motor"]["R_m"]
    with pytest.raises(ConfigurationError, match=r"motor\.R_m is required"):
        unit_from_mapping(without, "neither.toml")


@pytest.mark.parametrize(
    ("sections", "named"),
    [
        ({"sampling": {"rate_hz": 600.0}}, "sampling.rate_hz 600"),
        ({"amplifier": drives.CURRENT | {"bandwidth_hz": 2.0}}, "amplifier.bandwidth_hz 2"),
        ({"load_coupling": {"k_cL": 1e-9, "J_cL": 1e-4}}, "load_coupling.k_cL"),
    ],
)
def test_impossible_value_is_refused_with_plausible_one(sections, named):
    (text, *_) = find_impossible(drives.unit(sections))
    assert named in text
    assert "plausible" in text


@given(
    counts=st.floats(allow_nan=True, allow_infinity=True),
    rate_hz=st.floats(allow_nan=True, allow_infinity=True),
    delay_s=st.floats(allow_nan=True, allow_infinity=True),
)
def test_clock_and_encoder_are_valid_or_refused(counts, rate_hz, delay_s):
    sections = {
        "sampling": {"rate_hz": rate_hz},
        "sensor": drives.ENCODER | {"counts": counts, "delay_s": delay_s},
    }
    good = (
        4.0 <= counts <= 1e9
        and counts == round(counts)
        and 0.0 < rate_hz <= 1e5
        and 0.0 <= delay_s <= 0.1
    )
    if good:
        paper_drivetrain(drives.unit(sections), 0.5).system()
        return
    with pytest.raises(ConfigurationError, match=r"^drive\.toml: "):
        drives.unit(sections)


def test_impossible_property_of_drive_is_refused():
    current = drives.unit(drives.DRIVES["current"])
    with pytest.raises(ConfigurationError, match="motor-resistance.*controls the current"):
        drivetrain_with(current, 0.5, [EffectSetting("motor-resistance", {"R_m": 3.0})])
    encoder = drives.unit(drives.DRIVES["encoder, speed"])
    assert set(not_of_unit(encoder)) == {"tachometer-gain", "filter-corner"}
    assert not not_of_unit(load_unit("adss"))


@pytest.mark.parametrize("name", drives.DRIVES)
def test_every_drive_accepts_every_other_effect(name):
    """All but the effects of parts that it lacks."""
    unit = drives.unit(drives.DRIVES[name])
    foreign = not_of_unit(unit)
    for effect in BUILT_IN.values():
        if effect.id not in foreign:
            ends = {p.name: sum(p.range(unit)) / 2.0 for p in effect.parameters}
            drivetrain_with(unit, 0.5, [EffectSetting(effect.id, ends)]).system()


@pytest.mark.parametrize("name", [*config_names("units"), "free"])
def test_every_effect_has_range_with_two_ends(name):
    """Also about a friction or a play that the datasheet has as 0."""
    unit = drives.unit({}, free=True) if name == "free" else load_unit(name)
    foreign = not_of_unit(unit)
    for hypothesis in every_single_cause(unit):
        assert np.all(np.isfinite(hypothesis.logs)), hypothesis.effects
        assert np.all(np.diff(hypothesis.logs, axis=1) > 0.1), hypothesis.effects
        hypothesis.within_tolerance(np.full(hypothesis.d, 0.5))
        hypothesis.machine(np.full(hypothesis.d, 0.5), 0).servo(unit)
    rng = np.random.default_rng(5)
    for _ in range(20):
        assert draw_effect(unit, (20.0, 60.0), rng).id not in foreign


def test_a_paper_unit_is_stored_as_before():
    """What is kept of a unit is found by its physics: no new section may show there."""
    known = load_unit("adss").physics
    assert list(known) == ["motor", "electronics", "stage1", "stage2", "load", "backlash"]
    assert "sampling" in drives.unit({"sampling": drives.SAMPLED}).physics


@pytest.mark.parametrize("name", drives.DRIVES)
def test_value_changed_by_symbol_keeps_others(name):
    unit = drives.unit(drives.DRIVES[name])
    for symbol, value in unit.parameters.items():
        changed = unit.with_parameters(**{symbol: value})
        assert changed.physics == unit.physics


def test_chain_description_lists_sections():
    text = "\n".join(
        describe_chain(drives.unit(drives.COUPLINGS | drives.DRIVES["encoder, speed"]))
    )
    for part in ("encoder", "4096 counts", "2000 Hz", "k_cm", "k_cL", "hub", "0.5 ms"):
        assert part in text
    soft = natural_frequencies(drives.unit(drives.COUPLINGS)).anti_resonances_hz[0]
    assert soft < natural_frequencies(drives.unit({})).anti_resonances_hz[0]
    assert "current" in "\n".join(describe_chain(drives.unit(drives.DRIVES["current"])))
