"""The search, where everything but the simulations is real."""

from dataclasses import replace

import numpy as np
import pytest
import synthetic
import synthetic_search

from analysis import contest, hunt, pairs, search
from analysis.executor import LocalExecutor
from analysis.observation import USUAL_NOISE_V
from analysis.purse import Purse
from sim.catalogue import CATALOGUE
from sim.effort import spend

ADSS = synthetic.ADSS
STUDY = pytest.mark.study
TWO_SEEDS = [1, pytest.param(2, marks=STUDY)]
"""Where ten seconds a seed is too long for every test run."""


@pytest.mark.parametrize(
    ("effect", "seed"),
    [("load-inertia", 1), pytest.param("amplifier-lag", 2, marks=STUDY), ("mesh1-damping", 3)],
)
def test_a_single_cause_is_found_among_all_of_the_catalogue(runs, effect, seed):
    found, verdict = synthetic_search.diagnosed((effect,), [0.8], seed, without=())
    assert (verdict.word, verdict.best.effects) == ("explained", (effect,))
    assert verdict.best.candidate.best.place == pytest.approx([0.4, 0.8], abs=0.1)
    assert () in {one.hypothesis.effects for one in found}


@pytest.mark.parametrize("seed", synthetic_search.MORE_SEEDS)
def test_three_causes_are_found_together(runs, seed):
    """Seeds 1 to 6 all find them, three of six with the word "explained"; 1 is farthest off."""
    three = ("amplifier-lag", "load-inertia", "mesh1-damping")
    _, verdict = synthetic_search.diagnosed(three, [0.8, 0.3, 0.7], seed)
    # They miss the other level by one standard deviation or so: of three causes no more is taken,
    # so that a true set of three may be called unexplained.
    assert verdict.word in ("explained", "unexplained")
    assert verdict.best.effects == three
    assert verdict.best.candidate.best.place == pytest.approx([0.4, 0.8, 0.3, 0.7], abs=0.15)


@pytest.mark.parametrize("seed", TWO_SEEDS)
def test_a_search_that_has_spent_all_is_left_with_a_leader_that_explains_nothing(
    runs, monkeypatch, seed
):
    """Three causes, two of which explain too little: the third is looked for no more.

    What the first look takes counts: here it takes all. Nor are more pairs tried beside the causes
    of the leading one than the first few.
    """
    simulate, beside = hunt.simulate_groups, []
    look = pairs.look_beside
    # In this world one stands out where it is placed.
    monkeypatch.setattr(pairs, "_HOPELESS", np.inf)
    monkeypatch.setattr(
        pairs, "look_beside", lambda *given: beside.extend(given[1]) or look(*given)
    )

    def spending(*given):
        if not runs:
            spend(1e9)
        return simulate(*given)

    three = ("amplifier-lag", "load-inertia", "mesh1-damping")
    whole = synthetic_search.searched(three, [0.8, 0.3, 0.7], seed)
    assert len(set(beside)) > pairs._AT_ONCE
    assert not whole.spared
    beside.clear()
    runs.clear()
    monkeypatch.setattr(hunt, "simulate_groups", spending)
    found = synthetic_search.searched(three, [0.8, 0.3, 0.7], seed)
    assert found.given_up
    assert found.spared
    assert len(set(beside)) == pairs._AT_ONCE
    assert len(found.candidates[0].hypothesis.effects) == 2
    assert max(map(len, runs)) == 2


@pytest.mark.parametrize("given_up", [False, True])
@pytest.mark.parametrize("overdrawn", [False, True])
def test_a_search_that_has_spent_all_holds_rare_causes_against_its_leader(
    runs, monkeypatch, overdrawn, given_up
):
    """A dead zone was left out, as pairs that explained nothing had taken all; and is no pair.

    One that explains is held against them whatever was spent: it might be named.
    """
    held, weighed = [], []
    monkeypatch.setattr(search, "is_given_up", lambda *_: given_up)
    monkeypatch.setattr(search, "_hold_rare", lambda *_: held.append(1))
    monkeypatch.setattr(search, "weigh_baseline", lambda *_: weighed.append(1))
    monkeypatch.setattr(Purse, "is_overdrawn", overdrawn)
    found = synthetic_search.searched(("load-inertia",), [0.8], 1)
    assert found.given_up == given_up
    assert len(held) == (not (given_up and overdrawn))
    assert len(weighed) == (not given_up)


@pytest.mark.parametrize("seed", TWO_SEEDS)
def test_a_search_that_has_spent_all_goes_on_with_a_leader_that_explains(runs, monkeypatch, seed):
    """Others are held against it as before; a second cause is not looked for behind it."""
    compared = []
    rare = search.look_at_rare
    monkeypatch.setattr(search, "look_at_rare", lambda *given: compared.append(1) or rare(*given))
    whole = synthetic_search.searched(("load-inertia",), [0.8], seed)
    assert any(len(key) > 1 for key in runs)
    runs.clear()
    monkeypatch.setattr(Purse, "is_spent", True)
    found = synthetic_search.searched(("load-inertia",), [0.8], seed)
    assert not whole.given_up
    assert not found.given_up
    assert found.candidates[0].hypothesis.effects == ("load-inertia",)
    assert len(compared) == 2
    assert all(len(key) < 2 for key in runs)


