"""The rules of judgement, in a world whose answers are known."""

from dataclasses import replace

import numpy as np
import pytest
from worlds.judging import FITS, TRUE, WRONG, judge, seen
from worlds.synthetic import BASE, candidate, observation, read, shape

import analysis.selection.verdict as rules
from analysis.emulation.likelihood import TEMPERATURE
from analysis.selection.verdict import judge_candidates


@pytest.mark.parametrize("seed", range(5))
def test_a_cause_that_is_there_is_named(seed):
    verdict = judge(seen(TRUE, seed), seed=10 * seed)
    assert (verdict.word, verdict.best.effects) == ("explained", TRUE)
    assert verdict.best.probability > 0.95


def test_sets_far_behind_are_not_held_against_runs_of_their_own_but_the_baseline_is():
    verdict = judge(seen(TRUE, 1, size=0.9), seed=10)
    far = [one for one in verdict.judged if one.score < verdict.best.score - rules._SURE]
    asked = [one for one in verdict.judged if not np.isnan(one.misfit)]
    assert verdict.baseline in asked
    assert [one for one in far if one is not verdict.baseline]
    for one in verdict.judged:
        assert (one in asked) == (one is verdict.baseline or one not in far)
        if one not in asked:
            assert not one.adequate
            assert not one.refused, "nobody asked whether it fits like its replicates"


def test_parts_of_the_leader_are_held_against_their_own_runs_however_far_behind(monkeypatch):
    pair = tuple(sorted(TRUE + WRONG))
    score = {(): 0.0, TRUE: 100.0, ("cable-stiffness",): 200.0, pair: 600.0}
    monkeypatch.setattr(rules, "judge_gain", lambda *_: (0.0, 9.0))
    verdict = judge(seen(TRUE, 1), tuple(score), 1, score)
    unasked = [one.effects for one in verdict.judged if np.isnan(one.misfit)]
    assert unasked == [("cable-stiffness",)]


@pytest.mark.parametrize("seed", range(10))
def test_nothing_is_named_where_nothing_is_hidden(seed):
    verdict = judge(seen((), seed, size=0.0), seed=10 * seed)
    assert verdict.word == "consistent"
    assert verdict.best is verdict.baseline


@pytest.mark.parametrize("seed", range(5))
def test_a_cause_that_imitates_one_branch_of_the_plain_motion_is_not_blamed(seed, monkeypatch):
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
    verdict = judge_candidates(sets[::-1], observed, np.random.default_rng(seed))
    assert (verdict.word, verdict.best.effects) == ("consistent", ())


@pytest.mark.parametrize("seed", range(5))
def test_a_cause_that_nobody_knows_is_not_blamed_on_another(seed):
    values = read((), np.array([0.5]), np.random.default_rng(seed)) + 0.3 * shape(77)
    verdict = judge(observation(values), seed=10 * seed)
    assert verdict.word == "unexplained"


def test_a_cause_that_leaves_a_shape_behind_is_not_blamed():
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


def test_two_causes_that_look_the_same_are_both_named(monkeypatch):
    from worlds import synthetic

    plain = synthetic.effect_slope
    same = {WRONG: plain(TRUE) + 0.002}
    monkeypatch.setattr(synthetic, "effect_slope", lambda e: same.get(e, plain(e)))
    verdicts = [judge(seen(TRUE, seed), ((), TRUE, WRONG), seed) for seed in range(6)]
    for verdict in verdicts:
        assert {one.effects for one in verdict.judged[:2]} == {TRUE, WRONG}
    # Scores differ by chance, by about 2, and the margin is 30.
    assert all(verdict.word == "ambiguous" for verdict in verdicts)


@pytest.mark.parametrize("chance", [-2.0, 2.0])
def test_of_two_that_look_the_same_the_rare_one_is_a_rival_and_not_named_first(monkeypatch, chance):
    """The network holds it for ten times less likely, and scores differ by chance by about 2."""
    from worlds import synthetic

    plain, rare = synthetic.effect_slope, ("motor-inertia",)
    monkeypatch.setattr(
        synthetic, "effect_slope", lambda e: plain(TRUE) + 0.002 if e == rare else plain(e)
    )
    score = {(): 0.0, TRUE: 400.0, rare: 400.0 - TEMPERATURE * float(np.log(10.0)) + chance}
    verdict = judge(seen(TRUE, 1), tuple(score), 1, score)
    assert (verdict.word, verdict.best.effects) == ("ambiguous", TRUE)
    assert verdict.judged[1].effects == rare


