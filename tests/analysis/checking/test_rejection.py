"""What speaks against a set by itself, given how it fits and what it predicts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from worlds.judging import FITS, TRUE, WRONG

from analysis.checking import rejection as objection
from analysis.checking.plausibility import is_pressed

THREE = (*TRUE, *WRONG, "shaft-damping")


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
        against = objection.find_rejection(one, held_out, FITS, np.random.default_rng(0))
        assert against == ("needs a size outside its plausible range" if pressed else otherwise)


@pytest.mark.parametrize(
    ("effects", "missed", "share", "adequate"),
    [
        ((), 1.9, 0.04, True), ((), 1.9, 0.02, False), ((), 2.1, 1.0, False),
        (TRUE, 1.4, 0.0, True), (TRUE, 1.6, 0.08, True), (TRUE, 1.6, 0.02, False),
        (TRUE, 2.1, 1.0, False), (TRUE + WRONG, 0.9, 0.0, True),
        (TRUE + WRONG, 1.1, 0.0, False), (TRUE + WRONG, 1.4, 0.02, True),
        (TRUE + WRONG, 1.6, 1.0, False), (THREE, 0.9, 0.0, True), (THREE, 1.1, 1.0, False),
    ],
)  # fmt: skip
def test_rejection_compares_misses_with_replicates(effects, missed, share, adequate, monkeypatch):
    monkeypatch.setattr(objection, "is_out_of_sight", lambda _: False)
    monkeypatch.setattr(objection, "misses_alike", lambda one, held, least, rng: share > least)
    best = SimpleNamespace(place=np.full(1 + len(effects), 0.5))
    hypothesis = SimpleNamespace(effects=effects, amid=[])
    candidate = SimpleNamespace(hypothesis=hypothesis, best=best, surface=SimpleNamespace(fit=None))
    rng = np.random.default_rng(0)
    held_out = SimpleNamespace(missed=missed)
    against = "" if adequate else "does not predict held-out levels"
    assert objection.find_rejection(candidate, held_out, FITS, rng) == against
    limit = 2.0 if effects == THREE else 4.0
    alike = objection.find_rejection(candidate, held_out, replace(FITS, sigma=limit - 0.1), rng)
    assert alike == against
    unlike = objection.find_rejection(candidate, held_out, replace(FITS, sigma=limit + 0.1), rng)
    assert unlike == "fits worse than replicates of this model"
    shaped = objection.find_rejection(candidate, held_out, replace(FITS, structure=2.6), rng)
    assert shaped == "leaves a residual pattern that replicates do not"
