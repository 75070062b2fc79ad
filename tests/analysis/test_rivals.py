"""Who is a rival of what is named, and what counts for it, in a world whose answers are known."""

from dataclasses import replace

import numpy as np
import pytest
from worlds.judging import TRUE, WRONG, judge, odds, seen
from worlds.synthetic import candidate

import analysis.selection.verdict as rules

RARE, TEN_TIMES = ("motor-inertia",), 34.5
"""A rare cause, and what it takes to lead one that is not."""


@pytest.mark.parametrize(
    ("lead", "adequate", "rivals"), [(44.0, True, [()]), (46.0, True, []), (44.0, False, [])]
)
def test_plain_model_is_rival_above_one_twentieth(lead, adequate, rivals):
    found = judge(seen(TRUE, 1), ((), TRUE), 1)
    against = "" if adequate else "fits worse than replicates of this model"
    plain = replace(found.baseline, score=found.best.score - lead, objection=against)
    verdict = replace(found, judged=(found.best, plain), baseline=plain)
    assert [one.effects for one in verdict.rivals] == rivals


@pytest.mark.parametrize(
    ("behind", "adequate", "rivals"),
    [(29.0, True, [WRONG]), (31.0, True, []), (29.0, False, []), (1.0, False, [])],
)
def test_explaining_set_is_rival_above_one_seventh(behind, adequate, rivals):
    found = judge(seen(TRUE, 1), ((), TRUE, WRONG), 1)
    (wrong,) = (one for one in found.judged if one.effects == WRONG)
    against = "" if adequate else "needs a size outside its plausible range"
    near = replace(wrong, score=found.best.score - behind, objection=against)
    verdict = replace(found, judged=(found.best, near, found.baseline))
    assert [one.effects for one in verdict.rivals] == rivals


@pytest.mark.parametrize(
    ("best", "other", "behind", "is_rival"),
    [
        (TRUE, RARE, TEN_TIMES + 14.0, True),
        (TRUE, RARE, TEN_TIMES + 16.0, False),
        # Of two rare ones neither is taken for less likely than the other.
        (RARE, ("gear-ratio",), 29.0, True),
        (RARE, ("gear-ratio",), 31.0, False),
        (RARE, TRUE, 29.0, True),
        (RARE, TRUE, 31.0, False),
    ],
)
def test_rare_set_is_rival_if_comparable(best, other, behind, is_rival):
    found = judge(seen(TRUE, 1), ((), best, other), 1)
    one, another = (
        next(o for o in found.judged if o.effects == effects) for effects in (best, other)
    )
    one = replace(one, objection="")
    near = replace(another, score=one.score - behind, objection="")
    verdict = replace(found, best=one, judged=(one, near, found.baseline))
    assert (near in verdict.rivals) == is_rival


@pytest.mark.parametrize(
    ("lead", "objection", "alike", "word"),
    [
        (10.0, "needs a size outside its plausible range", False, "ambiguous"),
        (10.0, "needs a size outside its plausible range", True, "explained"),
        (-1.0, "needs a size outside its plausible range", False, "explained"),
        # Further ahead it is the best itself, and nothing is named.
        (21.0, "needs a size outside its plausible range", False, "unexplained"),
        (-40.0, rules._NOT_ASKED, False, "explained"),
    ],
)
def test_substitute_for_rejected_leader_is_not_alone(lead, objection, alike, word, monkeypatch):
    """A shaft that hardens, withheld, was told to be a light load: a stiff shaft led it."""
    observed = seen(TRUE, 1)
    found = [candidate(observed, effects, 1 + i) for i, effects in enumerate(((), TRUE, WRONG))]
    scores = {(): 0.0, TRUE: 500.0, WRONG: 500.0 + lead}
    monkeypatch.setattr(rules, "judge_chance", lambda *_: 0.0)
    monkeypatch.setattr(
        rules, "find_rejection", lambda c, *_: objection if c.hypothesis.effects == WRONG else ""
    )
    monkeypatch.setattr(rules, "is_equivalent_at_load", lambda *_: alike)
    verdict = rules.judge_candidates(found, observed, np.random.default_rng(0), odds(scores))
    assert verdict.word == word
    assert verdict.best.effects == (WRONG if word == "unexplained" else TRUE)
    if word != "unexplained":
        assert [one.effects for one in verdict.rivals] == ([WRONG] if word == "ambiguous" else [])


