"""What an answer means for whoever adjusts the gears."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.acceptance import LimitSet, judge, limits_of_unit
from analysis.advice import advise
from analysis.answer import accept_model
from sim.acceptance import Acceptance
from sim.unit import load_unit, unit_from_mapping

ADSS = load_unit("adss")
B_T, N = ADSS.backlash.b_t_deg, ADSS.output_ratio


def with_limits(b1_deg=None, b2_deg=None):
    content = ADSS.model_dump(by_alias=True)
    content["limits"] |= {"b1_deg": b1_deg, "b2_deg": b2_deg}
    return unit_from_mapping(content, "test")


def number(value, low, high):
    return {"value": value, "std": (high - low) / 4.0, "interval95": [low, high]}


def model(low, high, *causes, b_t=B_T):
    """A model by the interval of its ratio."""
    middle = 0.5 * (low + high)
    return {
        "causes": list(causes),
        "probability": 0.5,
        "contribution_ratio": number(middle, low, high),
        "b1_deg": number(middle * b_t * N, low * b_t * N, high * b_t * N),
        "b2_deg": number((1 - middle) * b_t, (1 - high) * b_t, (1 - low) * b_t),
        "b_t_deg": {"value": b_t, "std": 0.0},
    }


def estimated(low, high, **more):
    return model(low, high) | {"warnings": [], "refuted": False} | more


def diagnosed(verdict, *models):
    accepted = models[0] if verdict in ("consistent", "explained") else {}
    return {
        "verdict": verdict,
        "causes": [{"effect": name} for name in (models[0]["causes"] if models else [])],
        "contribution_ratio": {"extended": accepted.get("contribution_ratio")},
        **{name: accepted.get(name) for name in ("b1_deg", "b2_deg", "b_t_deg")},
        "models": list(models),
    }


@pytest.mark.parametrize(
    ("interval", "said"),
    [
        ((0.6, 1.0), "Adjust stage 1 first: 80 % of the backlash sits in stage 1"),
        ((0.1, 0.3), "Adjust stage 2 first: 20 % of the backlash sits in stage 1"),
        ((0.45, 0.75), "Neither stage stands out: 60 %"),
        ((0.3, 0.5), "Neither stage stands out: 40 %"),
    ],
)
def test_stage_is_named_only_by_whole_interval(interval, said):
    advice = advise(accept_model(estimated(*interval)), ADSS)
    assert advice.headline.startswith(said)
    assert "by the plain model, not judged yet" in advice.headline


def test_unstated_interval_is_two_standard_deviations():
    document = estimated(0.3, 0.4) | {"contribution_ratio": {"value": 0.61, "std": 0.05}}
    assert advise(accept_model(document)).headline.startswith("Adjust stage 1 first")
    document["contribution_ratio"] = {"value": 0.59, "std": 0.05}
    assert advise(accept_model(document)).headline.startswith("Neither stage")


def test_advice_follows_accepted_model_not_estimate():
    """The estimate of practice-06 points at stage 1, and its diagnosis at stage 2."""
    refuted = estimated(0.53, 0.67, refuted=True)
    before = advise(accept_model(refuted), ADSS)
    assert before.headline.startswith("No advice before a diagnosis")
    assert "stage 1" not in before.headline
    explained = diagnosed("explained", model(0.16, 0.22, "payload-flexibility"))
    after = advise(accept_model(refuted, explained), ADSS)
    assert after.headline.startswith("Adjust stage 2 first: 19 %")
    assert "by the extended by payload-flexibility" not in after.headline
    assert "model extended by payload-flexibility" in after.headline


@pytest.mark.parametrize("unit", [ADSS, with_limits(0.01, 0.01), with_limits(1.0, 1.0), None])
@pytest.mark.parametrize(
    ("estimate", "diagnosis"),
    [
        (estimated(0.6, 0.7, refuted=True), None),
        (estimated(0.6, 0.7), diagnosed("unexplained")),
        (None, None),
        (None, diagnosed("ambiguous")),
    ],
)
def test_missing_model_gives_no_stage_verdict(unit, estimate, diagnosis):
    """No stage is adjusted, passed or failed."""
    advice = advise(accept_model(estimate, diagnosis), unit)
    assert advice.headline.startswith("No advice")
    assert {stage.verdict for stage in advice.stages} <= {None, "UNDECIDED"}
    assert not any(word in advice.headline for word in ("stage 1", "stage 2", "PASS", "FAIL"))


@pytest.mark.parametrize(
    ("verdict", "models", "said"),
    [
        ("ambiguous", [(0.6, 0.7, "a"), (0.8, 0.9, "b")], "Adjust stage 1 first: 60 to 90 %"),
        ("ambiguous", [(0.6, 0.7, "a"), (0.1, 0.2)], "Undecided, adjust no stage yet: 10 to 70 %"),
        ("ambiguous", [(0.6, 0.7, "a"), (0.45, 0.6)], "Undecided, adjust no stage yet"),
        # Nothing is missing, as far as is known; what is left open would say another stage.
        ("consistent", [(0.6, 0.7), (0.1, 0.2, "a")], "Undecided, adjust no stage yet"),
        ("consistent", [(0.6, 0.7), (0.7, 0.9, "a")], "Adjust stage 1 first"),
        # Which of them is true makes no difference here.
        ("consistent", [(0.4, 0.6), (0.45, 0.7, "a")], "Neither stage stands out: 40 to 70 %"),
    ],
)
def test_all_models_must_agree_on_stage(verdict, models, said):
    document = diagnosed(verdict, *(model(*one) for one in models))
    advice = advise(accept_model(None, document), ADSS)
    assert advice.headline.startswith(said)
    assert advice.headline.startswith("Undecided") == ("plain model" in advice.headline)


def test_stage_without_limit_states_largest_value():
    answer = accept_model(estimated(0.2, 0.4))
    lines = [stage.line for stage in advise(answer, ADSS).stages]
    assert lines[0].endswith("no limit set, all of it would be 0.6930 deg.")
    assert lines[1].endswith("no limit set, all of it would be 0.0660 deg.")
    # A diagnosis that finds more play in all tells a greater most.
    worn = diagnosed("explained", model(0.2, 0.4, "total-backlash", b_t=0.1))
    assert advise(accept_model(None, worn), ADSS).stages[1].line.endswith("would be 0.1000 deg.")


@pytest.mark.parametrize(
    ("span", "verdict"),
    [
        ((0.10, 0.19), "PASS"), ((0.10, 0.198), "PASS"), ((0.10, 0.21), "UNDECIDED"),
        ((0.19, 0.30), "UNDECIDED"), ((0.21, 0.30), "FAIL"),
    ],
)  # fmt: skip
def test_limit_is_decided_by_whole_interval(span, verdict):
    def b1(*found):
        models = [{**model(0.1, 0.2), "b1_deg": number(sum(s) / 2, *s)} for s in found]
        document = diagnosed("explained" if len(models) == 1 else "ambiguous", *models)
        return advise(accept_model(None, document), with_limits(0.2)).stages[0].verdict

    assert b1(span) == verdict
    assert b1(span, span) == verdict
    assert b1(span, (0.0, 0.1)) == ("PASS" if verdict == "PASS" else "UNDECIDED")


@given(
    spans=st.tuples(st.floats(0, 1), st.floats(0, 1)).map(sorted),
    limit=st.floats(0.001, 1),
    k=st.sampled_from([0.5, 1.0, 2.0, 3.0, 10.0]),
    doubt=st.sampled_from(["", "the phase is likely in radians"]),
)
def test_advice_and_judgement_agree_on_limit(spans, limit, k, doubt):
    content = with_limits(b1_deg=limit).model_dump(by_alias=True)
    content["acceptance"] = {"coverage_factor": k, "b2_deg": {"upper": limit / 10}}
    unit, estimate = unit_from_mapping(content, "test"), estimated(*spans)
    judgement = judge(limits_of_unit(unit), estimate=estimate, doubt=doubt)
    decided = {item.quantity: item.verdict for item in judgement.items}
    answer = accept_model(estimate)
    for advice in (
        advise(answer, unit, judgement=judgement, doubt=doubt),
        advise(answer, unit, doubt=doubt),
    ):
        assert {f"b{s.stage}_deg": s.verdict for s in advice.stages} == decided
    assert not doubt or set(decided.values()) == {"UNDECIDED"}


def test_stage_is_compared_with_unit_limit():
    unit, estimate = with_limits(b1_deg=0.03), estimated(0.1, 0.2)
    other = LimitSet("other", Acceptance.model_validate({"b2_deg": {"upper": 1.0}}))
    judgement = judge(other, estimate=estimate)
    advice = advise(accept_model(estimate), unit, judgement=judgement)
    assert [stage.verdict for stage in advice.stages] == ["FAIL", "PASS"]


def test_wider_guard_band_leaves_stage_undecided():
    content = with_limits(b1_deg=0.2).model_dump(by_alias=True)
    content["acceptance"] = {"coverage_factor": 3.0, "b2_deg": {"upper": 1.0}}
    answer = accept_model(estimated(0.2, 0.28))
    assert advise(answer, with_limits(b1_deg=0.2)).stages[0].verdict == "PASS"
    assert advise(answer, unit_from_mapping(content, "test")).stages[0].verdict == "UNDECIDED"


def test_doubtful_response_passes_and_fails_no_stage():
    answer = accept_model(estimated(0.1, 0.2))
    advice = advise(answer, with_limits(0.03, 0.066), doubt="the gain looks halved")
    assert [stage.verdict for stage in advice.stages] == ["UNDECIDED", "UNDECIDED"]
    assert "(the gain looks halved)" in advice.stages[0].line
    assert advice.headline.endswith("Settle first whether the response is right.")


@pytest.mark.parametrize(
    ("verdict", "first", "said"),
    [
        ("explained", "tachometer-gain", "Before touching a gear, put the measuring chain right."),
        ("ambiguous", "tachometer-gain", "Before touching a gear, see whether the measuring"),
        ("explained", "load-inertia", "Adjust stage 1 first"),
    ],
)
def test_wrong_measuring_chain_precedes_gear_advice(verdict, first, said):
    document = diagnosed(verdict, model(0.7, 0.8, first), model(0.7, 0.9, "load-inertia"))
    lines = advise(accept_model(None, document), ADSS).lines()
    assert lines[0].startswith(said)
    assert sum(line.startswith("Adjust stage 1 first") for line in lines) == 1


def test_limits_decide_and_not_the_ratio():
    """Most of it sits in stage 2, and is within its limit; stage 1 is not."""
    answer = accept_model(estimated(0.1, 0.2))
    assert advise(answer, ADSS).headline.startswith("Adjust stage 2 first")
    assert advise(answer, with_limits(b2_deg=0.066)).headline == (
        "Leave stage 2 as it is: stage 2 PASS."
    )
    advice = advise(answer, with_limits(0.03, 0.066))
    assert advice.headline == "Adjust stage 1: stage 1 FAIL; stage 2 PASS."
    assert advice.stages[1].line.endswith("limit 0.0660 deg: leave it.")
    undecided = advise(answer, with_limits(0.1, 0.066)).headline
    assert undecided.startswith("Undecided: stage 1 UNDECIDED; stage 2 PASS.")


def test_disagreeing_models_leave_limits_undecided():
    document = diagnosed("ambiguous", model(0.1, 0.2, "a"), model(0.8, 0.9))
    advice = advise(accept_model(None, document), with_limits(0.3, 0.066))
    assert [stage.verdict for stage in advice.stages] == ["UNDECIDED", "PASS"]
    assert "over the models left" in advice.stages[0].line


spans = st.tuples(st.floats(0, 1), st.floats(0, 1)).map(sorted)
limits = st.one_of(st.none(), st.floats(0, 1))


@given(st.lists(spans, min_size=1, max_size=3), limits, limits)
def test_headline_agrees_with_stage_lines(ratios, b1, b2):
    models = [model(low, high, *"a" * n) for n, (low, high) in enumerate(ratios)]
    document = diagnosed("explained" if len(models) == 1 else "ambiguous", *models)
    advice = advise(accept_model(None, document), with_limits(b1, b2))
    told = {stage.stage: stage.verdict for stage in advice.stages if stage.verdict}
    assert set(told) == {n for n, limit in ((1, b1), (2, b2)) if limit is not None}
    for stage, verdict in told.items():
        assert f"stage {stage} {verdict}" in advice.headline
        assert f"Stage {stage}: {verdict}." in advice.stages[stage - 1].line
    asked, _, _ = advice.headline.partition(":")
    if told:
        for stage in (1, 2):
            named = f"stage {stage}" in asked
            assert not (asked.startswith("Adjust") and named) or told[stage] == "FAIL"
            assert not (asked.startswith("Leave") and named) or told[stage] == "PASS"
        assert asked.startswith("Adjust") == ("FAIL" in told.values())


def test_single_stage_holds_all_if_model_fits():
    answer = accept_model(
        {
            "contribution_ratio": {"value": 1.0, "std": 0.0},
            "b1_deg": number(0.2, 0.15, 0.25),
            "b2_deg": {"value": 0.0, "std": 0.0},
            "b_t_deg": number(0.2, 0.15, 0.25),
            "warnings": [],
        }
    )
    advice = advise(answer)
    assert advice.headline == "There is one gear stage: it holds all of the backlash."
    assert len(advice.stages) == 1