@pytest.mark.parametrize(
    ("share", "beyond", "lead", "named"),
    [
        (0.05, 2.1, 60.0, TRUE),
        (0.03, 2.1, 6.0, TRUE + WRONG),
        # Friction beside damped teeth led by 304 where own runs differ by 450 from run to run.
        (0.00, 1.9, 304.0, TRUE),
    ],
)
def test_a_pair_that_leads_by_little_or_by_chance_is_not_believed(
    monkeypatch, share, beyond, lead, named
):
    found = judge(seen(TRUE, 1), ((), TRUE, (*TRUE, *WRONG)), 1)
    pair, part = (next(o for o in found.judged if o.effects == e) for e in (TRUE + WRONG, TRUE))
    pair = replace(pair, score=part.score + lead, objection="")
    part = replace(part, misfit=0.0, objection="")

    def chance(simpler, alleged, rng):
        assert (simpler, alleged) == (part.candidate, pair.candidate)
        return share, beyond

    monkeypatch.setattr(rules, "judge_gain", chance)
    rng = np.random.default_rng(0)
    assert rules._leader([pair, part, found.baseline]) is pair
    will_do = rules._part_that_will_do([pair, part, found.baseline], pair, rng)
    assert (will_do is part) == (named == TRUE)
    # A part that looks like none of its own runs has nothing to say on that.
    unlike = replace(part, misfit=4.1, objection="no")
    assert rules._part_that_will_do([pair, unlike], pair, rng) is None
    if named == TRUE:
        first, second = rules.rank_behind([pair, part], pair, part, rules.NO_GAIN)
        assert (first.effects, second.effects) == (TRUE, TRUE + WRONG)
        assert first.score - second.score == pytest.approx(20.0)
        assert first.probability == pytest.approx(1.0 / (1.0 + np.exp(-20.0 / TEMPERATURE)))
        assert rules._leader([first, second]) is first


@pytest.mark.parametrize(("lead", "named"), [(6.0, ("cable-stiffness",)), (-6.0, TRUE)])
def test_where_a_pair_does_not_earn_its_second_cause_who_leads_its_first_is_named(
    monkeypatch, lead, named
):
    other, pair = ("cable-stiffness",), tuple(sorted(TRUE + WRONG))
    score = {(): 0.0, TRUE: 200.0, other: 200.0 + lead, pair: 210.0}
    monkeypatch.setattr(rules, "judge_adequacy", lambda c, rng: FITS)
    monkeypatch.setattr(rules, "find_rejection", lambda *_: "")
    monkeypatch.setattr(rules, "judge_chance", lambda *_: 0.0)
    verdict = judge(seen(TRUE, 1), tuple(score), 1, score)
    assert (verdict.word, verdict.best.effects) == ("ambiguous", named)
    assert verdict.judged[0] is verdict.best
    # The pair pays for its second cause.
    assert {one.effects: one.score for one in verdict.judged}[pair] == 180.0


@pytest.mark.parametrize(
    ("against", "lead", "second", "word", "named", "rivals"),
    [
        ("", 10.0, 5.0, "consistent", (), []),
        ("it leaves structure", 10.0, 5.0, "ambiguous", TRUE, [WRONG, ()]),
        # Viscous friction of a motor led by 17, and was told to be something that nobody knows.
        ("it leaves structure", 10.0, -40.0, "ambiguous", TRUE, [()]),
        ("it leaves structure", -5.0, -40.0, "unexplained", (), []),
    ],
)
def test_a_little_that_is_missing_is_a_tie_of_what_does_and_with_nothing_where_one_alone_does(
    monkeypatch, against, lead, second, word, named, rivals
):
    """The leader is less ahead of the plain model than looking at many makes."""
    score = {(): 100.0, TRUE: 100.0 + lead, WRONG: 100.0 + second}
    monkeypatch.setattr(rules, "judge_adequacy", lambda c, rng: FITS)
    monkeypatch.setattr(
        rules, "find_rejection", lambda c, *_: "" if c.hypothesis.effects else against
    )
    verdict = judge(seen(TRUE, 1), tuple(score), 1, score)
    assert (verdict.word, verdict.best.effects) == (word, named)
    assert [one.effects for one in verdict.rivals] == rivals


