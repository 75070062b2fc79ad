"""What is advised on the practice sets, whose truth another program knows.

From what estimate and diagnosis said of each of them, kept in ``tests/data/practice-answers.json``
(made by ``lashbench estimate`` and ``diagnose`` with ``--json``; the everyday tests compute some
of it anew, `make blind` all of it).
"""

import json
from pathlib import Path

import pytest

from analysis.advice import advise
from analysis.answer import accept_model
from analysis.selection.wording import verdict_words
from sim.unit import load_unit

DATA = Path(__file__).parents[1] / "data"
TRUTH = json.loads((DATA / "practice" / "truth.json").read_text())
SAID = json.loads((DATA / "practice-answers.json").read_text())

UNDECIDED = ("Neither stage stands out", "Undecided", "No advice")


def headline(name, *, diagnosed):
    answer = accept_model(SAID[name]["estimate"], SAID[name]["diagnosis"] if diagnosed else None)
    return advise(answer, load_unit(TRUTH[name]["unit"].lower())).headline


@pytest.mark.parametrize("diagnosed", [False, True])
@pytest.mark.parametrize("name", sorted(TRUTH))
def test_the_advice_is_right_or_undecided(name, diagnosed):
    right = 1 if TRUTH[name]["contribution_ratio"] > 0.5 else 2
    said = headline(name, diagnosed=diagnosed)
    assert said.startswith((f"Adjust stage {right} first", *UNDECIDED))


def test_diagnosis_advises_wherever_ratio_is_decidable():
    """Eight practice units have a ratio that is not near one half."""
    far = [name for name in TRUTH if abs(TRUTH[name]["contribution_ratio"] - 0.5) > 0.05]
    assert len(far) == 8
    assert all(headline(name, diagnosed=True).startswith("Adjust stage") for name in far)


@pytest.mark.parametrize("name", sorted(TRUTH))
def test_stated_numbers_contain_the_truth(name):
    answer = accept_model(SAID[name]["estimate"], SAID[name]["diagnosis"])
    unit, truth = load_unit(TRUTH[name]["unit"].lower()), TRUTH[name]
    ratio = truth["contribution_ratio"]
    b_t = truth["effects"].get("total-backlash", {}).get("b_t_deg", unit.backlash.b_t_deg)
    known = {
        "contribution_ratio": ratio,
        "b1_deg": ratio * b_t * unit.output_ratio,
        "b2_deg": (1 - ratio) * b_t,
    }
    assert bool(answer.numbers) == (SAID[name]["diagnosis"]["verdict"] != "ambiguous")
    for quantity, value in known.items():
        low, high = answer.models[0][quantity]["interval95"]
        assert low < value < high


def test_nothing_hidden_wording_follows_the_probability():
    said = SAID["practice-09"]["diagnosis"]
    assert "probability 0.95: extremely likely." in " ".join(verdict_words(said))
    near = [
        {"causes": ["load-coulomb-friction"], "probability": 0.57, "remark": ""},
        {"causes": [], "probability": 0.36, "remark": ""},
    ]
    nine = " ".join(verdict_words(said | {"rivals": near}))
    assert "probability 0.36: about as likely as not. Still open: load-coulomb-friction" in nine
    assert "nothing else" not in nine
