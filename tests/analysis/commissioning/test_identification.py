"""Drives that are simulated to identify one are read as a bench reads it."""

from dataclasses import replace

import numpy as np
import pytest
from worlds.hidden import reading

from analysis.commissioning.coordinates import Coordinates
from analysis.commissioning.identification import simulate_drives
from analysis.commissioning.regression import Gaussian
from analysis.observation.observation import observe
from daq.frf import DB_PER_NEPER, GAIN_STD_COMPONENTS
from daq.plan import SweepPlan
from sim.response import simulate
from sim.unit import load_unit


def drawn_at_datasheet(unit, seen):
    """Scatter channel (drives, rows) of drives as the datasheet has them."""
    coordinates = Coordinates.of(unit)
    narrow = Gaussian(coordinates.nominal(), 1e-8 * np.eye(len(coordinates)))
    rng = np.random.default_rng(2)
    drawn = simulate_drives(coordinates, seen, narrow, 8, rng, None)
    return drawn.y.reshape(len(drawn.y), 3, -1)[:, 2]


@pytest.mark.parametrize(("name", "hertz"), [("feed-axis", (20.0, 80.0)), ("r3-1", (19.0, 25.0))])
def test_simulated_scatter_varies_as_few_cycles_do(name, hertz):
    """Eight cycles tell roughly how large the noise is, and how fast a sharp mode settles."""
    unit = load_unit(name).with_tolerance({"default": 0.08})
    level = 0.8 * unit.limits.source_vpk
    grid = tuple(np.linspace(*hertz, 4).tolist())
    plan = SweepPlan(grid, (level,), settle_cycles=6, integrate_cycles=8)
    rng = np.random.default_rng(1)
    seen = observe(reading(simulate(unit, 1.0, plan, seed=1), rng))
    scatter = drawn_at_datasheet(unit, seen)
    assert np.all(scatter.std(axis=0) > 0.5 * seen.scatter_sampling)


def test_reading_noise_may_be_a_coordinate():
    """Twice a standard deviation apart it changes the scatter of quiet points by as much."""
    unit, noise_v, spread = load_unit("r3-1"), 5e-3, 0.5
    plan = SweepPlan((19.0, 20.0, 21.0), (4.0,), settle_cycles=6, integrate_cycles=8)
    swept = simulate(unit, 1.0, plan, seed=1)
    quiet = replace(swept, gain_std_db=DB_PER_NEPER * noise_v / 4.0 / np.abs(swept.gain))
    seen = observe(replace(quiet, provenance={GAIN_STD_COMPONENTS: 1}))
    coordinates = Coordinates.of(unit).with_noise(spread)
    drawn = []
    for z in (-1.0, 1.0):
        middle = np.append(np.zeros(len(coordinates) - 1), z)
        narrow = Gaussian(middle, 1e-8 * np.eye(len(coordinates)))
        rng = np.random.default_rng(2)
        made = simulate_drives(coordinates, seen, narrow, 8, rng, None)
        drawn.append(np.median(made.y.reshape(len(made.y), 3, -1)[:, 2], axis=0))
    assert drawn[1] - drawn[0] == pytest.approx(2.0 * spread, abs=0.2)


@pytest.mark.parametrize("components", [1, 2])
def test_scatter_is_read_as_it_was_stated(components):
    """At some points cycles that settle scatter across the gain, ten times less along it."""
    unit = load_unit("walkman-b11")
    grid = tuple(np.linspace(57.0, 60.0, 4).tolist())
    plan = SweepPlan(grid, (6.0,), settle_cycles=12, integrate_cycles=12)
    swept = simulate(unit, 1.0, plan, seed=1)
    along, across = swept.gain_std_db / DB_PER_NEPER, np.radians(swept.phase_std_deg)
    uneven = across > 5.0 * along
    assert np.any(uneven)
    stated = along if components == 1 else np.hypot(along, across)
    seen = observe(
        replace(
            swept,
            gain_std_db=DB_PER_NEPER * stated,
            provenance={GAIN_STD_COMPONENTS: components},
        )
    )
    off = np.median(drawn_at_datasheet(unit, seen), axis=0) - seen.values[2]
    assert np.all(np.abs(off[uneven]) < 0.7)
