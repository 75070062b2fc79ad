"""What speaks against a set by itself, given how it fits and what it predicts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from worlds.judging import FITS, TRUE, WRONG
from worlds.synthetic import ADSS, observation, read

from analysis.checking import rejection as objection
from analysis.checking.plausibility import is_pressed
from analysis.ensemble.model import Hypothesis


def read_plain():
    return read((), np.array([0.5]), np.random.default_rng(0))


@pytest.mark.parametrize(
    ("size", "steep", "pressed"),
    [(1.0, 400.0, True), (1.0, 200.0, False), (0.97, 400.0, False), (0.0, -400.0, True),
     (0.01, -400.0, True), (0.03, -400.0, False), (0.5, 400.0, False)],
)  # fmt: skip
def test_size_at_range_end_is_rejected(monkeypatch, size, steep, pressed):
    def fit(place):
        # Falls off inwards by the heat of 15 within 0.05, or by less.
        return SimpleNamespace(place=place, log_likelihood=steep * place[1])

    surface = SimpleNamespace(fit=fit)
    one = SimpleNamespace(
        hypothesis=SimpleNamespace(effects=TRUE, amid=[False]),
        best=fit(np.array([0.4, size])),
        surface=surface,
    )
    assert is_pressed(one) is pressed
    held_out = SimpleNamespace(missed=1.0)
    for hidden, otherwise in ((False, ""), (True, "resonates outside the measured band")):
        monkeypatch.setattr(objection, "is_out_of_sight", lambda _, hidden=hidden: hidden)
        against = objection.find_rejection(one, held_out, FITS)
        assert against == ("needs a size outside its plausible range" if pressed else otherwise)


@pytest.mark.parametrize("effects", [(), TRUE, TRUE + WRONG])
@pytest.mark.parametrize(
    ("missed", "fitted", "against"),
    [
        (1.4, FITS, ""),
        (1.6, FITS, "does not predict held-out levels"),
        (1.4, replace(FITS, sigma=3.9), ""),
        (1.4, replace(FITS, sigma=4.1), "fits worse than replicates of this model"),
        (1.4, replace(FITS, structure=2.4), ""),
        (1.4, replace(FITS, structure=2.6), "leaves a residual pattern that replicates do not"),
    ],
)
def test_poor_fit_or_prediction_is_rejected(effects, missed, fitted, against):
    hypothesis = Hypothesis(ADSS, effects)
    best = SimpleNamespace(place=np.full(hypothesis.d, 0.5), log_likelihood=0.0)
    surface = SimpleNamespace(fit=lambda place: best, observation=observation(read_plain()))
    candidate = SimpleNamespace(hypothesis=hypothesis, best=best, surface=surface)
    held_out = SimpleNamespace(missed=missed)
    assert objection.find_rejection(candidate, held_out, fitted) == against
