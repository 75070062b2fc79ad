"""What a person reads of a diagnosis: chain or mechanics, and what is left at each level."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from outputs import report_makings as makings

from analysis.diagnosis import diagnose as module
from analysis.diagnosis.experiment_design import NextMeasurement
from analysis.inference.exclusion import list_unseen
from daq.errors import AnalysisError
from daq.plan import SweepPlan
from sim.catalogue import CATALOGUE
from sim.engine.effort import counting
from sim.unit import load_unit

LOAD, STIFF, GAIN = ("load-inertia",), ("shaft-stiffness",), ("amplifier-gain",)


@pytest.fixture(scope="module")
def explained():
    with pytest.MonkeyPatch.context() as patch:
        return makings.diagnosis(patch, LOAD, [LOAD, STIFF, GAIN])


@pytest.fixture(scope="module")
def unexplained():
    with pytest.MonkeyPatch.context() as patch:
        return makings.diagnosis(patch, LOAD, [STIFF])


def believed(explained, word, **probability):
    """The same, with so much believed of each set, by its first letters."""
    names = {"load": LOAD, "stiff": STIFF, "gain": GAIN, "nothing": (), "both": (*GAIN, *LOAD)}
    shares = {names[name]: p for name, p in probability.items()}
    judged = tuple(
        replace(one, probability=shares.get(one.effects, 0.0)) for one in explained.verdict.judged
    )
    (best,) = (one for one in judged if one.effects == LOAD)
    verdict = replace(explained.verdict, word=word, judged=judged, best=best)
    return replace(explained, verdict=verdict)


def line(found, start):
    (one,) = (text for text in found.summary() if text.startswith(f"  {start}: "))
    return one.removeprefix(f"  {start}: ")


def test_site_probability_sums_all_judged_models(explained):
    """Site: measuring chain or mechanics."""
    found = believed(explained, "ambiguous", load=0.4, stiff=0.3, gain=0.28, nothing=0.02)
    told = line(found, "chain or mechanics")
    assert told == "mechanics 0.70, measuring chain 0.28, nothing hidden 0.02"
    assert found.to_json()["site_probability"] == pytest.approx(
        {"plant": 0.7, "chain": 0.28, "both": 0.0, "none": 0.02}
    )


def test_negligible_probability_is_omitted(explained):
    found = believed(explained, "explained", load=0.997, gain=0.003)
    assert line(found, "chain or mechanics") == "mechanics 1.00"


def test_site_is_open_only_if_unexplained(explained, unexplained):
    """A consistent response does not state it at all."""
    assert line(unexplained, "chain or mechanics").startswith(
        "open; probabilities of the models that fit best:"
    )
    consistent = believed(explained, "consistent", nothing=1.0)
    assert not any("chain or mechanics" in text for text in consistent.summary())


def test_rival_at_another_site_is_marked(explained):
    best = explained.verdict.best
    judged = tuple(
        one if one is best else replace(one, score=best.score - 5.0, objection="")
        for one in explained.verdict.judged
        if one.effects
    )
    others = tuple(one for one in judged if one is not best)
    verdict = replace(explained.verdict, word="ambiguous", judged=judged, rivals=others)
    said = replace(explained, verdict=verdict).summary()[0]
    assert "amplifier-gain (in the measuring chain)" in said
    assert "shaft-stiffness or" in said or "or shaft-stiffness." in said


def test_residuals_are_stated_by_level(explained):
    told = [text for text in explained.summary() if text.startswith("    at ")]
    by_level = explained.to_json()["by_level"]
    assert [one["source_vpk"] for one in by_level] == list(makings.LEVELS)
    for text, one in zip(told, by_level, strict=True):
        plain, extended = one["baseline"], one["extended"]
        assert text == (
            f"    at {one['source_vpk']:g} V: plain {plain['gain_db']:.2f} dB and "
            f"{plain['phase_deg']:.1f} deg, extended {extended['gain_db']:.2f} dB and "
            f"{extended['phase_deg']:.1f} deg"
        )
        # The hidden load is what the plain model misses.
        assert extended["gain_db"] < plain["gain_db"]
    # All levels together are what is told in one figure.
    rows = [level.stop - level.start for level in explained.observation.levels]
    whole = np.sqrt(np.average([one["extended"]["gain_db"] ** 2 for one in by_level], weights=rows))
    assert whole == pytest.approx(explained.held_out_db[1])


def test_unread_phase_gives_no_phase_residual(explained):
    best, rows = explained.verdict.best, explained.verdict.best.held_out.residual.copy()
    rows[1] = np.nan
    best = replace(best, held_out=replace(best.held_out, residual=rows))
    found = replace(explained, verdict=replace(explained.verdict, best=best))
    assert np.isnan(found.to_json()["by_level"][0]["extended"]["phase_deg"])
    told = next(text for text in found.summary() if text.startswith("    at "))
    assert told.endswith(" dB")


def test_residuals_of_named_set_are_stated(explained):
    assert line(explained, "against the extended model") == explained.left_shape
    assert explained.to_json()["shape_after"] == explained.left_shape


def test_unexplained_verdict_states_nearest_rejected_model(unexplained):
    document = unexplained.to_json()
    assert document["verdict"] == "unexplained"
    first = document["first"]
    assert first["causes"] == [*STIFF]
    assert first["objection"]
    told = line(unexplained, "against shaft-stiffness, the best model, which was rejected")
    assert told == unexplained.left_shape


def test_unnamed_causes_give_no_extended_model(unexplained):
    """What was refused is no model: its figures would be taken for a gain."""
    document = unexplained.to_json()
    assert document["causes"] == []
    assert document["extended"] == document["baseline"]
    assert document["gain"] == {"held_out_rms_ratio": 1.0}
    assert document["misfit_sigma"]["extended"] == document["misfit_sigma"]["baseline"]


def test_plain_model_may_fail_without_departure(unexplained):
    found = replace(unexplained, departures=(), shape="no band departs")
    objection = found.verdict.baseline.objection
    assert line(found, "against the plain model") == f"no band departs, yet it {objection}"


def test_equivalent_sets_count_once(monkeypatch, explained):
    """Probabilities of a document add up to one."""
    verdict = explained.verdict
    monkeypatch.setattr(
        type(verdict), "is_equivalent", lambda self, one: one.effects == STIFF, raising=True
    )
    document = explained.to_json()
    assert [one["causes"] for one in document["rivals"]].count([*STIFF]) == 0
    told = [one["probability"] for one in document["rivals"]]
    assert verdict.probability + sum(told) == pytest.approx(1.0)


PLAN = SweepPlan(
    tuple(np.linspace(80.0, 200.0, 31)), (0.75,), settle_cycles=20, integrate_cycles=30
)


@pytest.mark.parametrize(
    ("sigma", "others", "told"),
    [
        (4.06, (), "to tell a from b (4.1 sigma expected), in "),
        (
            2.5,
            (("c", 3.0), ("d", 0.4), ("none", 1.9)),
            "to tell a from b (2.5 sigma expected) and c (3.0), though hardly from d (0.4) or "
            "none (1.9), in ",
        ),
        (
            1.9,
            (("c", 0.5),),
            "no sweep within the limits is likely to tell a from b or c; the best of them (1.9 "
            "sigma expected, ",
        ),
    ],
)
def test_next_sweep_states_purpose_and_duration(explained, sigma, others, told):
    proposal = NextMeasurement("ADSS", PLAN, ("a", "b"), sigma, others)
    lines = replace(explained, next_measurement=proposal).summary()
    (said,) = (text for text in lines if text.startswith(f"  {told}"))
    minutes = f"{PLAN.duration_s / 60.0:.2g} min"
    assert said.endswith(f"{minutes}):" if sigma < 2.0 else f"in {minutes}:")
    assert lines[lines.index(said) + 1] == f"    {proposal.command}"


def judged(explained, *objections):
    """Rivals of a load that fit as well, with what speaks against each."""
    best = explained.verdict.best
    others = [one for one in explained.verdict.judged if one.effects in (STIFF, GAIN)]
    rivals = [
        replace(one, score=best.score - 1.0 - i, objection=objection)
        for i, (one, objection) in enumerate(zip(others, objections, strict=True))
    ]
    return replace(
        explained.verdict, word="ambiguous", judged=(best, *rivals), rivals=tuple(rivals)
    )


@pytest.mark.parametrize(
    ("objections", "asked"),
    [(("", ""), [0, 1]), (("unlike", ""), [1]), (("", "unlike"), [0]), (("unlike", "unlike"), [0])],
)
def test_proposed_sweep_separates_all_possible_explanations(
    monkeypatch, explained, objections, asked
):
    verdict, given = judged(explained, *objections), []

    def propose(unit, first, rivals, observation, **_):
        given.append((first, list(rivals)))

    monkeypatch.setattr(module, "propose_measurement", propose)
    module._proposal(None, verdict, explained.observation, 0, None, None)
    assert given == [(verdict.best.candidate, [verdict.judged[1 + i].candidate for i in asked])]


@pytest.mark.parametrize(
    ("levels_vpk", "sweeps", "told"),
    [((2.0,), 1, "halves of its band"), ((2.0,), 2, "whole sweeps at that level"),
     ((1.0, 2.0), 1, None), ((1.0, 2.0), 2, None)],
)  # fmt: skip
def test_level_counts_once_in_several_sweeps(explained, levels_vpk, sweeps, told):
    observation = explained.observation
    half = len(observation) // 2
    rows = [np.arange(half), np.arange(half, 2 * half)]
    plan = replace(observation.plans[0][0], levels_vpk=levels_vpk)
    plans = [(plan, np.arange(2 * half))]
    if sweeps == 2:
        plans = [(replace(plan, direction=way), part)
                 for way, part in zip(("up", "down"), rows, strict=True)]  # fmt: skip
    seen = replace(
        observation,
        source_vpk=np.repeat(levels_vpk, 2 * half // len(levels_vpk)),
        plans=tuple(plans),
    )
    said = [text for text in module._warnings(replace(explained, observation=seen))
            if "one source level" in text]  # fmt: skip
    assert len(said) == (told is not None)
    assert told is None or told in said[0]


@pytest.mark.parametrize(
    ("frequencies", "told"),
    [(1, "1 usable frequency,"), (7, "7 usable frequencies,"), (8, None), (61, None)],
)
def test_too_few_points_are_refused(frequencies, told):
    seen = SimpleNamespace(frequency_hz=np.tile(np.linspace(100.0, 180.0, frequencies), 3))
    if told is None:
        module._refuse_few(seen)
        return
    with pytest.raises(AnalysisError, match=f"^the response holds {told} and nearly anything"):
        module._refuse_few(seen)


def test_one_point_is_refused_before_simulation():
    response = makings.response()
    one = response.take(response.frequency_hz == response.frequency_hz[0])
    with counting() as effort, pytest.raises(AnalysisError, match="1 usable frequency"):
        module.diagnose_response(one, load_unit("adss"))
    assert effort.simulated_s == 0.0


@pytest.mark.parametrize(("frequencies", "warned"), [(8, True), (19, True), (20, False)])
def test_few_frequencies_give_a_remark(explained, frequencies, warned):
    observation = explained.observation
    hz = np.resize(np.linspace(100.0, 180.0, frequencies), len(observation))
    seen = replace(observation, frequency_hz=hz)
    said = [text for text in module._warnings(replace(explained, observation=seen))
            if f"holds {frequencies} frequencies" in text]  # fmt: skip
    assert len(said) == warned


def test_consistent_verdict_states_possible_unseen_sizes(monkeypatch, unexplained):
    plain = makings.diagnosis(monkeypatch, (), [LOAD, STIFF])
    assert plain.verdict.word == "consistent"
    told, document = plain.summary(), plain.to_json()["unseen"]
    assert [one["effect"] for one in document] == list(CATALOGUE)
    at = told.index("  sizes of causes that this sweep cannot exclude, one cause at a time:")
    lines = [f"    {text}" for text in list_unseen(document)]
    assert lines
    assert told[at + 1 : at + 1 + len(lines)] == lines
    assert unexplained.to_json()["unseen"] == []


def test_named_cause_states_possible_further_ones(monkeypatch):
    named = makings.diagnosis(monkeypatch, LOAD, [LOAD, STIFF])
    assert named.verdict.best.effects == LOAD
    told, document = named.summary(), named.to_json()["unseen"]
    assert [one["effect"] for one in document] == [e for e in CATALOGUE if e not in LOAD]
    at = told.index(
        "  sizes of further causes that this sweep cannot exclude, one cause at a time:"
    )
    assert told[at + 1] == f"    {list_unseen(document)[0]}"
