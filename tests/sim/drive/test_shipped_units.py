"""The units that come with lashbench: plausible, and as an independent plant shows them."""

import tomllib

import numpy as np
import pytest
from oracle import drive_plant

from daq.configs import config_names, config_path
from daq.plan import SweepPlan
from sim.datasheet import find_impossible, find_unusual, natural_frequencies
from sim.drivetrain import paper_drivetrain
from sim.response import simulate
from sim.unit import load_unit

UNITS = config_names("units")
PUBLISHED = [name for name in UNITS if name not in ("adss", "edss")]


KINDS = {
    "gimbal": ("adss", "edss"),
    "axis of a robot on a torque loop": ("r3-1", "r3-2", "r3-3"),
    "robot with a flexible arm, sampled": ("irb",),
    "harmonic drive with torsion bar and encoder": ("walkman-2300", "walkman-b11"),
    "feed axis with a ball screw": ("feed-axis",),
    "two-mass rig behind a planetary gearhead": ("srv02-torsion",),
}


DAILY = [names[0] for names in KINDS.values() if names[0] not in ("adss", "irb")]
"""One of each kind; the arm takes long."""


def test_there_are_eight_units_of_six_kinds():
    assert sorted(name for names in KINDS.values() for name in names) == sorted(UNITS)
    assert len(UNITS) >= 8
    assert len(KINDS) >= 6


@pytest.mark.parametrize("name", UNITS)
def test_shipped_unit_is_plausible_and_names_source(name):
    unit = load_unit(name)
    assert not find_impossible(unit)
    assert not find_unusual(unit)
    head = config_path("units", name).read_text(encoding="utf-8")[:1200]
    assert "Source" in head or "Published:" in head


@pytest.mark.parametrize("name", PUBLISHED)
def test_resonances_are_within_limits(name):
    unit = load_unit(name)
    found = natural_frequencies(unit)
    assert 1.5 * unit.limits.start_hz < found.anti_resonances_hz[0] < found.resonances_hz[0]
    assert 1.5 * found.resonances_hz[0] < unit.limits.stop_hz


@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=[pytest.mark.long] * (one not in DAILY)) for one in PUBLISHED],
)
def test_motion_agrees_with_independent_plant(name):
    """With its clock, counts, clips, play and friction, below ARF, between and above RF."""
    unit = load_unit(name)
    document = tomllib.loads(config_path("units", name).read_text(encoding="utf-8"))
    modes = natural_frequencies(unit)
    arf, rf = modes.anti_resonances_hz[0], modes.resonances_hz[0]
    hertz = (0.7 * arf, 1.4 * rf)
    volts, seeds = 0.6 * unit.limits.source_vpk, range(2)
    plan = SweepPlan(hertz, (volts,), settle_cycles=8, integrate_cycles=8)
    ours = np.array([simulate(unit, 1.0, plan, seed=seed).gain for seed in seeds])
    theirs = np.array(
        [
            drive_plant.sweep(document, 1.0, hertz, volts, 8, 8, step_s=4e-6, seed=s).mean(axis=1)
            for s in seeds
        ]
    )
    off = np.abs(ours.mean(axis=0) / theirs.mean(axis=0) - 1.0)
    scatter = np.hypot(ours.std(axis=0), theirs.std(axis=0)) / np.abs(ours.mean(axis=0))
    assert np.all(off < 3.0 * scatter + 0.03), (off, scatter)


@pytest.mark.parametrize("name", PUBLISHED)
def test_backlash_has_visible_effect(name):
    """A unit whose response hardly departs from the linear one would tell nothing of its play."""
    unit = load_unit(name)
    modes = natural_frequencies(unit)
    hertz = (0.95 * modes.anti_resonances_hz[0], modes.resonances_hz[0])
    plan = SweepPlan(hertz, (0.3 * unit.limits.source_vpk,), settle_cycles=8, integrate_cycles=4)
    shown = simulate(unit, 1.0, plan).gain
    linear = paper_drivetrain(unit, 1.0).system().transfer(np.array(hertz))
    assert np.abs(np.log(shown / linear)).max() > 0.1
