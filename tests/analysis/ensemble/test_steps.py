"""Steps of an ensemble: no longer than a drive's fastest motion allows."""

import numpy as np
import pytest

from analysis.ensemble.machine import safe_cycles
from daq.plan import SweepPlan
from sim.response import Servo, simulate_cycles
from sim.unit import load_unit

STEPS = [("r3-3", 4e-5), ("walkman-b11", 4e-5), ("adss", 1e-5)]


def swept(name):
    """Two servos of a unit, and a plan of few cycles about its features."""
    unit = load_unit(name)
    hertz = {"r3-3": (12.0, 33.0), "walkman-b11": (30.0, 55.0), "adss": (110.0, 140.0)}[name]
    plan = SweepPlan(hertz, (0.5 * unit.limits.source_vpk,), settle_cycles=6, integrate_cycles=6)
    ratio = 1.0 if unit.stages == 1 else 0.3
    return [Servo.of(unit, ratio, seed=seed) for seed in range(2)], plan


@pytest.mark.parametrize(("name", "step_s"), STEPS)
def test_slow_drive_takes_longer_steps(name, step_s):
    """The fastest modes are at 1132, 1142 and 9358 Hz, the encoder is read at 2 kHz."""
    servos, plan = swept(name)
    at_that = simulate_cycles(servos, plan, longest_step_s=step_s, single=True)
    np.testing.assert_array_equal(safe_cycles(servos, plan), at_that)


def test_longer_steps_show_same_readings():
    servos, plan = swept("r3-3")
    longer = np.array(safe_cycles(servos, plan))[..., 1].mean(axis=-1)
    finer = np.array(simulate_cycles(servos, plan, longest_step_s=5e-6))[..., 1].mean(axis=-1)
    np.testing.assert_allclose(longer, finer, rtol=2e-3)


def test_servos_of_other_steps_keep_order():
    slow, plan = swept("r3-3")
    fast = swept("adss")[0]
    mixed = safe_cycles([slow[0], fast[0], slow[1]], plan)
    for alone, servo in zip(mixed, (slow[0], fast[0], slow[1]), strict=True):
        np.testing.assert_array_equal(alone, safe_cycles([servo], plan)[0])
