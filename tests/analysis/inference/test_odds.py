"""The odds of sets of causes, where summaries are those of a network without training."""

from dataclasses import replace

import numpy as np
import pytest
from worlds.judging import TRUE, WRONG, seen
from worlds.synthetic import candidate
from worlds.untrained import Untrained

from analysis.inference.odds import log_odds

PAIR = tuple(sorted(TRUE + WRONG))
SETS = ((), TRUE, WRONG, PAIR)


def world(seed=1):
    """Candidates of a world in which one cause is hidden, by set, and the observation."""
    observed = seen(TRUE, seed, size=0.9)
    return observed, {key: candidate(observed, key, seed + i) for i, key in enumerate(SETS)}


def odds(observed, found, prior=None):
    prior = prior or dict.fromkeys(found, -1.0)
    return log_odds(found, Untrained(), observed, prior, np.random.default_rng(0))


def with_likelihood(one, value):
    return replace(one, best=replace(one.best, log_likelihood=value))


@pytest.mark.parametrize("seed", range(3))
def test_hidden_cause_precedes_wrong_ones(seed):
    found = odds(*world(10 * seed))
    assert found[TRUE] > max(found[()], found[WRONG]) + 3.0


def test_set_is_never_below_its_parts():
    """Over all points."""
    observed, found = world()
    poor = found | {PAIR: with_likelihood(found[PAIR], found[TRUE].best.log_likelihood - 300.0)}
    poorer = found | {PAIR: with_likelihood(found[PAIR], found[TRUE].best.log_likelihood - 900.0)}
    assert odds(observed, poor)[PAIR] == odds(observed, poorer)[PAIR]
    better = found | {PAIR: with_likelihood(found[PAIR], found[TRUE].best.log_likelihood + 100.0)}
    gain = odds(observed, better)[PAIR] - odds(observed, poor)[PAIR]
    assert gain == pytest.approx(1.0)


def test_excluded_set_has_prior_of_a_millionth():
    observed, found = world()
    ruled_out = odds(observed, found, dict.fromkeys(found, -1.0) | {WRONG: -200.0})
    assert ruled_out[WRONG] - odds(observed, found)[WRONG] == pytest.approx(np.log(1e-6) + 1.0)
