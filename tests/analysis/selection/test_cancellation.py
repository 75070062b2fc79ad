"""What was about to be named for sure, by all its runs: faults that cancel, and what none saw."""

from types import SimpleNamespace

import numpy as np
import pytest

from analysis.checking.rejection import OUT_OF_SIGHT
from analysis.ensemble.model import Hypothesis
from analysis.observation.observation import unread
from analysis.selection import cancellation as second_thoughts
from analysis.selection.cancellation import UNDOING, cancellation_ratio, confirm_causes
from analysis.selection.verdict import Judged, Verdict
from daq.plan import SweepPlan, spaced_frequencies
from sim.unit import load_unit

ADSS = load_unit("adss")
SHORT = unread(SweepPlan(spaced_frequencies(100.0, 180.0, 7), (2.5,)), 1e-4)
GAINS = ("amplifier-gain", "motor-constant")
BRAKE, SHAFT = "load-viscous-damping", "shaft-stiffness"


def left(effects, values, seed=0):
    hypothesis = Hypothesis(ADSS, effects)
    place = hypothesis.place(0.42, values)
    return cancellation_ratio(hypothesis, place, SHORT, np.random.default_rng(seed))


@pytest.mark.parametrize("seed", range(3))
def test_a_weak_amplifier_undoes_a_stronger_motor(seed):
    """But for its brake, which goes with the square of its constant: 2.8 / 4.2 of 1.46 is 0.97."""
    assert left(GAINS, (2.82, 1.46), seed) < 0.65


@pytest.mark.parametrize("seed", range(3))
def test_weak_amplifier_does_not_cancel_weaker_motor(seed):
    assert left(GAINS, (2.82, 0.7), seed) > 1.0


def test_unrelated_causes_add_without_cancelling():
    assert left((BRAKE, SHAFT), (0.15, 20.0)) > 1.0


def test_smallest_of_three_ratios_counts():
    """A small brake beside two that undo each other leaves more than itself."""
    three = left((*GAINS[:1], BRAKE, *GAINS[1:]), (2.82, 0.002, 1.46))
    assert three > left(GAINS, (2.82, 1.46))


def test_phase_is_compared_around_the_circle():
    one, other = np.zeros((2, 4)), np.zeros((2, 4))
    one[1], other[1] = np.pi - 0.1, 0.1 - np.pi
    assert second_thoughts.distance(one, other) == pytest.approx(0.2)
    other[0] = 50.0
    # And no row is further off than it can be.
    assert second_thoughts.distance(one, other) == pytest.approx(1.0)


def told(effects, word="explained"):
    surface = SimpleNamespace(observation=SHORT)
    hypothesis = Hypothesis(ADSS, effects)
    found = SimpleNamespace(place=np.full(hypothesis.d, 0.9))
    candidate = SimpleNamespace(hypothesis=hypothesis, surface=surface, best=found)
    best = Judged(candidate, None, 100.0, 0.0, 0.0, 0.9, "")
    baseline = Judged(SimpleNamespace(hypothesis=Hypothesis(ADSS)), None, 0.0, 0.0, 0.0, 0.1, "")
    return Verdict(word, best, (best, baseline), baseline)


def held(verdict, values=None):
    hypothesis = verdict.best.candidate.hypothesis
    place = np.full(hypothesis.d, 0.5) if values is None else hypothesis.place(0.5, values)
    return confirm_causes(verdict, place, SHORT, np.random.default_rng(0))


@pytest.mark.parametrize("word", ["explained", "ambiguous"])
@pytest.mark.parametrize(("f_p_hz", "sure"), [(361.0, False), (359.0, True), (130.0, True)])
def test_resonance_outside_band_is_no_explanation(word, f_p_hz, sure):
    """A heavier load that was withheld was told to be a payload: at 250 Hz, after 110 had been
    measured, and within twice that before all its runs were there."""
    verdict = told(("payload-flexibility",), word)
    found = held(verdict, (5e-4, f_p_hz, 0.03))
    if sure or word == "ambiguous":
        assert found is verdict
    else:
        assert (found.word, found.best.objection) == ("unexplained", OUT_OF_SIGHT)


@pytest.mark.parametrize(("share", "word"), [(0.64, "unexplained"), (0.66, "explained")])
def test_cancelling_causes_are_no_explanation(monkeypatch, share, word):
    monkeypatch.setattr(second_thoughts, "cancellation_ratio", lambda *_: share)
    verdict = told(GAINS)
    found = held(verdict)
    assert found.word == word
    assert found.best.effects == GAINS
    if word == "explained":
        assert found is verdict
    else:
        # It is said of it wherever it is listed.
        assert found.best is found.judged[0]
        assert found.best.objection == UNDOING
        monkeypatch.setattr(Verdict, "is_equivalent", lambda *_: False)
        assert found.remark(found.best) == UNDOING


@pytest.mark.parametrize(
    "verdict", [told((SHAFT,)), told(GAINS, "ambiguous"), told(GAINS, "unexplained"), told(())]
)
def test_only_confident_sets_are_tested_for_cancellation(monkeypatch, verdict):
    monkeypatch.setattr(second_thoughts, "cancellation_ratio", None)
    assert held(verdict) is verdict
