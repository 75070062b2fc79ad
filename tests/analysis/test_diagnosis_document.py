"""What a diagnosis says in words, and in its document: each rival for what it is."""

from dataclasses import replace

import pytest
import report_makings as makings

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
    return replace(explained, verdict=replace(explained.verdict, word="ambiguous", judged=judged))


@pytest.mark.parametrize(
    ("effects", "lead", "objection", "said"),
    [
        (STIFF, -1.0, "", ", but so may shaft-stiffness."),
        (STIFF, 1.0, "unlike", "; shaft-stiffness is likelier, and is no explanation."),
        ((), -17.0, "unlike", "; nothing beyond tolerance comes near, and is no explanation."),
        ((), -30.0, "", ", but so may nothing beyond tolerance."),
    ],
)
def test_a_rival_may_explain_it_too_or_is_said_not_to(explained, effects, lead, objection, said):
    found = tied(explained, lead, objection, effects)
    probability = found.verdict.probability
    assert found.summary()[0].endswith(f" explains it with probability {probability:.2f}{said}")
    assert found.to_json()["rivals"] == [
        {"causes": list(effects), "probability": 0.48, "remark": objection}
    ]


def test_an_answer_without_a_rival_says_how_probable_it_is(explained):
    probability = explained.verdict.probability
    assert explained.summary()[0].endswith(f" explains it with probability {probability:.2f}.")
    assert explained.to_json()["causes"][0]["probability"] == pytest.approx(probability)


@pytest.mark.parametrize(
    ("judged", "given_up", "spared", "warned"),
    [
        (STIFF, False, False, False), (STIFF, True, False, True), (STIFF, False, True, True),
        # What explains needs no further pair.
        (("load-inertia",), False, True, False),
    ],
)  # fmt: skip
def test_a_diagnosis_says_that_not_all_was_tried(monkeypatch, judged, given_up, spared, warned):
    found = makings.diagnosis(monkeypatch, ("load-inertia",), [judged], given_up, spared)
    assert (found.verdict.word == "unexplained") == (judged == STIFF)
    said = [text for text in found.to_json()["warnings"] if "the search was left" in text]
    assert len(said) == warned
    assert all(any(text in line for line in found.summary()) for text in said)
