"""The bookkeeping of a search, where everything but the simulations is real."""

import numpy as np
import pytest
import synthetic_search


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_second_look_elsewhere_does_not_lose_what_the_first_found(runs, seed):
    key = ("load-inertia",)
    looking = synthetic_search.hunted([0.8], seed)
    looking.start({key: np.array([0.4, 0.8])}, 4)
    looking.start({key: np.array([0.9, 0.1])}, 4)
    assert looking.found[key].best.place == pytest.approx([0.4, 0.8], abs=0.1)
    assert len(looking.found[key].population) == 80


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_look_at_the_right_place_mends_one_at_a_wrong_place(runs, seed):
    key = ("load-inertia",)
    looking = synthetic_search.hunted([0.8], seed)
    looking.start({key: np.array([0.9, 0.1])}, 4)
    wrong = looking.found[key].best.log_likelihood
    looking.start({key: np.array([0.4, 0.8])}, 4)
    assert looking.found[key].best.log_likelihood > wrong + 100.0
    assert looking.found[key].best.place == pytest.approx([0.4, 0.8], abs=0.1)
