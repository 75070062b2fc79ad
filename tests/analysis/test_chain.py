"""The chain from servo to features: what must not matter does not, what must scale does."""

from dataclasses import replace

import numpy as np
import pytest
from worlds.side_by_side import ADSS, FRICTIONLESS, state_space

from analysis.resonance import extract
from daq.frf import FrequencyResponse
from daq.plan import SweepPlan
from sim.effects import parse_effect
from sim.response import simulate

C_S1 = 0.02
DAMPED = (parse_effect(f"shaft-damping:c_s1={C_S1}"),)
BAND = (110.0, 130.0, 150.0)
LINEAR = ADSS.with_parameters(**FRICTIONLESS, b_t_deg=0.0)


def swept(unit=LINEAR, ratio=0.3, levels=(1.0, 2.5), **changes):
    plan = SweepPlan(BAND, levels, settle_cycles=400, integrate_cycles=4, **changes)
    return simulate(unit, ratio, plan, effects=DAMPED)


@pytest.fixture(scope="module")
def upward():
    return swept()


def test_a_linear_servo_answers_in_proportion(upward):
    low, high = (upward.gain[upward.source_vpk == level] for level in (1.0, 2.5))
    np.testing.assert_allclose(high, low, rtol=1e-6)
    expected = state_space(LINEAR, c_s1=C_S1)(2j * np.pi * np.array(BAND))
    np.testing.assert_allclose(low, expected, rtol=1e-4)


def test_sweep_direction_does_not_affect_linear_servo(upward):
    down = swept(direction="down", levels=(1.0,))
    np.testing.assert_allclose(down.gain, upward.gain[upward.source_vpk == 1.0], rtol=1e-6)


MECHANICAL = ("J_m", "J_g1", "J_s1", "J_p2", "J_L", "k_g1", "k_s1", "k_2", "B_m")
FRICTION = ("T_f_m", "T_f_L")
ELECTRIC = ("L_a", "R_m", "k_b", "k_ts")


def multiplied(unit, factors):
    """A unit some of whose parameters are so many times what they were."""
    old = unit.parameters
    return unit.with_parameters(**{name: factor * old[name] for name, factor in factors.items()})


@pytest.mark.parametrize("factor", [0.3, 7.0])
def test_a_scaled_linear_servo_answers_as_scaled(factor, upward):
    gain = upward.gain[upward.source_vpk == 1.0]
    tachometer = swept(multiplied(LINEAR, {"k_ts": factor}), levels=(1.0,))
    np.testing.assert_allclose(tachometer.gain, factor * gain, rtol=1e-6)
    # All of the mechanics so much heavier and stiffer, and a motor to match: the current is the
    # same, the speed is smaller by the root.
    heavy = dict.fromkeys(MECHANICAL, factor**2) | {"k_t": factor, "k_b": factor}
    damped = (parse_effect(f"shaft-damping:c_s1={C_S1 * factor**2!r}"),)
    plan = SweepPlan(BAND, (1.0,), settle_cycles=400, integrate_cycles=4)
    scaled = simulate(multiplied(LINEAR, heavy), 0.3, plan, effects=damped)
    np.testing.assert_allclose(scaled.gain, gain / factor, rtol=1e-6)


WITH_PLAY = SweepPlan((118.0, 138.0, 150.0), (1.5, 2.5), settle_cycles=15, integrate_cycles=10)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("names", "levels"),
    [((*MECHANICAL, *FRICTION, "k_t"), 1.0), (ELECTRIC, 4.0)],
    ids=["torque", "voltage"],
)
def test_units_of_torque_and_voltage_cancel(names, levels, seed):
    """A power of two rounds nothing, so that not even chatter tells the two apart."""
    told = simulate(ADSS, 0.3, WITH_PLAY, seed=seed)
    plan = replace(WITH_PLAY, levels_vpk=tuple(levels * v for v in WITH_PLAY.levels_vpk))
    renamed = simulate(multiplied(ADSS, dict.fromkeys(names, 4.0)), 0.3, plan, seed=seed)
    np.testing.assert_allclose(renamed.gain, told.gain, rtol=1e-9)


@pytest.mark.parametrize(("limit", "near"), [(0.0, 1e-9), (1.0, 1.0 - 1e-9)])
def test_one_stage_is_limit_of_uneven_shares(limit, near):
    """All of the backlash in one stage gives the response of nearly all."""
    # Weakly driven: where it chatters, any change at all makes another motion.
    plan = replace(WITH_PLAY, levels_vpk=(1.5,))
    at, beside, other = (simulate(ADSS, r, plan, seed=1).gain for r in (limit, near, 1.0 - limit))
    np.testing.assert_allclose(beside, at, rtol=1e-4)
    assert np.abs(other / at - 1.0).max() > 0.01


@pytest.mark.parametrize("ratio", [0.0, 1.0])
def test_split_is_irrelevant_without_backlash(ratio, upward):
    np.testing.assert_allclose(
        swept(ratio=ratio, levels=(1.0,)).gain, upward.gain[upward.source_vpk == 1.0], rtol=1e-9
    )


def pair(f, seed=0, noise=0.01):
    """An anti-resonance at 45 and a resonance at 80 in noise."""
    h = (1 - (f / 45) ** 2 + 0.06j * f / 45) / (1 - (f / 80) ** 2 + 0.08j * f / 80)
    rng = np.random.default_rng(seed)
    return h * (1 + noise * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size)))


def read(f, gain, direction=None):
    (level,) = extract(FrequencyResponse.from_arrays(f, 1.0, gain, unit="", direction=direction))
    return level


def test_downward_sweep_is_read_alike():
    f = np.linspace(20, 110, 181)
    gain = pair(f)
    up, down = read(f, gain, "up"), read(f[::-1], gain[::-1], "down")
    for one, other in ((up.arf, down.arf), (up.rf, down.rf)):
        assert other.frequency_hz == pytest.approx(one.frequency_hz, abs=1e-9)
        assert other.std_hz == pytest.approx(one.std_hz, rel=1e-6)


def test_fewer_readings_widen_the_interval():
    """A quarter of the readings: twice the error bar is due, and no seed may bring it below one."""
    f = np.linspace(20, 110, 361)
    ratios = []
    for seed in range(8):
        gain = pair(f, seed)
        whole, part = read(f, gain), read(f[::4], gain[::4])
        ratios += [part.arf.std_hz / whole.arf.std_hz, part.rf.std_hz / whole.rf.std_hz]
    assert min(ratios) > 1.0
    assert 1.5 < np.median(ratios) < 2.7