@pytest.mark.parametrize("seed", range(4))
def test_a_second_cause_is_not_named_where_one_does(seed):
    pair = tuple(sorted((*TRUE, *WRONG)))
    observed = seen(TRUE, seed)
    # The pair can do all that the single cause does, and a little more.
    verdict = judge(observed, ((), TRUE, pair), 10 * seed)
    assert verdict.best.effects == TRUE
    assert verdict.word == "explained"


A, B, C, D = TRUE, WRONG, ("cable-stiffness",), ("amplifier-gain",)
AB, AC, BC, CD = (tuple(sorted(one + two)) for one, two in ((A, B), (A, C), (B, C), (C, D)))


@pytest.mark.parametrize(
    ("scores", "unearned", "refused", "word", "named"),
    [
        # One that nobody asked about leads once a pair is behind its part, and is asked then.
        ({AB: 600.0, C: 200.0, A: 100.0}, {(A, AB)}, (), "explained", C),
        ({AB: 600.0, CD: 200.0, A: 100.0}, {(A, AB)}, (), "explained", CD),
        # A pair that owes its lead to chance takes none with it that shares its cause.
        ({AB: 300.0, AC: 290.0, A: 100.0}, {(A, AB)}, (), "explained", AC),
        ({AB: 300.0, AC: 290.0, A: 100.0}, {(A, AB), (A, AC)}, (), "explained", A),
        # Who leads after all that is held against the plain model, too.
        ({AB: 230.0, C: 206.0, A: 204.0}, {(A, AB), ((), C)}, (), "consistent", ()),
        # And none that owes its lead to chance is a rival of another set.
        ({AB: 230.0, CD: 215.0, C: 206.0, A: 170.0}, {(A, AB), (C, CD)}, (), "explained", C),
    ],
)
def test_every_set_that_comes_to_lead_is_asked_what_it_owes_to_chance(
    monkeypatch, scores, unearned, refused, word, named
):
    score = {(): 0.0} | scores
    monkeypatch.setattr(rules, "judge_adequacy", lambda c, rng: FITS)
    monkeypatch.setattr(
        rules, "find_rejection", lambda c, *_: "no" if c.hypothesis.effects in refused else ""
    )

    def chance(simpler, alleged, rng):
        by_chance = (simpler.hypothesis.effects, alleged.hypothesis.effects) in unearned
        return (0.5, 0.0) if by_chance else (0.0, 9.0)

    monkeypatch.setattr(rules, "judge_gain", chance)
    monkeypatch.setattr(rules, "judge_chance", lambda *of: chance(*of)[0])
    monkeypatch.setattr(rules, "is_equivalent_at_load", lambda *_: False)
    verdict = judge(seen(TRUE, 1), tuple(score), 1, score)
    assert (verdict.word, verdict.best.effects) == (word, named)
    for part, whole in unearned:
        (behind,) = (one for one in verdict.judged if one.effects == whole)
        if part and behind.effects != named:
            assert verdict.remark(behind) == "a model with fewer causes fits as well"
            assert behind not in verdict.rivals


def test_parts_of_those_that_are_judged_are_judged_however_many_stand_before_them():
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


def test_the_world_of_these_tests_is_not_flat():
    assert np.ptp(BASE[0]) > 0.5


@pytest.mark.parametrize(
    ("share", "beyond", "earned"), [(0.0, 2.0, True), (0.0, 1.9, False), (0.05, 9.0, False)]
)
def test_a_further_cause_must_bring_more_than_chance_does(monkeypatch, share, beyond, earned):
    monkeypatch.setattr(rules, "judge_gain", lambda part, whole, rng: (share, beyond))
    assert rules._exceeds_chance_gain(None, None, None) == earned
