"""A value that may as well be the datasheet's explains nothing, however well its runs fit."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from worlds.synthetic import ADSS

from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.model import Hypothesis
from analysis.selection.datasheet_test import AS_THE_DATASHEET, compare_with_datasheet
from analysis.selection.verdict import Judged, Verdict

SHAFT, BRAKE, LOAD = "shaft-stiffness", "load-viscous-damping", "load-inertia"
DAMPED = "shaft-damping"


def standing(effects, score, objection=""):
    candidate = SimpleNamespace(
        hypothesis=Hypothesis(ADSS, effects), best=SimpleNamespace(place=None)
    )
    return Judged(candidate, None, score, 0.0, 0.0, 0.5, objection)


def told(effects, sigmas, word="explained", objections=(), others=()):
    """A verdict that names effects, whose values are off their datasheet by so many sigmas."""
    best, baseline = standing(effects, 100.0), standing((), 0.0, *objections)
    parts = [standing((effect,), 50.0) for effect in effects if len(effects) > 1]
    judged = (best, *parts, *others, baseline)
    hypothesis, std = best.candidate.hypothesis, 0.02
    nominal = [parameter.nominal(ADSS) for _, parameter in hypothesis.parameters]
    place = hypothesis.place(0.5, [0.05 if one is None else one for one in nominal])
    place[1:] += std * np.array(sigmas)
    return Verdict(word, best, judged, baseline), ParameterPosterior(
        place, std**2 * np.eye(len(place))
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("sigmas", "sure"), [(1.9, False), (2.1, True), (0.0, False)])
def test_single_value_must_differ_from_datasheet(sigmas, sign, sure):
    verdict, found = told((SHAFT,), [sign * sigmas])
    held = compare_with_datasheet(verdict, found)
    if sure:
        assert held is verdict
        return
    assert (held.word, held.best.effects) == ("consistent", ())
    (shaft,) = (one for one in held.judged if one.effects)
    assert shaft.objection == AS_THE_DATASHEET
    # Nor is more believed of it than of nothing.
    assert held.baseline is held.best
    assert held.baseline.probability > 0.5 > shaft.probability


def test_rejected_plain_model_gives_unexplained():
    verdict, found = told((SHAFT,), [1.0], objections=("leaves structure",))
    held = compare_with_datasheet(verdict, found)
    assert (held.word, held.best.effects) == ("unexplained", ())


def test_value_unknown_to_datasheet_differs_from_it():
    verdict, found = told((BRAKE,), [0.0])
    assert compare_with_datasheet(verdict, found) is verdict


def test_verdict_without_cause_is_unchanged():
    verdict, found = told((SHAFT,), [0.0], word="unexplained")
    assert compare_with_datasheet(verdict, found) is verdict


@pytest.mark.parametrize("word", ["explained", "ambiguous"])
@pytest.mark.parametrize(
    ("effects", "sigmas", "left"),
    [
        ((BRAKE, SHAFT), [0.0, 1.9], (BRAKE,)),
        ((BRAKE, SHAFT), [0.0, 2.1], None),
        ((LOAD, SHAFT), [5.0, -1.0], (LOAD,)),
        ((LOAD, SHAFT), [5.0, -5.0], None),
    ],
)
def test_remaining_causes_are_named_without_datasheet_value(word, effects, sigmas, left):
    """The whole is no rival: where that value is the datasheet's it is the rest."""
    verdict, found = told(effects, sigmas, word=word)
    held = compare_with_datasheet(verdict, found)
    if left is None:
        assert held is verdict
        return
    assert (held.word, held.best.effects, held.rivals) == ("explained", left, ())
    # The whole is believed less than what is named, and the reason is told.
    whole = next(one for one in held.judged if one.effects == effects)
    assert held.best.probability > whole.probability
    assert held.remark(whole) == AS_THE_DATASHEET


def test_remaining_causes_are_rival_behind_another():
    """It is not likelier than another by what speaks against the whole."""
    verdict, found = told((LOAD, SHAFT), [5.0, 0.0], others=(standing((BRAKE,), 51.0),))
    held = compare_with_datasheet(verdict, found)
    assert (held.word, held.best.effects) == ("ambiguous", (LOAD, SHAFT))
    assert [one.effects for one in held.rivals] == [(LOAD,)]


