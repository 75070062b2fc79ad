"""Drives that are simulated to identify one are read as a bench reads it."""

import numpy as np
from worlds.hidden import reading

from analysis.commissioning.coordinates import Coordinates
from analysis.commissioning.identification import simulate_drives
from analysis.commissioning.regression import Gaussian
from analysis.observation.observation import observe
from daq.plan import SweepPlan
from sim.response import simulate
from sim.unit import load_unit


def test_simulated_scatter_varies_as_few_cycles_do():
    """Where a motion repeats there is the noise alone, and eight cycles tell its size roughly."""
    unit = load_unit("feed-axis").with_tolerance({"default": 0.08})
    level = 0.8 * unit.limits.source_vpk
    plan = SweepPlan((20.0, 40.0, 60.0, 80.0), (level,), settle_cycles=6, integrate_cycles=8)
    rng = np.random.default_rng(1)
    seen = observe(reading(simulate(unit, 1.0, plan, seed=1), rng))
    coordinates = Coordinates.of(unit, total_backlash_unknown=False)
    prior = Gaussian(coordinates.nominal(), np.eye(len(coordinates)))
    drawn = simulate_drives(coordinates, seen, prior, 6, rng, None)
    scatter = drawn.y.reshape(len(drawn.y), 3, -1)[:, 2]
    assert np.all(scatter.std(axis=0) > 0.5 * seen.scatter_sampling)
