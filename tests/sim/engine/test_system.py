"""Elements become the right matrices: held against equations (1) to (14) written out by hand."""

import numpy as np
import pytest
from worlds.side_by_side import ADSS, EDSS, FRICTIONLESS, state_space

from daq.errors import ConfigurationError
from sim.drivetrain import paper_drivetrain
from sim.effects import drivetrain_with, parse_effect
from sim.elements import Damper, HardeningSpring, Inertia, Mesh, Spring
from sim.engine.system import Assembly, Law

FREQUENCIES = np.geomspace(1.0, 1000.0, 400)


@pytest.mark.parametrize("unit", [ADSS, EDSS], ids=["adss", "edss"])
@pytest.mark.parametrize(
    ("effects", "extras"),
    [
        ((), {}),
        (("shaft-damping:c_s1=0.002",), {"c_s1": 2e-3}),
        (("load-viscous-damping:B_L=0.05", "cable-stiffness:K_c=30"), {"B_L": 0.05, "K_c": 30.0}),
    ],
    ids=["paper", "shaft-damping", "load"],
)
def test_transfer_matches_published_equations(unit, effects, extras):
    quiet = unit.with_parameters(**FRICTIONLESS, b_t_deg=0.0)
    system = drivetrain_with(quiet, 0.5, [parse_effect(e) for e in effects]).system()
    expected = state_space(quiet, **extras)(2j * np.pi * FREQUENCIES)
    assert np.abs(system.transfer(FREQUENCIES) / expected - 1.0).max() < 1e-8


def test_both_units_have_the_same_topology():
    adss, edss = (paper_drivetrain(unit, 0.3).system() for unit in (ADSS, EDSS))
    assert adss.states == edss.states
    assert len(adss.states) == 13
    assert [law.name for law in adss.nonlinearities] == [
        "mesh1", "mesh2", "motor_friction", "load_friction",
    ]  # fmt: skip
    assert np.array_equal(adss.A != 0.0, edss.A != 0.0)


def test_ratio_moves_backlash_between_gears():
    for ratio in (0.0, 0.25, 1.0):
        meshes = paper_drivetrain(ADSS, ratio).system().nonlinearities[:2]
        b_t = np.radians(ADSS.backlash.b_t_deg)
        assert meshes[0].parameters[0] == pytest.approx(0.5 * ratio * b_t * 10.5)
        assert meshes[1].parameters[0] == pytest.approx(0.5 * (1.0 - ratio) * b_t)


def oscillator():
    assembly = Assembly()
    for element in (
        Inertia("q", 2.0), Inertia("r", 0.5), Spring({"q": 1.0, "r": -3.0}, 8.0),
        Damper({"r": 1.0}, 0.25),
    ):  # fmt: skip
        element.enter(assembly)
    return assembly


def test_two_inertias_and_geared_spring_by_hand():
    system = oscillator().build(output={"q": 1.0})
    assert system.states == ("q", "r", "q'", "r'")
    by_hand = [[0, 0, 1, 0], [0, 0, 0, 1], [-4, 12, 0, 0], [48, -144, 0, -0.5]]
    assert np.array_equal(system.A, by_hand)
    energy = [[8, -24, 0, 0], [-24, 72, 0, 0], [0, 0, 2, 0], [0, 0, 0, 0.5]]
    assert np.array_equal(system.energy, energy)
    assert np.array_equal(system.o, [1, 0, 0, 0])


def test_stored_energy_changes_by_damping_alone():
    system = paper_drivetrain(EDSS, 0.4).replacing("motor", k_t=0.0).system()
    rate = system.energy @ system.A
    power = 0.5 * (rate + rate.T)
    w_m = system.states.index("th_m'")
    lost = np.zeros_like(power)
    lost[w_m, w_m] = -EDSS.motor.B_m
    assert power == pytest.approx(lost, abs=1e-9 * np.abs(system.energy).max())


def test_mesh_is_closed_spring_less_backlash_law():
    assembly = oscillator()
    Mesh("m", {"q": 1.0, "r": -1.0}, 10.0, 0.1, c=0.5).enter(assembly)
    system = assembly.build(output={"q": 1.0})
    (law,) = system.nonlinearities
    assert law.law is Law.PLAY
    assert np.array_equal(law.outlet, [1, -1, 0, 0])
    assert np.array_equal(law.inlet, [0, 0, 0.5, -2.0])
    assert (law.stiffness, law.damping, law.parameters[0]) == (10.0, 0.5, 0.1)
    closed = oscillator().build(output={"q": 1.0}).A
    closed[2:] -= np.outer([0.5, -2.0], [10.0, -10.0, 0.5, -0.5])
    assert np.array_equal(system.A, closed)


def test_hardening_is_the_cubic_part_alone():
    assembly = oscillator()
    HardeningSpring("h", {"q": 1.0}, 8.0, 3.0).enter(assembly)
    system = assembly.build(output={"q": 1.0})
    assert np.array_equal(system.A, oscillator().build(output={"q": 1.0}).A)
    assert system.nonlinearities[0].parameters[0] == 24.0


@pytest.mark.parametrize("J", [0.0, -1.0, float("nan")])
def test_invalid_inertia_is_refused(J):
    with pytest.raises(ConfigurationError, match=r"'q'.*above 0"):
        Inertia("q", J).enter(Assembly())


def test_duplicate_coordinate_is_refused():
    assembly = oscillator()
    with pytest.raises(ConfigurationError, match="twice"):
        Inertia("q", 1.0).enter(assembly)


def test_drivetrain_elements_are_unique_and_copied():
    """An element is added once and replaced by a copy."""
    plain = paper_drivetrain(ADSS, 0.0)
    with pytest.raises(ValueError, match="rotor"):
        plain.adding(rotor=Inertia("th_m", 1.0))
    heavier = plain.replacing("load", J=1.0)
    assert plain.elements["load"].J == ADSS.load.J_L
    assert heavier.elements["load"].J == 1.0
