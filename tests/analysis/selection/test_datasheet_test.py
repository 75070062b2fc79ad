"""A value that may as well be the datasheet's explains nothing, however well its runs fit."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from worlds.synthetic import ADSS

from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.model import Hypothesis
from analysis.selection.datasheet_test import AS_THE_DATASHEET, compare_with_datasheet
from analysis.selection.verdict import WITHIN_TOLERANCE, Judged, Verdict

SHAFT, BRAKE, LOAD = "shaft-stiffness", "load-viscous-damping", "load-inertia"
UNIT = ADSS.with_tolerance({"default": 0.05})


def standing(effects, score, objection=""):
    candidate = SimpleNamespace(
        hypothesis=Hypothesis(UNIT, effects), best=SimpleNamespace(place=None)
    )
    return Judged(candidate, None, score, 0.0, 0.0, 0.5, objection)


def told(word="explained", off=1.0):
    """A verdict that names the shaft, and how stiff that is."""
    best, other = standing((SHAFT,), 100.0), standing((LOAD,), 90.0)
    baseline = standing((), 0.0, "leaves structure")
    place = best.candidate.hypothesis.place(0.5, [off * UNIT.stage1.k_s1])
    found = ParameterPosterior(place, 0.01**2 * np.eye(2))
    return Verdict(word, best, (best, other, baseline), baseline), found


@pytest.mark.parametrize(("off", "named"), [(0.9, False), (1.12, False), (0.7, True), (1.4, True)])
def test_value_within_tolerance_is_not_named(off, named):
    """Though the plain model does worse than runs of the value."""
    verdict, found = told(off=off)
    held = compare_with_datasheet(verdict, found)
    if named:
        assert held is verdict
        return
    assert (held.word, held.best.effects) == ("consistent", ())
    assert held.best is held.baseline
    (shaft,) = (one for one in held.judged if one.effects == (SHAFT,))
    assert shaft.objection == WITHIN_TOLERANCE
    # Nor is more believed of it than of nothing.
    assert held.baseline.probability > shaft.probability


@pytest.mark.parametrize("word", ["consistent", "unexplained"])
def test_verdict_without_cause_is_unchanged(word):
    verdict, found = told(word)
    assert compare_with_datasheet(verdict, found) is verdict


def surely(effects, sigmas, against=""):
    """A verdict that names effects of an exact datasheet, off it by so many standard deviations."""
    hypothesis, std = Hypothesis(ADSS.with_tolerance({"default": 0.0}), effects), 0.02
    best, baseline = standing(effects, 100.0), standing((), 0.0, against)
    best = replace(best, candidate=SimpleNamespace(hypothesis=hypothesis))
    nominal = [parameter.nominal(ADSS) for _, parameter in hypothesis.parameters]
    place = hypothesis.place(0.5, [0.05 if one is None else one for one in nominal])
    place[1:] += std * np.array(sigmas)
    found = ParameterPosterior(place, std**2 * np.eye(len(place)))
    return Verdict("explained", best, (best, baseline), baseline), found


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("sigmas", "sure"), [(1.9, False), (2.1, True), (0.0, False)])
def test_single_value_must_differ_from_datasheet(sigmas, sign, sure):
    verdict, found = surely((SHAFT,), [sign * sigmas])
    held = compare_with_datasheet(verdict, found)
    if sure:
        assert held is verdict
        return
    assert (held.word, held.best.effects) == ("consistent", ())
    assert held.judged[-1].objection == AS_THE_DATASHEET


def test_rejected_plain_model_gives_unexplained():
    held = compare_with_datasheet(*surely((SHAFT,), [1.0], "leaves structure"))
    assert (held.word, held.best.effects) == ("unexplained", ())


@pytest.mark.parametrize(("effects", "sigmas"), [((BRAKE,), [0.0]), ((LOAD, SHAFT), [5.0, 0.0])])
def test_one_differing_value_keeps_the_verdict(effects, sigmas):
    """What the datasheet knows nothing of differs from it."""
    verdict, found = surely(effects, sigmas)
    assert compare_with_datasheet(verdict, found) is verdict
