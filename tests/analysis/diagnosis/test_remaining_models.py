"""Which models a diagnosis leaves, and the backlash that its document tells."""

from dataclasses import replace

import numpy as np
import pytest
from outputs import report_makings as makings

from analysis.diagnosis.remaining_models import (
    backlash_document,
    backlash_lines,
    find_remaining_models,
)
from analysis.emulation.parameter_posterior import ParameterPosterior
from sim.unit import load_unit

ADSS = load_unit("adss")
LOAD, STIFF = ("load-inertia",), ("shaft-stiffness",)
PLAIN = ParameterPosterior(np.array([0.7]), np.array([[0.03**2]]))


@pytest.fixture(scope="module")
def explained():
    with pytest.MonkeyPatch.context() as patch:
        return makings.diagnosis(patch, LOAD, [LOAD, STIFF])


@pytest.fixture(scope="module")
def consistent():
    with pytest.MonkeyPatch.context() as patch:
        return makings.diagnosis(patch, (), [LOAD])


def left(found, **changes):
    verdict = replace(found.verdict, **changes)
    best = verdict.best.candidate.best.place
    sized = ParameterPosterior(best, 0.02**2 * np.eye(len(best)))
    return find_remaining_models(verdict, sized, PLAIN, found.observation, np.random.default_rng(1))


def test_explained_document_states_backlash_of_its_ratio(explained):
    document = explained.to_json()
    ratio, (model,) = document["contribution_ratio"]["extended"], document["models"]
    b_t, n = ADSS.backlash.b_t_deg, ADSS.output_ratio
    assert document["verdict"] == "explained"
    assert document["b_t_deg"] == {"value": b_t, "std": 0.0}
    assert document["b1_deg"]["value"] == pytest.approx(ratio["value"] * b_t * n)
    assert document["b1_deg"]["std"] == pytest.approx(ratio["std"] * b_t * n, rel=1e-4)
    assert document["b2_deg"]["value"] == pytest.approx((1 - ratio["value"]) * b_t)
    low, high = ratio["interval95"]
    assert document["b2_deg"]["interval95"] == pytest.approx([(1 - high) * b_t, (1 - low) * b_t])
    assert model["causes"] == [*LOAD]
    assert model["b1_deg"] == document["b1_deg"]


def test_consistent_document_has_plain_model(consistent):
    document = consistent.to_json()
    assert document["verdict"] == "consistent"
    assert document["models"][0]["causes"] == []
    ratio = document["contribution_ratio"]
    assert ratio["baseline"]["value"] == ratio["extended"]["value"]
    assert document["b1_deg"]["value"] == document["models"][0]["b1_deg"]["value"]


def test_likely_adequate_model_remains_beside_plain_model(consistent):
    (other,) = (one for one in consistent.verdict.judged if one.effects)
    plain = consistent.verdict.baseline
    for probability, objection, kept in ((0.3, "", 1), (0.3, "unlike", 0), (0.01, "", 0)):
        one = replace(other, probability=probability, objection=objection)
        models = left(consistent, judged=(plain, one))
        assert [model.causes for model in models] == [(), *[one.effects] * kept]


def test_tied_models_are_sized_and_none_accepted(explained):
    also = tuple(one for one in explained.verdict.judged if one.effects in (STIFF, ()))
    models = left(explained, word="ambiguous", rivals=also)
    assert {model.causes for model in models[1:]} >= {STIFF, ()}
    assert models[0].causes == LOAD
    (plain,) = (model for model in models if not model.causes)
    assert plain.backlash.contribution_ratio.value == pytest.approx(0.7)
    document = backlash_document(models, "ambiguous", (0.7, 0.03), (0.5, 0.02))
    assert (document["b1_deg"], document["b2_deg"], document["b_t_deg"]) == (None, None, None)
    assert "interval95" not in document["contribution_ratio"]["extended"]
    told = "\n".join(backlash_lines(models, "ambiguous"))
    assert "load-inertia (probability" in told
    assert "plain model (probability" in told


def test_likely_model_remains_in_tie_without_rival(explained):
    best, *others = explained.verdict.judged
    (stiff,) = (one for one in others if one.effects == STIFF)
    for probability, kept in ((0.08, [LOAD, STIFF]), (0.02, [LOAD])):
        one = replace(stiff, probability=probability, objection="", score=best.score - 100.0)
        models = left(explained, word="ambiguous", judged=(best, one), rivals=())
        assert [model.causes for model in models] == kept


def test_unexplained_document_has_no_backlash(explained):
    assert left(explained, word="unexplained") == ()
    document = backlash_document((), "unexplained", (0.7, 0.03), (0.7, 0.03))
    assert (document["b1_deg"], document["models"]) == (None, [])
    assert backlash_lines((), "unexplained") == [
        "backlash by stage: none told, as no model explains the response"
    ]