@pytest.mark.parametrize("seed", TWO_SEEDS)
def test_a_second_cause_is_found_behind_one_that_nobody_doubts(runs, monkeypatch, seed):
    monkeypatch.setattr(search, "is_doubtful", lambda candidate, *_: candidate.hypothesis.d == 1)
    pair = ("amplifier-lag", "load-inertia")
    _, verdict = synthetic_search.diagnosed(pair, [0.8, 0.3], seed)
    assert verdict.best.effects == pair


def test_nothing_is_looked_for_behind_a_cause_that_explains_all(runs):
    found, verdict = synthetic_search.diagnosed(("load-inertia",), [0.8], 1)
    assert verdict.best.effects == ("load-inertia",)
    # Ten runs to place each pair with it, fifty more of a few on few rows, seventy of these on all
    # rows; what does no better goes no further.
    assert all(count <= 130 for key, count in runs.items() if len(key) > 1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_part_that_was_looked_at_elsewhere_is_weighed_where_the_pair_has_it(runs, seed):
    pair, part = ("amplifier-lag", "load-inertia"), ("load-inertia",)
    looking = synthetic_search.hunted([0.8], seed)
    looking.start({part: np.array([0.9, 0.1])}, 6)
    looking.start({pair: np.array([0.4, 0.0, 0.8])}, 9)
    looking.settle([pair], 6)
    assert looking.best.hypothesis.effects == pair
    behind = looking.best.best.log_likelihood - looking.found[part].best.log_likelihood
    contest.weigh_parts(looking)
    assert len(looking.found[part].population) >= len(looking.found[pair].population)
    assert looking.found[part].best.place == pytest.approx([0.4, 0.8], abs=0.1)
    left = looking.found[pair].best.log_likelihood - looking.found[part].best.log_likelihood
    assert left < min(20.0, behind - 100.0)


def test_nothing_more_is_simulated_where_no_pair_leads(runs):
    looking = synthetic_search.hunted([0.8], 1)
    looking.start({("load-inertia",): np.array([0.4, 0.8]), (): np.array([0.4])}, 16)
    runs.clear()
    contest.weigh_parts(looking)
    assert not runs


@pytest.mark.parametrize(("groups", "more"), [(2, True), (16, False)])
def test_parts_of_a_pair_that_have_runs_enough_get_no_more(runs, groups, more):
    pair = {"amplifier-lag": 0.8, "load-inertia": 0.3}
    looking = synthetic_search.hunted(list(pair.values()), 1, tuple(pair))
    looking.start({tuple(pair): np.array([0.4, *pair.values()])}, 4)
    looking.start({(part,): np.array([0.4, size]) for part, size in pair.items()}, groups)
    assert looking.best.hypothesis.effects == tuple(pair)
    runs.clear()
    contest.weigh_parts(looking)
    assert bool(runs) == more


def test_every_run_is_made_where_the_caller_says(runs):
    executor, pair = LocalExecutor(1), ("amplifier-lag", "load-inertia")
    others = set(CATALOGUE) - {*pair, "mesh1-damping"}
    synthetic_search.diagnosed(pair, [0.8, 0.3], 1, executor=executor, without=others)
    assert runs.executors == {executor}


def test_where_nothing_is_missing_the_search_ends_early(runs):
    spent = []
    for seed in range(2):
        runs.clear()
        _, verdict = synthetic_search.diagnosed((), [], seed)
        assert verdict.word == "consistent"
        spent.append(sum(runs.values()))
    # 180 runs of nine, of which the baseline is one, 180 of five and it, 150 of four and it, and no
    # more; by chance a plain machine is doubted about once in ten times, and then everything is
    # tried.
    assert min(spent) <= 510


def test_what_is_left_out_of_the_catalogue_is_not_looked_at(runs, monkeypatch):
    monkeypatch.setattr(search, "_TRIPLES", 0)
    without = ("load-inertia", *synthetic_search.FELT)
    found, verdict = synthetic_search.diagnosed(("load-inertia",), [0.8], 5, without=without)
    assert not any("load-inertia" in key for key in runs)
    assert verdict.word == "unexplained"


def test_every_candidate_is_held_against_the_same_noise(runs):
    observed = synthetic_search.observed(("load-inertia",), [0.8], np.random.default_rng(6))
    loud = replace(observed.with_noise(4.0 * USUAL_NOISE_V), loudest_v=4.0 * USUAL_NOISE_V)
    found = search.search_causes(ADSS, loud, seed=6).candidates
    heard = {one.surface.observation.noise_v for one in found}
    assert len(heard) == 1
    assert USUAL_NOISE_V <= heard.pop() <= 4.0 * USUAL_NOISE_V
