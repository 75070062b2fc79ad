"""What a diagnosis says in words, and in its document: each rival for what it is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from outputs import report_makings as makings

from analysis.diagnosis.diagnose import _causes
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.model import Hypothesis
from analysis.selection import credible_set as certainty
from sim.unit import load_unit

STIFF = ("shaft-stiffness",)


@pytest.fixture(scope="module")
def explained():
    with pytest.MonkeyPatch.context() as patch:
        return makings.diagnosis(patch, ("load-inertia",), [("load-inertia",), STIFF])


def tied(explained, lead, objection, effects=STIFF):
    """The same with one other set, so far ahead of what is named."""
    best = explained.verdict.best
    (other,) = (one for one in explained.verdict.judged if one.effects == effects)
    other = replace(other, score=best.score + lead, probability=0.48, objection=objection)
    judged = tuple(sorted([best, other], key=lambda one: -one.score))
    verdict = replace(explained.verdict, word="ambiguous", judged=judged, rivals=(other,))
    return replace(explained, verdict=verdict)


@pytest.mark.parametrize(
    ("effects", "lead", "objection", "said"),
    [
        (STIFF, -1.0, "", ", but so may shaft-stiffness."),
        (STIFF, 1.0, "unlike", "; shaft-stiffness is likelier, and is no explanation."),
        ((), -17.0, "unlike", "; nothing beyond tolerance comes near, and is no explanation."),
        ((), -30.0, "", ", but so may nothing beyond tolerance."),
    ],
)
def test_rival_states_whether_it_also_explains(explained, effects, lead, objection, said):
    found = tied(explained, lead, objection, effects)
    probability = found.verdict.probability
    assert found.summary()[0].endswith(f" explains it with probability {probability:.2f}{said}")
    assert found.to_json()["rivals"] == [
        {
            "causes": list(effects),
            "probability": 0.48,
            "remark": objection,
            "within_tolerance": not effects,
            "site": ["plant"] if effects else [],
            "rival": True,
        }
    ]


def test_answer_without_rival_states_its_probability(explained):
    probability = explained.verdict.probability
    assert explained.summary()[0].endswith(f" explains it with probability {probability:.2f}.")
    assert explained.to_json()["causes"][0]["probability"] == pytest.approx(probability)


@pytest.mark.parametrize(("judged", "warned"), [(STIFF, True), (("load-inertia",), False)])
def test_ratio_of_rejected_model_has_warning(monkeypatch, judged, warned):
    found = makings.diagnosis(monkeypatch, ("load-inertia",), [judged])
    assert (found.verdict.word == "unexplained") == warned
    said = [t for t in found.to_json()["warnings"] if "contribution ratio is that of" in t]
    assert len(said) == warned
    assert all(any(text in line for line in found.summary()) for text in said)


PAIR = ("cable-stiffness", "load-inertia")


def known(effects, log_likelihood):
    best = SimpleNamespace(log_likelihood=log_likelihood)
    return SimpleNamespace(hypothesis=Hypothesis(load_unit("adss"), effects), best=best)


@pytest.mark.parametrize(
    ("alone", "first"),
    [
        ({PAIR[:1]: 20.0, PAIR[1:]: 80.0}, PAIR[1]),
        ({PAIR[:1]: 80.0, PAIR[1:]: 20.0}, PAIR[0]),
        # What nobody simulated alone is further behind than all that was.
        ({PAIR[1:]: -500.0}, PAIR[1]),
        ({PAIR[:1]: -500.0}, PAIR[0]),
    ],
)
def test_most_costly_cause_to_omit_comes_first(alone, first):
    pair = known(PAIR, 100.0)
    verdict = SimpleNamespace(best=SimpleNamespace(candidate=pair), probability=0.9)
    found = ParameterPosterior(np.array([0.4, 0.2, 0.7]), 1e-4 * np.eye(3))
    candidates = [pair, *(known(effects, value) for effects, value in alone.items())]
    causes = _causes(verdict, found, candidates)
    assert [cause.effect for cause in causes] == [first, *(e for e in PAIR if e != first)]
    values = dict(zip(PAIR, pair.hypothesis.values(found.mean), strict=True))
    assert {cause.effect: cause.sizes[0].value for cause in causes} == pytest.approx(values)


def as_the_datasheet(sharpened):
    def close(unit, candidate, *_):
        found = sharpened(unit, candidate)
        # A load's inertia lies amid its range: half to twice of what the datasheet says.
        return replace(found, mean=np.append(found.mean[:1], [0.53] * (len(found.mean) - 1)))

    return close


def test_cause_at_datasheet_value_is_not_named(monkeypatch, explained):
    """Its plain model fits no better for it: nothing explains that measurement."""
    assert [cause.effect for cause in explained.causes] == ["load-inertia"]
    monkeypatch.setattr(makings, "sharpened", as_the_datasheet(makings.sharpened))
    found = makings.diagnosis(monkeypatch, ("load-inertia",), [("load-inertia",)])
    document = found.to_json()
    assert (document["verdict"], document["causes"]) == ("unexplained", [])
    (line,) = (text for text in found.summary() if text.strip().endswith("from the datasheet)"))
    assert "load-inertia" in line


@pytest.mark.parametrize(("asked", "word"), [(0.0, "explained"), (2.0, "ambiguous")])
def test_set_sharing_the_probability_is_rival(monkeypatch, asked, word):
    monkeypatch.setattr(certainty, "_SURE", asked)
    found = makings.diagnosis(monkeypatch, ("load-inertia",), [("load-inertia",), STIFF])
    document = found.to_json()
    assert document["verdict"] == word
    assert [cause["effect"] for cause in document["causes"]] == ["load-inertia"]
    assert bool(found.verdict.rivals) == (word == "ambiguous")


@pytest.mark.parametrize("asked", [0.0, 2.0])
def test_rival_probability_does_not_keep_datasheet_value(monkeypatch, asked):
    """Nothing is named where the value may be that of the datasheet."""
    monkeypatch.setattr(certainty, "_SURE", asked)
    monkeypatch.setattr(makings, "sharpened", as_the_datasheet(makings.sharpened))
    found = makings.diagnosis(monkeypatch, ("load-inertia",), [("load-inertia",), PAIR])
    assert found.to_json()["causes"] == []