@pytest.mark.parametrize(
    ("best", "holding", "objection", "rivals"),
    [
        # Withheld play was told to be soft teeth with 0.48, what was likelier was all refused.
        (0.48, 0.0, "leaves a residual pattern that replicates do not", [WRONG]),
        (0.52, 0.0, "leaves a residual pattern that replicates do not", []),
        (0.40, 0.12, "leaves a residual pattern that replicates do not", []),
        (0.48, 0.0, rules._NOT_ASKED, []),
    ],
)
def test_rejected_set_is_rival_if_less_believed(best, holding, objection, rivals, monkeypatch):
    """It is a rival where the named model has the lower probability."""
    monkeypatch.setattr(rules, "is_equivalent_at_load", lambda *_: False)
    found = judge(seen(TRUE, 1), ((), TRUE, WRONG), 1)
    first = replace(found.best, probability=best)
    (wrong,) = (one for one in found.judged if one.effects == WRONG)
    other = replace(wrong, objection=objection, score=first.score - 1.0, probability=1.0 - best)
    both = candidate(seen(TRUE, 1), tuple(sorted(TRUE + WRONG)), 1)
    more = replace(wrong, candidate=both, objection="no", score=0.0, probability=holding)
    verdict = replace(found, best=first, judged=(first, other, more, found.baseline))
    assert [one.effects for one in verdict.rivals] == rivals


@pytest.mark.parametrize(("behind", "rivals"), [(24.0, [WRONG]), (31.0, [])])
def test_rejected_set_is_rival_near_three_causes(behind, rivals, monkeypatch):
    """A tachometer's gain, withheld, was told to be three other causes with 0.71."""
    monkeypatch.setattr(rules, "is_equivalent_at_load", lambda *_: False)
    found = judge(seen(TRUE, 1), ((), TRUE, WRONG), 1)
    three = tuple(sorted((*TRUE, "cable-stiffness", "total-backlash")))
    best = replace(found.best, candidate=candidate(seen(TRUE, 1), three, 1), probability=0.9)
    (wrong,) = (one for one in found.judged if one.effects == WRONG)
    other = replace(wrong, objection="no", score=best.score - behind, probability=0.1)
    verdict = replace(found, best=best, judged=(best, other, found.baseline))
    assert [one.effects for one in verdict.rivals] == rivals


@pytest.mark.parametrize(
    ("alike", "against", "rivals"),
    [
        (True, "", []),
        # A payload that swings out of sight was half as likely as the heavier load that it stands
        # for, and a motor's constant 32 behind the load counted as its rival.
        (True, "resonates outside the measured band", []),
        (True, "leaves a residual pattern that replicates do not", ["other"]),
        (False, "", ["same", "other"]),
    ],
)
def test_equivalent_set_adds_to_best_probability(alike, against, rivals, monkeypatch):
    found = judge(seen(TRUE, 1), ((), TRUE, WRONG), 1)
    (wrong,) = (one for one in found.judged if one.effects == WRONG)
    wrong = replace(wrong, objection="")
    same, other = (
        replace(
            wrong,
            candidate=replace(wrong.candidate),
            score=found.best.score - behind,
            probability=np.exp(-behind / 15.0),
        )
        for behind in (10.0, 26.0)
    )
    same = replace(same, objection=against)
    monkeypatch.setattr(
        rules, "is_equivalent_at_load", lambda one, _: alike and one is same.candidate
    )
    # Half as likely again, the best is 32 ahead of the other, of which 30 are asked.
    verdict = replace(found, judged=(found.best, same, other, found.baseline))
    names = {id(same): "same", id(other): "other"}
    assert [names[id(one)] for one in verdict.rivals] == rivals
    counts = alike and not against.startswith("leaves")
    counted = same.probability if counts else 0.0
    assert verdict.probability == pytest.approx(found.best.probability + counted)
    assert verdict.remark(same) == ("equivalent, with more parameters" if counts else against)
