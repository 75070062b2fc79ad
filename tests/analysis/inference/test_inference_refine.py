"""Refinement, where everything but the simulations and the training is real."""

import numpy as np
import pytest
from worlds import synthetic_runs
from worlds.judging import likelihoods, odds
from worlds.untrained import Untrained

from analysis.inference.refine import refine
from analysis.selection.verdict import judge_candidates

LAG, LOAD, MESH = "amplifier-lag", "load-inertia", "mesh1-damping"


def observed(effects, sizes, seed=1):
    return synthetic_runs.observed(effects, sizes, np.random.default_rng(seed))


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
def test_hidden_cause_is_found_among_proposed_ones(world, seed):
    """A network that favours three causes alike, and says nothing of the ratio."""
    found = refine(
        Untrained((LAG, LOAD, MESH)), observed((LOAD,), [0.8], seed), seed=seed, executor=world
    )
    verdict = judge_candidates(
        found.candidates,
        found.candidates[0].surface.observation,
        np.random.default_rng(seed),
        odds(likelihoods(found.candidates)),
    )
    assert (verdict.word, verdict.best.effects) == ("explained", (LOAD,))
    assert verdict.best.candidate.best.place == pytest.approx([0.4, 0.8], abs=0.1)


def test_pair_is_found_from_its_proposed_causes(world):
    """Sets that hold the leader and one more cause are looked at, too."""
    found = refine(Untrained((LAG, LOAD)), observed((LAG, LOAD), [0.7, 0.3]), executor=world)
    leader = found.candidates[0]
    assert leader.hypothesis.effects == (LAG, LOAD)
    assert leader.best.place == pytest.approx([0.4, 0.7, 0.3], abs=0.1)


def test_every_part_of_first_proposal_is_examined(world):
    found = refine(
        Untrained((LAG, LOAD, MESH)), observed((LAG, LOAD, MESH), [0.8, 0.3, 0.7]), executor=world
    )
    first = max(found.log_prior, key=lambda effects: found.log_prior[effects])
    for effect in first:
        assert tuple(sorted(set(first) - {effect})) in found.log_prior
    # The plain model is compared in any case, others where they came near.
    keys = {one.hypothesis.effects for one in found.candidates}
    assert {(), (LAG, LOAD, MESH)} <= keys <= set(found.log_prior)


def test_every_part_of_leading_set_is_examined(world):
    """Three causes are proposed and two are there: the two are compared with the three."""
    found = refine(Untrained((LAG, LOAD, MESH)), observed((LAG, MESH), [0.8, 0.7]), executor=world)
    assert (LAG, MESH) in {one.hypothesis.effects for one in found.candidates}


@pytest.mark.parametrize("seed", [1, *(pytest.param(n, marks=pytest.mark.long) for n in (2, 3))])
def test_plain_model_gets_as_many_runs(world, seed):
    """However far behind it seems, it is compared by as many runs as any other set."""
    seen = observed((LAG, LOAD), [0.9, 0.95], seed)
    found = refine(Untrained((LAG, LOAD)), seen, seed=seed, executor=world)
    runs = {one.hypothesis.effects: len(one.population) for one in found.candidates}
    assert found.log_odds[()] < found.log_odds[LAG, LOAD] - 60.0
    assert runs[()] == max(runs.values())


@pytest.mark.parametrize("lent_by", ["", "EDSS"])
def test_borrowed_posterior_misses_no_single_cause(world, lent_by):
    """What another unit's network holds for impossible is simulated once."""
    posterior, seen = Untrained((LAG, MESH), lent_by), observed((LOAD,), [0.8])
    found = refine(posterior, seen, without=("filter-corner",), executor=world)
    every = {(effect,) for effect in posterior.scales.prior.effects} - {("filter-corner",)}
    assert ({key for key in found.log_prior if len(key) == 1} == every) == bool(lent_by)
    if lent_by:
        assert found.candidates[0].hypothesis.effects == (LOAD,)


def test_withheld_cause_is_not_simulated(world):
    found = refine(
        Untrained((LAG, LOAD)), observed((LOAD,), [0.8]), without=(LOAD,), executor=world
    )
    assert world.count
    assert not any(LOAD in one.hypothesis.effects for one in found.candidates)


def test_seed_reproduces_the_candidates(world):
    seen = observed((LOAD,), [0.8])
    first, again = (
        refine(Untrained((LAG, LOAD)), seen, seed=3, executor=world).candidates for _ in range(2)
    )
    assert [one.hypothesis.effects for one in first] == [one.hypothesis.effects for one in again]
    assert [o.best.log_likelihood for o in first] == [o.best.log_likelihood for o in again]
