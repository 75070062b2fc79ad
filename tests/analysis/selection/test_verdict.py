"""The rules of judgement, in a world whose answers are known."""

import numpy as np
import pytest
from worlds.judging import TRUE, WRONG, judge, likelihoods, odds, seen
from worlds.synthetic import BASE, candidate, observation, read, shape

import analysis.selection.verdict as rules
from analysis.checking.goodness_of_fit import judge_chance
from analysis.emulation.likelihood import TEMPERATURE
from analysis.selection.credible_set import require_credible_set as named
from analysis.selection.verdict import BY_CHANCE, judge_candidates


def daily(few, every):
    """Seeds, of which `make long` takes all."""
    return [*range(few), *(pytest.param(n, marks=pytest.mark.long) for n in range(few, every))]


@pytest.mark.parametrize("seed", daily(3, 5))
def test_present_cause_is_named(seed):
    verdict = judge(seen(TRUE, seed), seed=10 * seed)
    assert (verdict.word, verdict.best.effects) == ("explained", TRUE)
    assert verdict.best.probability > 0.95


def test_replicates_judge_baseline_not_distant_sets():
    verdict = judge(seen(TRUE, 1, size=0.9), seed=10)
    far = [one for one in verdict.judged if one.score < verdict.best.score - 3.0 * TEMPERATURE]
    asked = [one for one in verdict.judged if not np.isnan(one.misfit)]
    assert verdict.baseline in asked
    assert [one for one in far if one is not verdict.baseline]
    for one in verdict.judged:
        assert (one in asked) == (one is verdict.baseline or one not in far)
        if one not in asked:
            assert not one.adequate
            assert not one.refused, "nobody asked whether it fits like its replicates"


def test_parts_of_leader_are_always_judged():
    """By their own runs, however far behind they are."""
    pair = tuple(sorted(TRUE + WRONG))
    score = {(): 0.0, TRUE: 100.0, ("cable-stiffness",): 200.0, pair: 600.0}
    verdict = judge(seen(TRUE, 1), tuple(score), 1, score)
    unasked = [one.effects for one in verdict.judged if np.isnan(one.misfit)]
    assert unasked == [("cable-stiffness",)]


@pytest.mark.parametrize("seed", daily(4, 10))
def test_plain_response_names_no_cause(seed):
    verdict = judge(seen((), seed, size=0.0), seed=10 * seed)
    assert verdict.word == "consistent"
    assert verdict.best is verdict.baseline


@pytest.mark.parametrize("seed", daily(2, 5))
def test_imitation_of_plain_branch_is_not_named(seed, monkeypatch):
    from worlds import synthetic

    plain, branch = synthetic.read, 0.3 * shape(55)

    def branching(effects, place, rng, deviations=None, scatter=1.0):
        moved = bool(effects) or rng.uniform() < 0.5
        return plain((), place, rng, deviations, scatter) + moved * branch

    observed = observation(plain((), np.array([0.5]), np.random.default_rng(seed)) + branch)
    monkeypatch.setattr(synthetic, "read", branching)
    sets = [candidate(observed, effects, seed) for effects in ((), WRONG)]
    without, with_it = (one.best.log_likelihood for one in sets)
    assert with_it > without + 50.0, "the imitation does not tempt"
    verdict = judge_candidates(
        sets[::-1], observed, np.random.default_rng(seed), odds(likelihoods(sets))
    )
    assert (verdict.word, verdict.best.effects) == ("consistent", ())
    # What leads by chance is no evidence, and its probability says so.
    assert verdict.probability > 0.9
    (imitation,) = (one for one in verdict.judged if one.effects)
    assert verdict.remark(imitation) == BY_CHANCE


def test_refused_plain_model_excuses_no_cause(monkeypatch):
    """One in ten of its runs looks like a large cause; what was seen is unlike all of them."""
    from worlds import synthetic

    plain = synthetic.read

    def straying(effects, place, rng, deviations=None, scatter=1.0):
        strays = not effects and rng.uniform() < 0.1
        value = plain(effects, place, rng, deviations, scatter)
        return value + strays * 0.5 * synthetic.effect_slope(TRUE)

    monkeypatch.setattr(synthetic, "read", straying)
    observed = observation(plain(TRUE, np.array([0.5, 0.2]), np.random.default_rng(3)))
    sets = [candidate(observed, effects, 3) for effects in (TRUE, ())]
    assert judge_chance(*sets[::-1], np.random.default_rng(3)) > 0.04
    verdict = judge_candidates(sets, observed, np.random.default_rng(3), odds(likelihoods(sets)))
    assert verdict.baseline.refused
    assert (verdict.word, verdict.best.effects) == ("explained", TRUE)