@pytest.mark.parametrize("score", [49.0, 51.0])
def test_containing_set_does_not_precede_remaining_causes(score):
    other = standing((BRAKE, LOAD), score)
    verdict, found = told((LOAD, SHAFT), [5.0, 0.0], others=(other,))
    held = compare_with_datasheet(verdict, found)
    assert (held.word, held.best.effects) == ("explained", (LOAD,))


def test_rival_of_whole_set_stays_for_rest():
    brake = standing((BRAKE,), 49.0)
    verdict, found = told((LOAD, SHAFT), [5.0, 0.0], word="ambiguous", others=(brake,))
    held = compare_with_datasheet(replace(verdict, rivals=(brake,)), found)
    assert (held.word, held.best.effects) == ("ambiguous", (LOAD,))
    assert [one.effects for one in held.rivals] == [(BRAKE,)]


@pytest.mark.parametrize(("place", "left"), [(0.03, (LOAD,)), (0.05, None)])
def test_further_cause_near_zero_is_not_named(place, left):
    """A brake whose size reaches the lower end of its range; one standard deviation is 0.02."""
    verdict, found = told((LOAD, BRAKE), [5.0, 0.0])
    found.mean[1 + verdict.best.effects.index(BRAKE)] = place
    held = compare_with_datasheet(verdict, found)
    assert held.best.effects == (left or (LOAD, BRAKE))


def test_jointly_required_causes_are_kept():
    verdict, found = told((BRAKE, DAMPED), [0.0, 0.0])
    found.mean[1:] = 0.01
    assert compare_with_datasheet(verdict, found) is verdict


def test_two_of_three_may_be_datasheet_values():
    """Of three causes one may be the datasheet's, and of the rest, by runs of its own, another."""
    both = standing((LOAD, BRAKE), 60.0)
    verdict, found = told((LOAD, BRAKE, SHAFT), [5.0, 0.0, 0.0], others=(both,))
    once = compare_with_datasheet(verdict, found)
    assert once.best.effects == (LOAD, BRAKE)
    _, found = told((LOAD, BRAKE), [0.0, 0.0])
    twice = compare_with_datasheet(once, found)
    assert (twice.word, twice.best.effects, twice.rivals) == ("explained", (BRAKE,), ())
    assert twice.baseline in twice.judged


def test_rest_rejected_by_its_runs_is_rival():
    """Its value being the datasheet's, the whole that is believed is that rest."""
    verdict, found = told((LOAD, SHAFT), [5.0, 0.0])
    refused = standing((LOAD,), 50.0, "leaves structure")
    judged = tuple(refused if one.effects == (LOAD,) else one for one in verdict.judged)
    held = compare_with_datasheet(replace(verdict, judged=judged), found)
    assert held.word == "ambiguous"
    (rival,) = held.rivals
    assert rival.effects == (LOAD,)
    # It may be the explanation, and is told so.
    assert held.remark(rival) == ""


def test_unexamined_rest_is_no_rival():
    verdict, found = told((LOAD, SHAFT), [5.0, 0.0])
    judged = tuple(one for one in verdict.judged if one.effects != (LOAD,))
    verdict = replace(verdict, judged=judged)
    assert compare_with_datasheet(verdict, found) is verdict


@pytest.mark.parametrize("word", ["explained", "ambiguous"])
@pytest.mark.parametrize(("off", "named"), [(0.9, False), (1.12, False), (0.7, True), (1.4, True)])
def test_value_within_tolerance_is_not_named(off, named, word):
    """Though the plain model does worse than runs of the value, and another such value as well."""
    unit = ADSS.with_tolerance({"default": 0.05})

    def judged(effects, score, objection=""):
        candidate = SimpleNamespace(hypothesis=Hypothesis(unit, effects))
        return Judged(candidate, None, score, 0.0, 0.0, 0.5, objection)

    best, other = judged((SHAFT,), 100.0), judged((LOAD,), 90.0)
    baseline = judged((), 0.0, "leaves structure")
    place = best.candidate.hypothesis.place(0.5, [off * unit.stage1.k_s1])
    near = (other,) if word == "ambiguous" else ()
    verdict = Verdict(word, best, (best, other, baseline), baseline, near)
    held = compare_with_datasheet(verdict, ParameterPosterior(place, 0.01**2 * np.eye(2)))
    if named:
        assert held is verdict
    else:
        assert (held.word, held.best.effects) == ("consistent", ())
