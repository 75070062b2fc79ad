"""Where the datasheet values of a hypothesis lie: a known answer, and a drive that is sharp."""

import numpy as np
import pytest
from worlds.synthetic import SIGMAS, candidate, observation, read

from analysis.emulation.datasheet_range import datasheet_range
from analysis.ensemble.datasheet_spread import spread_of
from analysis.inference.model_pool import ModelPool
from analysis.observation.observation import observe
from daq.plan import SweepPlan
from sim.response import simulate
from sim.unit import load_unit

PLACE = np.array([0.5])


@pytest.mark.parametrize("seed", range(5))
def test_departures_lie_in_their_range(seed):
    """Five departures, each within its reach (two standard deviations) with 95 %."""
    rng = np.random.default_rng(seed)
    off = rng.normal(0.0, SIGMAS)
    # So little scatter that a share of the tolerance is seen.
    seen = observation(read((), PLACE, rng, off, 0.02))
    found = datasheet_range(candidate(seen, (), seed, scatter=0.02))
    assert np.count_nonzero(np.abs(found.centre - off) <= found.reach) >= 3
    assert np.min(found.reach / SIGMAS) < 0.9


def test_noise_leaves_datasheet_range_unchanged():
    rng = np.random.default_rng(1)
    seen = observation(read((), PLACE, rng, None, 30.0))
    found = datasheet_range(candidate(seen, (), 1, scatter=30.0))
    np.testing.assert_allclose(found.reach, SIGMAS)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
def test_sharp_resonance_off_datasheet_is_found(seed):
    """At 5 % the resonance of a robot's axis moves by its width, and slopes tell little."""
    unit = load_unit("r3-1")
    spread, known = spread_of(unit), unit.parameters
    rng = np.random.default_rng(seed)
    off = spread.sigmas * rng.choice([-0.6, 0.6], len(spread))
    made = unit.with_parameters(**{s: known[s] * (1.0 + d) for s, d in spread.deviations(off)})
    frequencies = tuple(np.linspace(15.0, 60.0, 31))
    plan = SweepPlan(frequencies, (2.0, 4.5), settle_cycles=6, integrate_cycles=8)
    seen = observe(simulate(made, 1.0, plan, seed=seed))
    pool = ModelPool(unit, seen, rng, None, None)
    place = {(): (PLACE, (0.3, np.empty(0)))}
    pool.simulate_about(place, 16)
    again = ModelPool(unit, seen, rng, None, None)
    again.simulate_about(place, 16, pool.ranges([()]))
    # Of six such drives the least gained 118.
    assert again.best.best.log_likelihood > pool.best.best.log_likelihood + 60.0
    found = again.ranges([()])[()]
    # Friction is the fifth, and hardly seen.
    close, seen_well = np.abs(found.centre - off)[:4], (found.reach / spread.sigmas)[:4]
    assert np.all(close < 1.5 * found.reach[:4])
    assert np.all(seen_well < 0.5)