@pytest.mark.parametrize("seed", daily(2, 5))
def test_unknown_cause_is_not_replaced_by_another(seed):
    values = read((), np.array([0.5]), np.random.default_rng(seed)) + 0.3 * shape(77)
    verdict = judge(observation(values), seed=10 * seed)
    assert verdict.word == "unexplained"


def test_cause_leaving_structure_is_not_named():
    """It fits nearly as well as its own runs do, and predicts the other level: of these eight three
    are told by the fit, and four by the structure alone."""
    refused = []
    for seed in range(8):
        values = read(TRUE, np.array([0.5, 0.5]), np.random.default_rng(seed)) + 0.06 * shape(77)
        verdict = judge(observation(values), ((), TRUE), 10 * seed)
        (cause,) = (one for one in verdict.judged if one.effects == TRUE)
        assert verdict.word == ("unexplained" if cause.refused else "explained")
        refused.append(cause.objection == "leaves a residual pattern that replicates do not")
    assert sum(refused) >= 3


def test_two_equivalent_causes_are_both_named(monkeypatch):
    from worlds import synthetic

    plain = synthetic.effect_slope
    same = {WRONG: plain(TRUE) + 0.002}
    monkeypatch.setattr(synthetic, "effect_slope", lambda e: same.get(e, plain(e)))
    verdicts = [named(judge(seen(TRUE, seed), ((), TRUE, WRONG), seed)) for seed in range(3)]
    for verdict in verdicts:
        assert {one.effects for one in verdict.judged[:2]} == {TRUE, WRONG}
    assert all(verdict.word == "ambiguous" for verdict in verdicts)


@pytest.mark.parametrize("chance", [-2.0, 2.0])
def test_rare_equivalent_set_is_rival(monkeypatch, chance):
    """The network holds it for ten times less likely, and scores differ by chance by about 2."""
    from worlds import synthetic

    plain, rare = synthetic.effect_slope, ("motor-inertia",)
    monkeypatch.setattr(
        synthetic, "effect_slope", lambda e: plain(TRUE) + 0.002 if e == rare else plain(e)
    )
    score = {(): 0.0, TRUE: 400.0, rare: 400.0 - TEMPERATURE * float(np.log(10.0)) + chance}
    verdict = named(judge(seen(TRUE, 1), tuple(score), 1, score))
    assert (verdict.word, verdict.best.effects) == ("ambiguous", TRUE)
    assert [one.effects for one in verdict.rivals] == [rare]


@pytest.mark.parametrize("seed", daily(2, 4))
def test_second_cause_needs_a_gain(seed):
    """The pair does all that the single cause does; the network holds it for less likely."""
    pair = tuple(sorted((*TRUE, *WRONG)))
    observed = seen(TRUE, seed)
    score = {(): 0.0, TRUE: 500.0, pair: 500.0 - 2.0 * TEMPERATURE}
    verdict = judge(observed, tuple(score), 10 * seed, score)
    assert (verdict.word, verdict.best.effects) == ("explained", TRUE)
    (whole,) = (one for one in verdict.judged if one.effects == pair)
    assert whole not in verdict.rivals


def test_leading_pair_is_named_with_both_causes():
    pair = tuple(sorted((*TRUE, *WRONG)))
    score = {(): 0.0, TRUE: 500.0, pair: 530.0}
    assert judge(seen(TRUE, 1), tuple(score), 1, score).best.effects == pair


def test_parts_of_judged_sets_are_judged_too():
    """Six pairs with one cause stood before it alone, and one of them was named."""
    others = ("amplifier-gain", "amplifier-lag", "cable-stiffness", "motor-resistance",
              "motor-constant", "total-backlash", "shaft-stiffness")  # fmt: skip
    pairs = [tuple(sorted((*TRUE, other))) for other in others]
    observed = seen(TRUE, 1)
    found = [candidate(observed, effects, 1) for effects in ((), TRUE, *pairs)]
    score = {(): 0.0, TRUE: 500.0} | {pair: 600.0 - i for i, pair in enumerate(pairs)}
    chosen = [one.hypothesis.effects for one in rules._worth_judging(found, score)]
    assert set(chosen[:6]) < set(pairs)
    assert set(chosen[6:]) == {TRUE, ()}


def test_synthetic_response_is_not_flat():
    assert np.ptp(BASE[0]) > 0.5
