"""Sizes that no bench has, or that every bench has."""

from types import SimpleNamespace

import numpy as np
import pytest
from worlds.synthetic import ADSS

from analysis.checking.plausibility import is_out_of_sight, is_pressed
from analysis.ensemble.model import Hypothesis

TRUE = ("load-inertia",)
PAIR = ("amplifier-gain", "cable-stiffness")


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize(
    ("size", "lost", "pressed"),
    [(0.93, 29.0, True), (0.93, 31.0, False), (0.84, 0.0, False), (0.99, 29.0, True)],
)
def test_half_or_twice_datasheet_explains_nothing(size, lost, pressed, mirrored):
    """For values that may be that far off anyway."""

    def fit(place):
        return SimpleNamespace(place=place, log_likelihood=-lost if place[1] in (0.0, 1.0) else 0.0)

    def judged(amid):
        hypothesis = SimpleNamespace(effects=TRUE, amid=[amid])
        best = fit(np.array([0.4, 1.0 - size if mirrored else size]))
        return SimpleNamespace(hypothesis=hypothesis, best=best, surface=SimpleNamespace(fit=fit))

    assert is_pressed(judged(True)) is pressed
    assert not is_pressed(judged(False))


def off_by(effects, off, steep):
    """A candidate whose datasheet values are off by a share, and its fit worse by `steep` per unit
    of the place of the first."""
    hypothesis = Hypothesis(ADSS, effects)
    known = [parameter.nominal(ADSS) for _, parameter in hypothesis.parameters]
    place = hypothesis.place(0.4, [300.0 if n is None else n * (1.0 + off) for n in known])

    def fit(there):
        lost = steep * abs(there[1] - place[1])
        return SimpleNamespace(place=there, log_likelihood=-lost)

    surface = SimpleNamespace(fit=fit)
    return SimpleNamespace(hypothesis=hypothesis, best=fit(place), surface=surface)


@pytest.mark.parametrize(
    ("effect", "off", "within"),
    [
        ("filter-corner", 0.028, True), ("filter-corner", -0.049, True),
        ("filter-corner", 0.051, False), ("amplifier-gain", 0.028, False),
    ],
)  # fmt: skip
def test_filter_corner_has_tolerance_of_capacitors(effect, off, within):
    one = off_by((effect,), off, 1e6)
    assert one.hypothesis.within_tolerance(one.best.place) == [within]


@pytest.mark.parametrize(
    ("resonance_hz", "beyond"),
    [
        (22.0, True),
        (49.0, True),
        (51.0, False),
        (99.0, False),
        (101.0, False),
        (130.0, False),
        (179.0, False),
        (181.0, False),
        (359.0, False),
        (361.0, True),
    ],
)
@pytest.mark.parametrize("beside", [(), ("amplifier-lag",), ("load-inertia",)])
def test_resonance_far_outside_band_is_rejected(beside, resonance_hz, beyond):
    hypothesis = Hypothesis(ADSS, tuple(sorted((*beside, "payload-flexibility"))))
    sizes = {"J_p": 5e-4, "f_p": resonance_hz, "zeta_p": 0.03, "tau_a": 3e-4, "J_L": 3e-3}
    values = [sizes[parameter.name] for _, parameter in hypothesis.parameters]
    best = SimpleNamespace(place=hypothesis.place(0.4, values))
    measured = SimpleNamespace(frequency_hz=np.linspace(100.0, 180.0, 61))
    surface = SimpleNamespace(observation=measured)
    one = SimpleNamespace(hypothesis=hypothesis, best=best, surface=surface)
    assert is_out_of_sight(one) is beyond


def test_effect_without_resonance_is_never_outside_band():
    one = off_by(PAIR, 0.2, 0.0)
    one.surface.observation = SimpleNamespace(frequency_hz=np.array([1e4, 2e4]))
    assert not is_out_of_sight(one)


def test_value_without_datasheet_has_no_tolerance():
    one = off_by(("amplifier-lag", "cable-stiffness"), 0.0, 0.0)
    assert not any(one.hypothesis.within_tolerance(one.best.place))
