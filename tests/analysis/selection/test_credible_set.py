"""What is named without a rival is believed, and is not three causes that fit nearly anything."""

from types import SimpleNamespace

import pytest
from worlds.synthetic import ADSS

from analysis.ensemble.model import Hypothesis
from analysis.selection.credible_set import require_credible_set
from analysis.selection.verdict import Judged, Verdict

BRAKE, SHAFT, LOAD = "load-viscous-damping", "shaft-stiffness", "load-inertia"


def standing(effects, probability, objection=""):
    candidate = SimpleNamespace(hypothesis=Hypothesis(ADSS, effects))
    return Judged(candidate, None, 100.0 * probability, 0.0, 0.0, probability, objection)


def told(best, *others, word="explained"):
    ranked = sorted([best, *others], key=lambda one: -one.probability)
    baseline = standing((), 0.0)
    return Verdict(word, best, (*ranked, baseline), baseline)


@pytest.fixture(autouse=True)
def alike(monkeypatch):
    """Likeness is not asked of what has no surface: that has tests of its own."""
    same = set()
    monkeypatch.setattr(Verdict, "is_equivalent", lambda _, one: one.effects in same)
    return same


def rivals(verdict):
    return [one.effects for one in verdict.rivals]


@pytest.mark.parametrize(("believed", "word"), [(0.951, "explained"), (0.949, "ambiguous")])
@pytest.mark.parametrize("objection", ["", "leaves structure", "too improbable to be checked"])
def test_probability_above_one_twentieth_makes_rival(believed, word, objection):
    """Whether it was rejected or not."""
    verdict = told(standing((LOAD,), believed), standing((SHAFT,), 1.0 - believed, objection))
    held = require_credible_set(verdict)
    assert held.word == word
    assert held.best is verdict.best
    assert rivals(held) == ([(SHAFT,)] if word == "ambiguous" else [])


def test_further_cause_without_gain_is_no_rival():
    """What is named is there in both; whether there is more is told as what is not seen."""
    verdict = told(standing((LOAD,), 0.7), standing((BRAKE, LOAD), 0.3))
    held = require_credible_set(verdict)
    assert (held.word, rivals(held)) == ("explained", [])
    assert held.probability == pytest.approx(1.0)


def test_further_cause_with_gain_is_rival():
    better = told(standing((LOAD,), 0.1), standing((LOAD, SHAFT), 0.9))
    # The load is there in either; whether the shaft is, too, is open.
    assert better.probability == pytest.approx(1.0)
    held = require_credible_set(better)
    assert (held.word, rivals(held)) == ("ambiguous", [(LOAD, SHAFT)])


def test_leading_rejected_set_is_rival():
    verdict = told(standing((LOAD,), 0.4), standing((BRAKE, LOAD), 0.6, "leaves structure"))
    held = require_credible_set(verdict)
    assert (held.word, held.best.effects) == ("ambiguous", (LOAD,))
    assert rivals(held) == [(BRAKE, LOAD)]


def test_credible_set_limits_the_rivals():
    others = [standing((effect,), p) for effect, p in ((SHAFT, 0.3), (BRAKE, 0.06))]
    least = standing(("cable-stiffness",), 0.04)
    verdict = told(standing((LOAD,), 0.6), *others, least)
    assert rivals(require_credible_set(verdict)) == [(SHAFT,), (BRAKE,)]


def test_equivalent_set_adds_to_best_probability(alike):
    verdict = told(standing((LOAD,), 0.5), standing(("payload-flexibility",), 0.5))
    assert require_credible_set(verdict).word == "ambiguous"
    alike.add(("payload-flexibility",))
    assert require_credible_set(verdict) is verdict


@pytest.mark.parametrize("word", ["consistent", "ambiguous", "unexplained"])
def test_only_explained_verdict_needs_credible_set(word):
    verdict = told(standing((LOAD,), 0.5), standing((SHAFT,), 0.5), word=word)
    assert require_credible_set(verdict) is verdict
