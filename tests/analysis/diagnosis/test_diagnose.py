"""The diagnosis end to end: effects hidden in data must be found, and nothing where nothing is.

Sets are drawn when the tests run, with the seed printed. What is asked of one
draw is what nearly every draw gives; how often exactly, the blind study counts.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from worlds import hidden

from analysis.advice import advise
from analysis.answer import accept_model
from analysis.diagnosis import diagnose_response
from analysis.diagnosis.figures import draw_diagnosis, residual_figure
from daq.formats import read_response
from daq.plan import SweepPlan, spaced_frequencies
from sim.catalogue import CATALOGUE
from sim.effects import parse_effect
from sim.response import simulate
from sim.unit import load_unit

PRACTICE = Path(__file__).parents[2] / "data" / "practice"
TRUTH = json.loads((PRACTICE / "truth.json").read_text())
ADSS = load_unit("adss")
SHORT = SweepPlan(spaced_frequencies(105.0, 172.0, 24), (1.5, 4.0))


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("runs")


def response_hiding(texts, seed, plan=SHORT, ratio=None):
    rng = np.random.default_rng(seed)
    effects = [parse_effect(text) for text in texts]
    ratio = rng.uniform(0.1, 0.9) if ratio is None else ratio
    unit = hidden.off_datasheet(ADSS, rng)
    return hidden.reading(simulate(unit, ratio, plan, effects=effects, seed=seed), rng)


@pytest.mark.study
def test_plain_unit_gets_no_cause(cache):
    seed = int(np.random.SeedSequence().entropy % 2**31)
    print(f"seed {seed}")
    found = diagnose_response(response_hiding([], seed), ADSS, cache=cache)
    # About one plain unit in forty, at a ratio near 0, is called unexplained by so short a sweep.
    assert found.verdict.word in ("consistent", "unexplained")
    assert found.causes == ()
    assert found.next_measurement is None


@pytest.mark.study
def test_withheld_cause_is_not_confidently_replaced(cache):
    """The response hides a cause that the catalogue lacks."""
    text = "filter-corner:scale=0.6"
    found = diagnose_response(
        response_hiding([text], 5), ADSS, without=("filter-corner",), cache=cache
    )
    assert found.verdict.word in ("unexplained", "ambiguous")
    assert found.shape.startswith(("gain", "phase"))
    assert "filter-corner" not in {e for one in found.verdict.judged for e in one.effects}


SEEN_BLAMED = (3, 891144620)
"""Plain units in which Stribeck friction was named once: it imitates a branch of the motion."""
SEEN_UNEXPLAINED = (316,)
"""A plain unit that was called unexplained once."""


@pytest.mark.study
@pytest.mark.parametrize("seed", [*SEEN_BLAMED, *SEEN_UNEXPLAINED])
def test_plain_units_once_misjudged_are_consistent(seed, cache):
    found = diagnose_response(response_hiding([], seed), ADSS, cache=cache)
    assert (found.verdict.word, found.causes) == ("consistent", ())


@pytest.mark.study
def test_two_large_causes_are_named_together(cache):
    texts = ["amplifier-lag:tau_a=0.002", "load-inertia:J_L=0.0040"]
    found = diagnose_response(response_hiding(texts, 8, ratio=0.4), ADSS, cache=cache)
    first = found.verdict.judged[0].effects
    # With so few points a softer shaft or more play may stand in for the heavier load (seen in
    # about half of the seeds); that it takes two, and that the lag is one of them, is plain.
    assert "amplifier-lag" in first
    assert len(first) == 2
    assert not found.verdict.baseline.adequate


@pytest.mark.study
def test_one_level_without_phase_gets_verdict(cache):
    """The answer asks for another measurement."""
    plan = SweepPlan(SHORT.frequencies_hz[::2], (2.5,))
    whole = response_hiding(["load-inertia:J_L=0.0045"], 2, plan)
    poor = type(whole).from_arrays(
        whole.frequency_hz,
        whole.source_vpk,
        np.abs(whole.gain),
        unit="ADSS",
        gain_std_db=whole.gain_std_db,
        phase_known=np.zeros(len(whole), dtype=bool),
    )
    # Among a few causes: what is asked here is how poor data are dealt with.
    others = set(CATALOGUE) - {text.partition(":")[0] for text in hidden.LARGE}
    found = diagnose_response(poor, ADSS, without=others, cache=None)
    document = found.to_json()
    assert document["verdict"] in ("consistent", "explained", "ambiguous", "unexplained")
    assert len(found.warnings) == 2 + (found.verdict.word == "unexplained")
    assert document["next_measurement"] is not None
    assert all(entry["quantity"] == "gain" for entry in document["residual"])
    json.dumps(document, allow_nan=False)


# A quarter of an hour. Every day the verb diagnoses one response that hides a large effect
# (`tests/tui/commands/test_diagnose.py`).
@pytest.mark.study
@pytest.mark.parametrize("number", [f"{i:02d}" for i in range(1, 13)])
def test_practice_sets_of_another_program(number, tmp_path, practice_cache):
    response = read_response(PRACTICE / f"practice-{number}.csv")
    judge_practice(number, response, practice_cache, tmp_path)


@pytest.mark.study
def test_practice_set_with_half_its_points(tmp_path, practice_cache):
    response = read_response(PRACTICE / "practice-12.csv")
    frequencies = np.unique(response.frequency_hz)[::2]
    half = response.take(np.isin(response.frequency_hz, frequencies))
    assert len(half) == 3 * 31
    judge_practice("12", half, practice_cache, tmp_path)


def judge_practice(number, response, cache, folder):
    """The right cause at the right size, levels not fitted predicted, text, document, pictures.

    None but rare causes are rivals: the motor's inertia does as well as a tachometer's gain.
    """
    truth = TRUTH[f"practice-{number}"]
    unit = load_unit(truth["unit"].lower())
    found = diagnose_response(response, unit, cache=cache)
    document = json.loads(json.dumps(found.to_json(), allow_nan=False))
    rivals = found.verdict.rivals
    assert all(any(CATALOGUE[effect].rare for effect in one.effects) for one in rivals)
    likely = "ambiguous" if rivals else "explained"
    assert document["verdict"] == (likely if truth["effects"] else "consistent")
    named = {cause["effect"]: cause["parameters"] for cause in document["causes"]}
    assert set(named) == set(truth["effects"])
    for effect, values in truth["effects"].items():
        for name, value in values.items():
            assert named[effect][name]["value"] == pytest.approx(value, rel=0.15)
    ratio = document["contribution_ratio"]["extended"]
    assert abs(ratio["value"] - truth["contribution_ratio"]) < 0.06
    assert_backlash_is_that_of_the_accepted_model(document, truth, unit)
    assert document["extended"]["held_out_rms_sigma"] < 1.3
    assert "\n".join(found.summary())
    for path in draw_diagnosis(found, folder):
        assert path.read_bytes().startswith(b"\x89PNG")


def assert_backlash_is_that_of_the_accepted_model(document, truth, unit):
    """Each number within four of its error bars, and no advice on the wrong stage."""
    ratio = truth["contribution_ratio"]
    b_t = truth["effects"].get("total-backlash", {}).get("b_t_deg", unit.backlash.b_t_deg)
    told = {"b1_deg": ratio * b_t * unit.output_ratio, "b2_deg": (1 - ratio) * b_t, "b_t_deg": b_t}
    accepted = document["verdict"] != "ambiguous"
    for name, value in told.items():
        assert (document[name] is not None) == accepted
        for model in document["models"][:1]:
            assert abs(model[name]["value"] - value) <= max(4.0 * model[name]["std"], 1e-12)
    headline = advise(accept_model(None, document), unit).headline
    wrong = 2 if ratio > 0.5 else 1
    assert not headline.startswith(f"Adjust stage {wrong}")


@pytest.fixture(scope="session")
def practice_cache(tmp_path_factory):
    return tmp_path_factory.mktemp("practice-runs")


@pytest.mark.study
def test_offset_sweep_is_diagnosed_with_its_predecessor(cache):
    """A cable of 900 N.m/rad at one level: each sweep alone is short, and leans or does not."""
    text, frequencies = "cable-stiffness:K_c=900", spaced_frequencies(105.0, 172.0, 16)
    rng = np.random.default_rng(4)
    unit, ratio = hidden.off_datasheet(ADSS, rng), 0.4
    first, second = (
        hidden.reading(simulate(unit, ratio, plan, effects=[parse_effect(text)], seed=n), rng)
        for n, plan in enumerate(
            [SweepPlan(frequencies, (2.5,)), SweepPlan(frequencies[::2], (2.5,), dc_offset_v=1.0)]
        )
    )
    others = set(CATALOGUE) - {"cable-stiffness", "load-inertia", "shaft-stiffness"}
    found = diagnose_response(first, ADSS, further=[second], without=others, cache=cache)
    document = found.to_json()
    assert [(one["points"], one["dc_offset_v"]) for one in document["sweeps"]] == [
        (16, 0.0), (8, 1.0)
    ]  # fmt: skip
    assert "cable-stiffness" in found.verdict.best.effects
    assert found.verdict.word in ("explained", "ambiguous")
    # Four of its error bars: missed by chance in one of some thousand machines.
    assert abs(found.ratio_extended[0] - ratio) < 4.0 * found.ratio_extended[1]
    # Both sweeps are of one level, and short.
    one_level, short = found.warnings
    assert "whole sweeps at that level" in one_level
    assert "holds 16 frequencies" in short
    axes = residual_figure(found).axes[:2]
    assert [one.get_title() for one in axes] == ["2.5 V peak", "2.5 V peak, offset 1 V"]
    said = "\n".join(found.summary())
    assert "sweep 2: 8 points from 105 to 167.533 Hz up at 2.5 V, offset 1 V" in said
