"""No verdict is surer of itself for having been given less: fewer points, or more noise."""

from types import SimpleNamespace

import numpy as np
import pytest
from worlds.judging import likelihoods, odds
from worlds.synthetic import candidate, observation, read, thinned

from analysis.selection.credible_set import require_credible_set
from analysis.selection.verdict import judge_candidates

TRUE, WRONG = ("load-inertia",), ("shaft-stiffness",)
WEAK = 0.1
"""Size of the effect: enough to be told, not enough to be told whatever is left out."""


def judge(seed, step=1, scatter=1.0):
    """How far the true cause is ahead of the plain model, and how likely it is said to be."""
    values = read(TRUE, np.array([0.5, WEAK]), np.random.default_rng(seed), scatter=scatter)
    seen = thinned(observation(values), step)
    found = [
        candidate(seen, effects, 10 * seed + number, scatter=scatter)
        for number, effects in enumerate(((), TRUE, WRONG))
    ]
    scores = odds(likelihoods(found))
    verdict = judge_candidates(found, seen, np.random.default_rng(seed), scores)
    verdict = require_credible_set(verdict)
    (true,) = (one for one in verdict.judged if one.effects == TRUE)
    return SimpleNamespace(
        ahead=true.score - verdict.baseline.score, probability=true.probability, word=verdict.word
    )


@pytest.mark.parametrize("seed", range(3))
def test_certainty_falls_with_fewer_noisier_points(seed):
    whole = judge(seed)
    assert whole.word == "explained"
    for less in (judge(seed, step=3), judge(seed, scatter=4.0)):
        assert less.ahead < 0.8 * whole.ahead
        assert less.probability < whole.probability + 0.01


@pytest.mark.parametrize("seed", range(3))
def test_sparse_noisy_response_names_no_cause(seed):
    assert judge(seed, step=8, scatter=10.0).word != "explained"
