"""Drives that are simulated to identify one are read as a bench reads it."""

import numpy as np
import pytest
from worlds.hidden import reading

from analysis.commissioning.coordinates import Coordinates
from analysis.commissioning.identification import simulate_drives
from analysis.commissioning.regression import Gaussian
from analysis.observation.observation import observe
from daq.plan import SweepPlan
from sim.response import simulate
from sim.unit import load_unit


@pytest.mark.parametrize(("name", "hertz"), [("feed-axis", (20.0, 80.0)), ("r3-1", (19.0, 25.0))])
def test_simulated_scatter_varies_as_few_cycles_do(name, hertz):
    """Eight cycles tell roughly how large the noise is, and how fast a sharp mode settles."""
    unit = load_unit(name).with_tolerance({"default": 0.08})
    level = 0.8 * unit.limits.source_vpk
    grid = tuple(np.linspace(*hertz, 4).tolist())
    plan = SweepPlan(grid, (level,), settle_cycles=6, integrate_cycles=8)
    rng = np.random.default_rng(1)
    seen = observe(reading(simulate(unit, 1.0, plan, seed=1), rng))
    coordinates = Coordinates.of(unit, total_backlash_unknown=False)
    narrow = Gaussian(coordinates.nominal(), 1e-8 * np.eye(len(coordinates)))
    drawn = simulate_drives(coordinates, seen, narrow, 6, rng, None)
    scatter = drawn.y.reshape(len(drawn.y), 3, -1)[:, 2]
    assert np.all(scatter.std(axis=0) > 0.5 * seen.scatter_sampling)
