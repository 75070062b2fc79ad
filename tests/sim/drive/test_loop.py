"""Drives with a closed loop: engine, linear response and an independent plant agree."""

import numpy as np
import pytest
from oracle import drive_plant
from worlds import drives

from daq.excitation.plan import ExcitedPlan
from daq.excitation.signal import multisine
from daq.plan import SweepPlan
from sim.datasheet import find_impossible
from sim.drivetrain import paper_drivetrain
from sim.engine.linear import smooth_response
from sim.response import simulate

LINEAR_HZ = (60.0, 140.0)
PLAYED_HZ = (97.0, 211.0)


def plan(hertz, level=2.5, **more):
    return SweepPlan(tuple(hertz), (level,), **more)


def linear(sections, hertz):
    unit = drives.unit(sections, free=True)
    return paper_drivetrain(unit, 0.5).system().transfer(np.array(hertz))


@pytest.mark.parametrize("name", drives.LOOPS)
def test_loop_without_backlash_is_linear(name):
    sections = drives.finely(drives.LOOPS[name])
    unit = drives.unit(sections, free=True)
    assert not find_impossible(unit)
    shown = simulate(unit, 0.5, plan(LINEAR_HZ, settle_cycles=40, integrate_cycles=20)).gain
    np.testing.assert_allclose(shown, linear(sections, LINEAR_HZ), rtol=2e-3)


@pytest.mark.parametrize("name", ["speed, command", "position"])
def test_loop_driven_by_multisine_is_linear(name):
    hertz, sections = np.arange(60.0, 160.0, 10.0), drives.finely(drives.LOOPS[name])
    signal = multisine(hertz, 0.2, "schroeder")
    more = {"settle_cycles": 8, "integrate_cycles": 3, "excitation": signal}
    unit = drives.unit(sections, free=True)
    shown = simulate(unit, 0.5, ExcitedPlan(tuple(hertz), (2.0,), **more)).gain
    np.testing.assert_allclose(shown, linear(sections, hertz), rtol=1e-3)


def test_closed_loop_follows_from_open_loop():
    """T = C G / (1 + C G); with the source behind the controller G / (1 + C G)."""
    hertz = np.array([20.0, 60.0, 140.0, 300.0])
    s = 2j * np.pi * hertz
    control = 0.3 * (1.0 + 1.0 / (0.02 * s))
    train = {"load_coupling": drives.finely({})["load_coupling"]}
    plain = linear(train, hertz)
    loop = drives.SPEED | {"K_p": 0.3, "filtered": True}
    for where, source in (("reference", control), ("command", 1.0)):
        closed = linear(train | {"loop": loop | {"excited": where}}, hertz)
        np.testing.assert_allclose(closed, source * plain / (1.0 + control * plain), rtol=1e-9)


@pytest.mark.parametrize("name", drives.LOOPS)
def test_response_without_images_is_about_the_same(name):
    """The one that a loop has at complex frequencies, too, for what is known without simulation."""
    hertz = np.array([20.0, 60.0, 250.0])
    system = paper_drivetrain(drives.unit(drives.LOOPS[name], free=True), 0.5).system()
    smooth = smooth_response(system, 2j * np.pi * hertz)
    np.testing.assert_allclose(smooth, system.transfer(hertz), rtol=0.02)


@pytest.mark.parametrize("name", drives.LOOPS)
def test_loop_with_backlash_matches_independent_plant(name):
    sections = drives.LOOPS[name]
    unit, document = drives.unit(sections), drives.document(sections)
    # The plant starts at rest: without a clock each of its runs is the same.
    theirs_count = 4 if "sampling" in sections else 1
    swept = plan(PLAYED_HZ, settle_cycles=25, integrate_cycles=14)
    ours = np.array([simulate(unit, 0.3, swept, seed=seed).gain for seed in range(4)])
    theirs = np.array([
        drive_plant.sweep(document, 0.3, PLAYED_HZ, 2.5, 25, 14, seed=seed).mean(axis=1)
        for seed in range(theirs_count)
    ])  # fmt: skip
    off = ours.mean(axis=0) / theirs.mean(axis=0) - 1.0
    scatter = ours.std(axis=0) / np.abs(ours.mean(axis=0)) * np.sqrt(1 / 4 + 1 / theirs_count)
    # As of drives without a loop (`test_drive_response`): Student's t of four seeds.
    assert np.all(np.abs(off) < 5.5 * scatter + 0.03), (off, scatter)


@pytest.mark.parametrize("name", drives.LOOPS)
def test_integral_holds_mean_at_its_reference(name):
    """A constant that is added behind the controller is taken out again."""
    swept = plan((60.0,), 1.5, settle_cycles=40, integrate_cycles=10, dc_offset_v=0.5)
    expected = 0.0 if name == "speed, command" else 0.5
    (mean,) = simulate(drives.unit(drives.LOOPS[name]), 0.3, swept).dc_v
    assert mean == pytest.approx(expected, abs=0.02)
