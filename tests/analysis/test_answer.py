"""Which model's numbers are told, from the documents of an estimate and of a diagnosis."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.advice import advise
from analysis.answer import QUANTITIES, accept_model
from sim.unit import load_unit

WARNED = ["the model leaves 5.4 standard deviations of the response unexplained; run diagnose "
          "before trusting the ratio"]  # fmt: skip


def number(value, std=0.01):
    return {"value": value, "std": std, "interval95": [value - 2 * std, value + 2 * std]}


def estimated(ratio=0.6, **more):
    return {
        "contribution_ratio": number(ratio),
        "b1_deg": number(0.4),
        "b2_deg": number(0.03),
        "b_t_deg": {"value": 0.066, "std": 0.0},
        "warnings": [],
    } | more


def model(*causes, ratio, probability=0.9):
    rest = {"b1_deg": number(0.1), "b2_deg": number(0.05), "b_t_deg": number(0.07)}
    return {
        "causes": list(causes),
        "probability": probability,
        "contribution_ratio": number(ratio),
        **rest,
    }


def diagnosed(verdict, *models):
    first = models[0] if models else None
    accepted = first if verdict in ("consistent", "explained") else None
    baseline = number(0.6)
    return {
        "verdict": verdict,
        "causes": [{"effect": name} for name in first["causes"]] if first else [],
        "contribution_ratio": {
            "baseline": baseline,
            "extended": first["contribution_ratio"] if first else baseline,
        },
        **{name: accepted and accepted.get(name) for name in QUANTITIES[1:]},
        "models": list(models),
    }


def test_value_over_models_is_their_mixture():
    """0.75 of 0.2 +- 0.01 and 0.25 of 0.6 +- 0.01: 0.3 +- sqrt(0.01^2 + 0.03)."""
    left = [model(ratio=0.2, probability=0.6), model("cable-stiffness", ratio=0.6, probability=0.2)]
    found = accept_model(estimated(), diagnosed("consistent", *left)).over_models(
        "contribution_ratio"
    )
    assert found["value"] == pytest.approx(0.3)
    assert found["std"] == pytest.approx((0.01**2 + 0.03) ** 0.5)
    assert found["interval95"] == pytest.approx([0.18, 0.62])
    alone = accept_model(estimated(), diagnosed("consistent", left[0]))
    assert alone.over_models("contribution_ratio") is None


def test_explained_diagnosis_replaces_refuted_estimate():
    answer = accept_model(
        estimated(0.6, warnings=WARNED), diagnosed("explained", model("load-inertia", ratio=0.17))
    )
    assert (answer.state, answer.source) == ("accepted", "extended by load-inertia")
    assert answer.contribution_ratio["value"] == 0.17
    assert answer.b1_deg["value"] == 0.1
    assert answer.b_t_deg["value"] == 0.07


def test_consistent_diagnosis_accepts_its_plain_model():
    answer = accept_model(estimated(0.6), diagnosed("consistent", model(ratio=0.58)))
    assert (answer.state, answer.source) == ("accepted", "plain model, consistent")
    assert answer.contribution_ratio["value"] == 0.58


@pytest.mark.parametrize("estimate", [estimated(0.6), estimated(0.6, warnings=WARNED), None])
def test_diagnosis_without_accepted_model_gives_no_number(estimate):
    unexplained = accept_model(estimate, diagnosed("unexplained"))
    assert (unexplained.state, unexplained.numbers) == ("refuted", {})
    assert unexplained.source.endswith(": none")
    left = accept_model(
        estimate, diagnosed("ambiguous", model("load-inertia", ratio=0.2), model(ratio=0.7))
    )
    assert (left.state, left.contribution_ratio, left.b1_deg) == ("open", None, None)
    assert left.source == "undecided between load-inertia and plain model: none"
    assert len(left.models) == 2


@pytest.mark.parametrize(
    "refuted",
    # Histories hold estimates of earlier versions, which say it in words alone.
    [{"refuted": True}, {"warnings": WARNED}, {"refuted": True, "warnings": WARNED}],
)
def test_refuted_plain_model_gives_no_number(refuted):
    answer = accept_model(estimated(**refuted))
    assert (answer.state, answer.source) == ("refuted", "plain model refuted: none")
    assert (answer.contribution_ratio, answer.models, answer.diagnosed) == (None, (), False)


def test_fitting_estimate_is_marked_not_judged():
    answer = accept_model(estimated(0.6, refuted=False, warnings=["names unit EDSS"]))
    assert (answer.state, answer.source) == ("not judged", "plain model, not judged")
    assert answer.contribution_ratio["value"] == 0.6
    assert answer.b_t_deg == {"value": 0.066, "std": 0.0}


@pytest.mark.parametrize("estimate", [None, {}, {"failed": "no usable point"}])
def test_missing_estimate_is_stated(estimate):
    answer = accept_model(estimate)
    assert (answer.state, answer.numbers) == ("none", {})


anything = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=6,
)
numbers = st.fixed_dictionaries(
    {}, optional={"value": anything, "std": anything, "interval95": anything}
)
fields = dict.fromkeys(QUANTITIES, numbers | anything) | {
    "warnings": anything,
    "refuted": anything,
    "causes": anything | st.lists(st.fixed_dictionaries({"effect": anything}), max_size=2),
}
parts = st.fixed_dictionaries({}, optional=fields | {"probability": anything})
diagnoses = st.fixed_dictionaries(
    {
        "verdict": st.sampled_from(["consistent", "explained", "ambiguous", "unexplained"])
        | anything
    },
    optional=fields | {"models": anything | st.lists(parts | anything, max_size=3)},
)


@given(st.none() | parts, st.none() | diagnoses)
def test_any_stored_document_gives_answer_or_none(estimate, diagnosis):
    answer = accept_model(estimate, diagnosis)
    advice = advise(answer, load_unit("adss"))
    assert advice.headline
    assert "nan" not in " ".join(advice.lines())
