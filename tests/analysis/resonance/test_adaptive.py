"""What a refining sweep is told about the features."""

import math

import numpy as np

from analysis.resonance.adaptive import judge_features
from daq.adaptive import AdaptiveSweep, Refinement
from daq.analyser import SweepPoint
from daq.plan import SweepPlan, spaced_frequencies


def gain(frequency_hz: float) -> complex:
    """Zeros at 125 Hz, poles at 150 Hz, both with a damping ratio of 0.02."""
    s = 2j * math.pi * frequency_hz
    zero, pole = 2 * math.pi * 125.0, 2 * math.pi * 150.0
    top = s * s + 2 * 0.02 * zero * s + zero**2
    return 0.3 * top / (s * s + 2 * 0.02 * pole * s + pole**2)


def point(frequency_hz: float, generator) -> SweepPoint:
    noise = 1e-3 * (generator.standard_normal() + 1j * generator.standard_normal())
    value = gain(frequency_hz)
    std_db = 8.686 * 1e-3 / abs(value)
    return SweepPoint(frequency_hz, value + noise, std_db, math.degrees(1e-3 / abs(value)))


def test_both_features_are_found_with_their_errors():
    generator = np.random.default_rng(1)
    found = judge_features([point(f, generator) for f in np.linspace(100, 180, 41)])
    for (hz, std_hz, width_hz), truth in zip(found, (125.0, 150.0), strict=True):
        # The extremes of the gain lie a little off zero and pole.
        assert abs(hz - truth) < 1.0
        assert 0 < std_hz < 0.5
        assert 1.0 < width_hz < 12.0


def test_too_little_is_no_feature():
    generator = np.random.default_rng(1)
    for points in ([], [point(100.0, generator)], [point(f, generator) for f in (100.0, 110.0)]):
        assert np.all(np.isnan(judge_features(points)))


def test_of_two_visits_the_last_counts():
    generator = np.random.default_rng(1)
    points = [point(f, generator) for f in np.linspace(100, 180, 41)]
    again = [SweepPoint(p.frequency_hz, 5.0 * p.gain, p.gain_std_db) for p in points]
    mixed = [p for pair in zip(again, points, strict=True) for p in pair]
    assert judge_features(mixed) == judge_features(points)


def test_adaptive_sweep_settles_on_features():
    generator = np.random.default_rng(3)
    plan = SweepPlan(spaced_frequencies(100.0, 180.0, 15), (1.0,))
    sweep = AdaptiveSweep(plan, Refinement(0.05, 120), judge_features)
    while frequencies := sweep.ask():
        sweep.tell([point(f, generator) for f in frequencies])
    assert sweep.reason == "target reached"
    for feature, truth in zip(sweep.features, (125.0, 150.0), strict=True):
        assert abs(feature.feature_hz - truth) < 0.5
