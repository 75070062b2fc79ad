"""Every effect of the catalogue against the oracle, and every wrong setting refused."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from oracle import rk4
from worlds.side_by_side import ADSS, EDSS, departure, drive, engine_gain, half_plays

from daq.errors import ConfigurationError
from sim.catalogue import BUILT_IN
from sim.effects import EffectSetting, drivetrain_with, parse_effect

QUIET = {"c_s1": 0.02, "c_g1": 0.8, "c_2": 2.0}
"""Dampers that make the motion periodic, so that one number can be compared."""

BASE = ["shaft-damping:c_s1=0.02", "mesh1-damping:c_g1=0.8", "mesh2-damping:c_2=2"]
UNIT, RATIO, LEVEL, FREQUENCY_HZ = ADSS.with_parameters(b_t_deg=0.02), 0.25, 2.5, 125.0
SETTLED = 80
"""Cycles after which the motion repeats itself."""

CASES = {
    "load-viscous-damping:B_L=0.2": {"B_L": 0.2},
    "shaft-damping:c_s1=0.005": {"c_s1": 0.005},
    "mesh1-damping:c_g1=0.3": {"c_g1": 0.3},
    "mesh2-damping:c_2=20": {"c_2": 20.0},
    "load-coulomb-friction:T_f_L=0.1": {"T_f_L": 0.1},
    "load-stribeck-friction:T_s_L=0.05,omega_s=0.2": {"T_s_L": 0.05, "omega_s": 0.2},
    "motor-coulomb-friction:T_f_m=0.04": {"T_f_m": 0.04},
    "motor-viscous-friction:B_m=0.002": {"B_m": 0.002},
    "load-inertia:J_L=0.002": {"J_L": 0.002},
    "shaft-stiffness:k_s1=33": {"k_s1": 33.0},
    "shaft-hardening:h=3e5": {"h": 3e5},
    "total-backlash:b_t_deg=0.04": {"b_t_deg": 0.04},
    "cable-stiffness:K_c=400": {"K_c": 400.0},
    "load-torque-bias:T_b=0.2": {"T_b": 0.2},
    "payload-flexibility:J_p=4e-4,f_p=90,zeta_p=0.05": {"J_p": 4e-4, "f_p": 90.0, "zeta_p": 0.05},
    "amplifier-gain:k_a=3": {"k_a": 3.0},
    "amplifier-saturation:V_sat=6": {"V_sat": 6.0},
    "amplifier-lag:tau_a=4e-4": {"tau_a": 4e-4},
    "motor-resistance:R_m=5.5": {"R_m": 5.5},
    "motor-constant:scale=1.2": {"k_t": 1.2 * ADSS.motor.k_t, "k_b": 1.2 * ADSS.motor.k_b},
    "tachometer-gain:k_ts=0.1": {"k_ts": 0.1},
    "filter-corner:scale=0.7": {"filter_numerator": 723439.0 * 0.49,
                                "filter_a1": 1710.0 * 0.7, "filter_a0": 723439.0 * 0.49},
    "motor-inertia:J_m=1.2e-5": {"J_m": 1.2e-5},
    "mesh1-stiffness:k_g1=2e3": {"k_g1": 2e3},
    "mesh2-stiffness:k_2=8e3": {"k_2": 8e3},
    "gear-ratio:N_1=5": {"N_1": 5.0},
    "amplifier-dead-zone:V_d=0.5": {"V_d": 0.5},
    "amplifier-unevenness:scale=1.3": {"u_p": 0.3},
    "reading-delay:T_d=1e-3": {"late_s": 1e-3},
}  # fmt: skip


def identifier(text):
    return text.partition(":")[0]


def oracle_with(extras):
    if "late_s" in extras:
        harmonics = np.arange(4)
        turned = np.exp(-2j * np.pi * FREQUENCY_HZ * extras["late_s"] * harmonics)
        return oracle_with({}) * turned
    changed = {key: value for key, value in extras.items() if key in UNIT.parameters}
    unit = UNIT.with_parameters(**{k: v for k, v in changed.items() if k != "filter_numerator"})
    added = {k: v for k, v in extras.items() if k not in changed or k == "filter_numerator"}
    kept, _ = rk4.simulate_cycles(
        unit.parameters, *half_plays(unit, RATIO), LEVEL, FREQUENCY_HZ, SETTLED + 5, 1e-6, None,
        QUIET | added,
    )  # fmt: skip
    return kept[SETTLED:]


def engine_with(*texts):
    ids = {identifier(text) for text in texts}
    base = [text for text in BASE if identifier(text) not in ids]
    effects = [parse_effect(text) for text in (*base, *texts)]
    return engine_gain(UNIT, RATIO, FREQUENCY_HZ, LEVEL, SETTLED, 5, effects)


@pytest.fixture(scope="module")
def without():
    return oracle_with({}).mean(axis=0)


def test_every_effect_has_an_oracle_case():
    assert [identifier(text) for text in CASES] == list(BUILT_IN)


@pytest.mark.parametrize("text", CASES)
def test_effect_agrees_with_oracle_equations(text, without):
    expected = oracle_with(CASES[text])
    assert np.ptp(np.abs(expected[:, 1])) < 1e-3 * abs(expected[0, 1])
    expected, got = expected.mean(axis=0), engine_with(text).mean(axis=0)
    decibel, degree = departure(got[1], expected[1])
    assert decibel < 0.02
    assert degree < 0.2
    assert np.abs(got[2:] - expected[2:]).max() < 1e-3 * abs(expected[1])
    assert abs(got[0] - expected[0]) < 2e-3 * abs(expected[1])
    # A case that the effect does not change would prove nothing.
    assert abs(expected[1] / without[1] - 1.0) > 3e-3


def test_bias_gives_even_clip_odd_harmonics(without):
    biased = engine_with("load-torque-bias:T_b=0.2").mean(axis=0)
    clipped = engine_with("amplifier-saturation:V_sat=6").mean(axis=0)
    assert abs(biased[2]) > 100.0 * abs(without[2])
    assert abs(clipped[3]) > 2.0 * abs(without[3])
    assert abs(clipped[2]) < 1e-3 * abs(clipped[3])


def ends(unit):
    for effect in BUILT_IN.values():
        for end in (0, 1):
            yield EffectSetting(effect.id, {p.name: p.range(unit)[end] for p in effect.parameters})


def everything(unit, end):
    """Every effect at once, at one end of its range."""
    return [s for s in ends(unit) if s.values == {
        p.name: p.range(unit)[end] for p in BUILT_IN[s.id].parameters}]  # fmt: skip


@pytest.mark.parametrize("unit", [ADSS, EDSS], ids=["adss", "edss"])
def test_range_ends_of_effects_keep_motion_finite(unit):
    heavy = ["shaft-damping:c_s1=0.1", "mesh1-damping:c_g1=10", "mesh2-damping:c_2=100"]
    sets = [[setting] for setting in ends(unit)]
    sets += [[parse_effect(text) for text in heavy], everything(unit, 0), everything(unit, 1)]
    bound = unit.electronics.k_a * 5.0 / unit.motor.k_b * unit.electronics.k_ts
    for effects in sets:
        for f in (20.0, 140.0, 500.0):
            gains = engine_gain(unit, 0.4, f, 5.0, 5, 5, effects)
            assert np.all(np.isfinite(gains)), (effects, f)
            # No more than twice the speed at which back-EMF eats the largest drive.
            largest = max([1.0] + [max(1.0, *s.values.values()) for s in effects
                                   if s.id in ("amplifier-gain", "tachometer-gain")])  # fmt: skip
            assert np.abs(5.0 * gains[:, 1]).max() < 4.0 * largest * bound, (effects, f)


def test_settings_of_effect_reach_their_elements():
    effects = [
        "shaft-stiffness:k_s1=40",
        "shaft-hardening:h=100",
        "load-coulomb-friction:T_f_L=0.1",
        "load-stribeck-friction:T_s_L=0.05,omega_s=0.2",
    ]
    for order in (effects, effects[::-1]):
        elements = drivetrain_with(ADSS, 0.5, [parse_effect(text) for text in order]).elements
        assert elements["shaft_gear_half"].k == 80.0
        assert (elements["gear_half_hardening"].k, elements["gear_half_hardening"].h) == (80.0, 100)
        friction = elements["load_friction"]
        assert (friction.T, friction.T_s, friction.omega_s) == (0.1, 0.05, 0.2)


def test_effects_do_not_change_the_paper_model():
    before = drivetrain_with(ADSS, 0.3).system()
    drivetrain_with(ADSS, 0.3, [parse_effect(text) for text in CASES])
    after = drivetrain_with(ADSS, 0.3).system()
    assert np.array_equal(before.A, after.A)
    start = np.zeros(13)
    motions = [drive(system, start, 100.0, 2, 2.5)[0] for system in (before, after)]
    assert np.array_equal(*motions)


def test_catalogue_entries_are_whole():
    for key, effect in BUILT_IN.items():
        assert key == effect.id
        assert (effect.on_unit is None) != (effect.on_drivetrain is None)
        assert effect.meaning.endswith(".")
        for unit in (ADSS, EDSS):
            for parameter in effect.parameters:
                low, high = parameter.range(unit)
                assert parameter.allowed[0] <= low < high <= parameter.allowed[1]


@given(
    effect=st.sampled_from(sorted(BUILT_IN)),
    share=st.floats(0.0, 1.0),
    spaces=st.sampled_from(["", " "]),
)
def test_written_effect_is_read_back(effect, share, spaces):
    values = {}
    for parameter in BUILT_IN[effect].parameters:
        low, high = parameter.range(ADSS)
        values[parameter.name] = low + share * (high - low)
    text = ",".join(f"{spaces}{name}={value!r}" for name, value in values.items())
    read = parse_effect(f"{effect}:{text}")
    assert read.id == effect
    assert dict(read.values) == values


@given(st.text(max_size=60))
@example("")
@example(":")
@example("load-inertia")
@example("load-inertia:")
@example("load-inertia:J_L")
@example("load-inertia:J_L=")
@example("load-inertia:J_L=nan")
@example("load-inertia:J_L=inf")
@example("load-inertia:J_L=0")
@example("load-inertia:J_L=-1")
@example("load-inertia:J_L=1e999")
@example("load-inertia:J_L=1,J_L=1")
@example("load-inertia:J_L=1,J_m=1")
@example("load-inertia:J_l=1")
@example("load-inertia:J_L=one")
@example("load-inertia:J_L=1:2")
@example("load-stribeck-friction:T_s_L=1")
@example("LOAD-INERTIA:J_L=1")
def test_invalid_effect_text_is_refused(text):
    with pytest.raises(ConfigurationError) as caught:
        parse_effect(text)
    assert "\n" not in str(caught.value) or "\n" in text


def test_wrong_setting_lists_allowed_ones():
    with pytest.raises(ConfigurationError, match=r"'warp' is not in the catalogue.*load-inertia"):
        parse_effect("warp:x=1")
    with pytest.raises(ConfigurationError, match="takes T_s_L, omega_s; got T_s_L"):
        parse_effect("load-stribeck-friction:T_s_L=1")
    with pytest.raises(ConfigurationError, match=r"J_L = -1\.0 is outside .* kg\.m\^2"):
        parse_effect("load-inertia:J_L=-1")
    with pytest.raises(ConfigurationError, match="twice"):
        drivetrain_with(ADSS, 0.5, [parse_effect("load-inertia:J_L=1")] * 2)


def test_negative_bias_mirrors_positive_one():
    ahead = engine_with("load-torque-bias:T_b=0.2").mean(axis=0)
    back = engine_with("load-torque-bias:T_b=-0.2").mean(axis=0)
    assert back[1] == pytest.approx(ahead[1], rel=1e-2)
    assert back[2] == pytest.approx(-ahead[2], rel=5e-2)
