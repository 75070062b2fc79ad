"""Single precision: seven digits where that is enough, and the same machine in distribution."""

import numpy as np
import pytest
from worlds.asked_steps import overheard
from worlds.permutation import permutation_p
from worlds.side_by_side import (
    ADSS,
    EDSS,
    FRICTIONLESS,
    departure,
    drive,
    engine_gain,
    law_parameters,
)

from daq.plan import SweepPlan
from sim.catalogue import BUILT_IN
from sim.drivetrain import paper_drivetrain
from sim.effects import EffectSetting, drivetrain_with, parse_effect
from sim.engine.engine import Stretch, carry
from sim.engine.machine_code import architecture
from sim.engine.propagator import find_modes
from sim.engine.stepping import step_together
from sim.response import Servo, simulate_cycles

STEP_S = 1e-5
"""The step of the analyses, which are what asks for single precision."""


@pytest.mark.parametrize("unit", [ADSS, EDSS], ids=["adss", "edss"])
def test_linear_limit_holds_to_single_precision(unit):
    quiet = unit.with_parameters(**FRICTIONLESS, b_t_deg=0.0)
    system = drivetrain_with(quiet, 0.5, [parse_effect("shaft-damping:c_s1=0.002")]).system()
    eye = np.eye(len(system.b))
    for f in np.geomspace(20.0, 400.0, 8):
        steady = np.linalg.solve(2j * np.pi * f * eye - system.A, system.b.astype(complex))
        (gain,) = system.transfer(np.array([f]))
        kept, _ = drive(system, 2.5 * steady.imag, f, 20, 2.5, step_s=STEP_S, single=True)
        # The largest is what a sum over the longest cycle loses: 2e-5 was measured.
        assert np.abs(kept[:, 1, 0] / (2.5 * gain) - 1.0).max() < 2e-4
        assert np.abs(kept[:, [0, 2, 3], 0]).max() < 2e-4 * 2.5 * abs(gain)


DAMPERS = ("shaft-damping:c_s1=0.02", "mesh1-damping:c_g1=0.2", "mesh2-damping:c_2=2")
STRONGER = ("shaft-damping:c_s1=0.1", "mesh1-damping:c_g1=0.2", "mesh2-damping:c_2=5")


@pytest.mark.parametrize(
    ("unit", "ratio", "damped", "frequency_hz"),
    [
        (ADSS.with_parameters(b_t_deg=0.02), 0.25, DAMPERS[:1], 130.0),
        (ADSS, 0.0, DAMPERS, 180.0),
        (ADSS, 0.5, DAMPERS, 110.0),
        (EDSS.with_parameters(b_t_deg=0.06), 0.5, STRONGER, 80.0),
    ],
)
def test_agrees_with_double_where_motion_is_periodic(unit, ratio, damped, frequency_hz):
    effects = [parse_effect(text) for text in damped]
    one, other = (
        engine_gain(unit, ratio, frequency_hz, 2.5, 250, 20, effects, single=single)[:, 1]
        for single in (False, True)
    )
    decibel, degree = departure(other.mean(), one.mean())
    assert decibel < 0.01
    assert degree < 0.1


@pytest.mark.parametrize("effect", sorted(BUILT_IN))
@pytest.mark.parametrize("unit", [ADSS, EDSS], ids=["adss", "edss"])
def test_every_effect_agrees_until_start_decays(unit, effect):
    sizes = {}
    for p in BUILT_IN[effect].parameters:
        low, high = p.range(unit)
        sizes[p.name] = np.sqrt(max(low, 0.01 * high) * high)
    system = drivetrain_with(unit, 0.4, [EffectSetting(effect, sizes)]).system()
    rng = np.random.default_rng(1)
    state = np.zeros((len(system.states), 8))
    state[system.states.index("th_m'")] = 5.0 * rng.standard_normal(8)
    state[system.states.index("th_L'")] = 0.1 * rng.standard_normal(8)
    # One cycle of 256 steps, in which the meshes open and close; 3e-4 was measured at most.
    one, other = (
        drive(system, state, 390.0, 1, 2.5, step_s=STEP_S, single=single)[0]
        for single in (False, True)
    )
    assert np.any(one != other)
    assert np.abs(one - other).max() < 2e-3 * np.abs(one[:, 1]).max()


@pytest.mark.skipif(not architecture(), reason="what this processor does is not known here")
def test_decaying_motion_reaches_zero_without_denormals():
    system = drivetrain_with(ADSS, 0.4, [parse_effect("amplifier-lag:tau_a=0.0005")]).system()
    one, ends = np.ones(16), []
    # 0.2 s are 400 times the lag; the smallest number of full digits is left behind after 90.
    stretch = Stretch(100.0, 2.5 * one, 0.0 * one, 0.0 * one, 0, 20)
    start = np.zeros((len(system.states), 16))
    asking = carry(system, law_parameters(system, 16), start, [stretch], [STEP_S], True)
    step_together([overheard(asking, lambda steps, stepped: ends.append(stepped.q) or stepped)])
    (q,) = ends
    assert np.any(np.all(q == 0.0, axis=1))
    assert np.all((q == 0.0) | (np.abs(q) >= np.finfo(np.float32).tiny))
    assert np.float32(1e-38) * np.float32(0.1) > 0.0, "the caller's own arithmetic has changed"


def test_system_without_modes_keeps_double_precision():
    system = paper_drivetrain(ADSS, 0.25).system()
    modes = find_modes(system, worst_condition=0.0)
    start = np.zeros((len(system.states), 3))
    one, other = (
        drive(system, start, 120.0, 2, 2.5, single=single, modes=modes) for single in (False, True)
    )
    assert np.array_equal(one[0], other[0])
    assert np.array_equal(one[1], other[1])


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
@pytest.mark.parametrize(
    ("unit", "ratio", "band"),
    [(ADSS, 0.25, np.linspace(100.0, 165.0, 12)), (EDSS, 0.5, np.linspace(40.0, 117.0, 12))],
    ids=["adss", "edss"],
)
def test_undamped_units_scatter_as_in_double_precision(unit, ratio, band, seed):
    # Eight p-values (two units, two seeds, mean and scatter), each at or below 1e-3 with
    # probability 1e-3 if both are the same machine: a false alarm in fewer than 1 of 125 draws.
    rng = np.random.default_rng(seed)

    def runs(frequency_hz, single):
        servos = [Servo.of(unit, ratio, seed=int(rng.integers(2**30))) for _ in range(32)]
        plan = SweepPlan((frequency_hz,), (2.5,), settle_cycles=8, integrate_cycles=16)
        cycles = simulate_cycles(servos, plan, longest_step_s=STEP_S, single=single)
        return np.array(cycles)[:, 0, 0, :, 1]

    groups = [(runs(f, False), runs(f, True)) for f in band]
    assert min(permutation_p(groups, rng)) > 1e-3
