"""The bookkeeping of runs and candidates, where everything but the simulations is real."""

import numpy as np
import pytest
from worlds import synthetic, synthetic_runs

from analysis.inference.model_pool import ModelPool

LOAD = ("load-inertia",)


@pytest.fixture
def looking(world):
    """A hunt for a load of a known inertia, with nothing simulated yet."""

    def begun(seed):
        rng = np.random.default_rng(seed)
        seen = synthetic_runs.observed(LOAD, [0.8], rng)
        return ModelPool(synthetic.ADSS, seen, rng, world, None)

    return begun


def test_local_runs_stay_near_their_centre(looking):
    hunt = looking(1)
    key, place = ("amplifier-lag", "load-inertia"), np.array([0.4, 0.5, 0.8])
    hunt.simulate_about({key: (place, (0.1, 0.02))}, 3)
    assert np.all(abs(hunt.found[key].population.places - place) <= [0.1, 0.02, 0.02])
    assert (len(hunt.found), hunt.best) == (1, hunt.found[key])


@pytest.mark.parametrize("seed", [1, *(pytest.param(n, marks=pytest.mark.long) for n in (2, 3))])
def test_further_runs_concentrate_on_true_model(looking, seed):
    hunt = looking(seed)
    reach = (0.3, 0.3)
    hunt.simulate_about({LOAD: (np.array([0.55, 0.6]), reach), (): (np.array([0.5]), reach)}, 6)
    for _ in range(2):
        hunt.simulate_around_estimate([LOAD, ()], 6)
    likelihood = {key: one.best.log_likelihood for key, one in hunt.found.items()}
    assert likelihood[LOAD] > likelihood[()] + 20.0
    assert len(hunt.found[LOAD].population) == 5 * 18
    assert hunt.best.best.place == pytest.approx([0.4, 0.8], abs=0.05)
