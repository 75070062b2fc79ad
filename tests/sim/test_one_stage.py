"""A drive with one gear stage: held to a chain worked out by hand, and to a limit of two stages."""

import math
import tomllib

import numpy as np
import pytest
from worlds.chain_by_hand import chain

from daq.configs import config_path
from daq.errors import ConfigurationError
from daq.plan import SweepPlan
from sim.catalogue import BUILT_IN
from sim.drivetrain import paper_drivetrain
from sim.effects import EffectSetting, drivetrain_with
from sim.response import Servo, simulate_cycles
from sim.unit import load_unit, unit_from_mapping

TEMPLATE = str(config_path("templates", "one-stage"))
ONE = load_unit(TEMPLATE)


def document():
    return tomllib.loads(config_path("templates", "one-stage").read_text(encoding="utf-8"))


def test_linear_drive_equals_chain_by_hand():
    frequency = np.geomspace(5.0, 2000.0, 400)
    system = paper_drivetrain(ONE, 1.0).system()
    np.testing.assert_allclose(system.transfer(frequency), chain(ONE, frequency), rtol=1e-8)


def test_anti_resonance_is_load_on_its_shaft():
    # A shaft without inertia and a load alone: sqrt(k_s1/J_L), whatever drives it.
    light = ONE.with_parameters(J_s1=1e-9, J_g1=1e-9, k_g1=1e8)
    expected = math.sqrt(light.stage1.k_s1 / light.load.J_L) / (2 * math.pi)
    frequency = np.linspace(0.9 * expected, 1.1 * expected, 20001)
    gain = np.abs(paper_drivetrain(light, 1.0).system().transfer(frequency))
    assert frequency[np.argmin(gain)] == pytest.approx(expected, rel=1e-4)


def test_backlash_equals_two_stages_one_rigid():
    stiff = document()
    stiff["stage1"]["J_p2"] = 1e-7
    stiff["stage2"] = {"N": 1.0, "k_2": 1e6}
    two = unit_from_mapping(stiff, "limit")
    plan = SweepPlan((40.0, 62.0, 80.0, 103.0, 140.0), (2.0, 4.0), settle_cycles=30,
                     integrate_cycles=40, from_rest=True)  # fmt: skip
    gains = []
    for unit in (ONE, two):
        servos = [Servo.of(unit, 1.0, seed=seed) for seed in range(6)]
        cycles = np.array([one[..., 1] for one in simulate_cycles(servos, plan)])
        gains.append(20 * np.log10(np.abs(cycles.mean(axis=-1))))
    means = [gain.mean(axis=0) for gain in gains]
    spread = np.sqrt(sum(gain.var(axis=0, ddof=1) / len(gain) for gain in gains))
    assert np.all(np.abs(means[0] - means[1]) < 5.0 * spread + 0.1)
    # The play is felt: without it the response is another by far.
    linear = 20 * np.log10(np.abs(chain(ONE, np.array(plan.frequencies_hz))))
    assert np.abs(means[0].reshape(2, -1) - linear).max() > 3.0


def test_single_stage_holds_all_backlash():
    assert (ONE.stages, ONE.output_ratio) == (1, 1.0)
    backlash = ONE.split(1.0)
    assert (backlash.b1_deg, backlash.b2_deg) == (ONE.backlash.b_t_deg, 0.0)
    for ratio in (0.0, 0.5, 0.999):
        with pytest.raises(ConfigurationError, match="one gear stage"):
            ONE.split(ratio)


def test_every_effect_except_mesh_2_applies():
    for identifier, effect in BUILT_IN.items():
        setting = EffectSetting(
            identifier, {p.name: 0.5 * sum(p.range(ONE)) for p in effect.parameters}
        )
        if identifier.startswith("mesh2-"):
            with pytest.raises(ConfigurationError, match="one gear stage"):
                drivetrain_with(ONE, 1.0, [setting])
        else:
            system = drivetrain_with(ONE, 1.0, [setting]).system()
            assert "th_p2" not in system.states


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d["stage1"].update(J_p2=1e-7), "here: .stage2. is required by"),
        (lambda d: d.update(stage2={"N": 2.0, "k_2": 1e5}), "here: stage1.J_p2 is required by"),
        (
            lambda d: d["limits"].update(b2_deg=0.1),
            "here: limits.b2_deg limits stage 2, and there is none",
        ),
    ],
)
def test_half_a_second_stage_is_refused(change, said):
    wrong = document()
    change(wrong)
    with pytest.raises(ConfigurationError, match=said):
        unit_from_mapping(wrong, "here")


def test_changed_copy_keeps_its_one_stage():
    changed = ONE.with_parameters(J_L=3e-3)
    assert changed.stages == 1
    assert changed.parameters["J_L"] == 3e-3
    with pytest.raises(ConfigurationError, match="no parameter 'k_2'"):
        ONE.with_parameters(k_2=1.0)
