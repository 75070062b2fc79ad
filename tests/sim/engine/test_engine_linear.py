"""Without play and friction the engine is the analytic transfer function, to rounding."""

import numpy as np
import pytest
from worlds.side_by_side import ADSS, EDSS, FRICTIONLESS, drive, state_space

from sim.drivetrain import paper_drivetrain
from sim.effects import drivetrain_with, parse_effect
from sim.engine.propagator import build_propagator, find_modes

FREQUENCIES = np.geomspace(1.0, 1000.0, 16)
C_S1 = 2e-3


@pytest.mark.parametrize("unit", [ADSS, EDSS], ids=["adss", "edss"])
def test_linear_limit_is_the_transfer_function(unit):
    quiet = unit.with_parameters(**FRICTIONLESS, b_t_deg=0.0)
    effect = parse_effect(f"shaft-damping:c_s1={C_S1}")
    system = drivetrain_with(quiet, 0.5, [effect]).system()
    expected = state_space(quiet, c_s1=C_S1)(2j * np.pi * FREQUENCIES)
    assert np.abs(system.transfer(FREQUENCIES) / expected - 1.0).max() < 1e-8
    eye = np.eye(len(system.b))
    for f, gain in zip(FREQUENCIES, expected, strict=True):
        # Start on the steady state, by the matrices of the system itself: a wrong
        # matrix is caught above, a wrong step here.
        steady = np.linalg.solve(2j * np.pi * f * eye - system.A, system.b.astype(complex))
        kept, state = drive(system, 2.5 * steady.imag, f, 2, amplitude=2.5)
        assert np.abs(kept[:, 1, 0] / (2.5 * gain) - 1.0).max() < 1e-6
        assert np.abs(kept[:, [0, 2, 3], 0]).max() < 1e-6 * 2.5 * abs(gain)
        drifted = state[:, 0] - 2.5 * steady.imag
        assert np.abs(drifted).max() < 1e-6 * np.abs(steady).max()


def test_transient_decays_to_linear_limit():
    quiet = ADSS.with_parameters(**FRICTIONLESS, b_t_deg=0.0)
    effects = ["shaft-damping:c_s1=0.002", "load-viscous-damping:B_L=0.05"]
    system = drivetrain_with(quiet, 0.5, [parse_effect(e) for e in effects]).system()
    for f in (40.0, 139.0, 300.0):
        start = np.zeros(len(system.states))
        kept, _ = drive(system, start, f, 1, amplitude=2.5, settle=int(1.5 * f))
        (expected,) = system.transfer(np.array([f]))
        assert abs(kept[0, 1, 0] / 2.5 / expected - 1.0) < 1e-6


@pytest.mark.parametrize("step_s", [2e-6, 5e-6, 50e-6])
def test_linear_system_does_not_depend_on_step(step_s):
    quiet = EDSS.with_parameters(**FRICTIONLESS, b_t_deg=0.0)
    effects = ["shaft-damping:c_s1=0.1", "mesh1-damping:c_g1=10", "mesh2-damping:c_2=100"]
    system = drivetrain_with(quiet, 0.5, [parse_effect(e) for e in effects]).system()
    start = np.zeros(len(system.states))
    _, state = drive(system, start, 61.0, 5, amplitude=2.5, step_s=step_s)
    _, fine = drive(system, start, 61.0, 5, amplitude=2.5, step_s=1e-6)
    assert state[:, 0] == pytest.approx(fine[:, 0], rel=1e-7, abs=1e-9 * np.abs(fine).max())


def test_constant_offset_gives_motor_free_speed():
    quiet = ADSS.with_parameters(**FRICTIONLESS, b_t_deg=0.0)
    effects = ["shaft-damping:c_s1=0.002"]
    system = drivetrain_with(quiet, 0.5, [parse_effect(e) for e in effects]).system()
    start = np.zeros(len(system.states))
    kept, _ = drive(system, start, 50.0, 1, amplitude=1.0, offset=0.4, settle=60)
    p = ADSS.parameters
    speed = p["k_a"] * 0.4 * p["k_t"] / (p["k_t"] * p["k_b"] + p["R_m"] * p["B_m"])
    assert kept[0, 0, 0].real == pytest.approx(p["k_ts"] * speed, rel=1e-6)


def state_step(system, modes):
    """Step matrix and push in the coordinates of the states, from those of the modes."""
    step = build_propagator(system, modes, 120.0, 5e-6)
    carry = step.carried(np.eye(modes.shapes.shape[1]))
    return modes.shapes @ carry @ modes.weights, modes.shapes @ step.push, step.step_s


@pytest.mark.parametrize("unit", [ADSS, EDSS], ids=["adss", "edss"])
@pytest.mark.parametrize("effects", [(), ("shaft-damping:c_s1=0.1", "amplifier-lag:tau_a=1e-4")])
def test_one_step_is_the_matrix_exponential(unit, effects):
    """With modes and without."""
    system = drivetrain_with(unit, 0.3, [parse_effect(text) for text in effects]).system()
    n, inlets = len(system.b), np.array([law.inlet for law in system.nonlinearities]).T
    by_modes = find_modes(system)
    assert by_modes.rates.size >= n
    without = find_modes(system, worst_condition=0.0)
    assert without.rates.size == 0
    scale = np.sqrt(np.maximum(np.diag(system.energy), 1e-9))
    for modes in (by_modes, without):
        carry, push, h = state_step(system, modes)
        # The exponential of a 128th of the step, multiplied and added up: another way there.
        fine = np.eye(n)
        term = np.eye(n)
        held = np.zeros((n, n))
        for order in range(1, 12):
            held += term * (h / 128) / order
            term = term @ system.A * (h / 128) / order
            fine += term
        exact, area = np.eye(n), np.zeros((n, n))
        for _ in range(128):
            area, exact = area + exact @ held, exact @ fine
        for found, expected in ((carry, exact), (push, area @ inlets)):
            apart = np.abs(found - expected) * scale[:, None]
            assert apart.max() < 1e-8 * (np.abs(expected) * scale[:, None]).max()


def test_motion_is_equal_with_and_without_modes():
    system = paper_drivetrain(ADSS, 0.25).system()
    start = np.zeros(len(system.states))
    kept, state = drive(system, start, 130.0, 2, amplitude=2.5)
    without = find_modes(system, worst_condition=0.0)
    again, other = drive(system, start, 130.0, 2, amplitude=2.5, modes=without)
    assert np.abs(again - kept).max() < 1e-7
    # Rounding, which differs between processors, grows where the meshes hit: 1.4e-6 on one.
    assert other[:, 0] == pytest.approx(state[:, 0], rel=1e-5, abs=1e-6)
