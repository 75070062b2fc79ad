"""The machines that an estimate holds a measurement against: everywhere, and where they were."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.ensemble.datasheet_spread import spread_of
from analysis.estimate.design import RATIO, every_family, near_families, wide_families
from analysis.estimate.estimate import total_axis
from analysis.observation.observation import unread
from daq.plan import SweepPlan
from sim.unit import load_unit

SEEN = unread(SweepPlan((120.0, 130.0), (1.5, 2.5, 4.0)), 5e-4)
SPREAD = spread_of(load_unit("adss"))
BOTH = (replace(RATIO, coarse=17, scale=0.12), total_axis(load_unit("adss")))


def near(mean, std, seed=0, axes=(RATIO,)):
    return near_families(axes, np.atleast_1d(mean), np.atleast_1d(std), SEEN, SPREAD, seed)


def ratios(families):
    return np.array([machine.ratio for family in families for machine in family])


def test_close_answers_use_same_machines():
    here, beside = near(0.41, 0.03), near(0.38, 0.035)
    assert near(0.41, 0.02) == here
    assert len(set(here) & set(beside)) >= len(here) - 1
    assert not set(here) & set(near(0.41, 0.03, seed=1))
    assert not set(here) & set(near(0.91, 0.03))
    assert {len({m.deviations for m in family}) for family in here} == {1}
    assert len({family[0].deviations for family in here}) == len(here)


@pytest.mark.parametrize(("mean", "std"), [(-0.3, 0.01), (0.0, 0.05), (0.97, 0.2), (0.5, 5.0)])
def test_machines_lie_in_range_beyond_answer(mean, std):
    at = ratios(near(mean, std))
    assert at.min() >= 0.0
    assert at.max() <= 1.0
    asked = np.clip(mean, 0.0, 1.0)
    for side in (-1.0, 1.0):
        edge = np.clip(asked + side * 2.0 * std, 0.0, 1.0)
        assert at.min() - 0.03 <= edge <= at.max() + 0.03


@pytest.mark.parametrize("mean", np.linspace(0.1, 0.9, 17))
def test_most_machines_lie_where_the_answer_does(mean):
    at = ratios(near(mean, 0.01))
    counts = [np.count_nonzero(np.abs(at - place) < 0.05) for place in np.linspace(0.0, 1.0, 21)]
    assert counts[round(20 * mean)] >= 0.7 * max(counts)
    assert np.count_nonzero(np.abs(at - mean) < 0.05) > 20


def test_vague_answer_costs_little_more():
    vague = near(0.5, 1.0)
    assert len(near(0.5, 0.01)) <= 9 < len(vague) == 12
    assert np.diff(np.sort(ratios(vague))).max() < 0.03


@pytest.mark.parametrize("axes", [(RATIO,), BOTH])
def test_all_requested_families_are_among_every_family(axes):
    known = set(every_family(axes, SEEN, SPREAD, 0))
    assert set(wide_families(axes, SEEN, SPREAD, 0)) <= known
    rng = np.random.default_rng(4)
    low, high = (np.array([getattr(axis, end) for axis in axes]) for end in ("low", "high"))
    for _ in range(50):
        mean = low + (high - low) * rng.uniform(-0.1, 1.1, len(axes))
        std = (high - low) * rng.uniform(0.0, 0.6, len(axes))
        asked = near(mean, std, axes=axes)
        assert 2 <= len(asked) <= 12 * len(axes)
        assert set(asked) <= known


def test_half_of_machines_start_anywhere_in_backlash():
    spreads = [m.start_spread for family in every_family((RATIO,), SEEN, SPREAD, 0) for m in family]
    assert 0.4 < np.mean(np.array(spreads) == 1.0) < 0.6


def test_family_fills_lanes_with_all_levels():
    assert {len(family) for family in near(0.5, 0.1)} == {21}
    one_level = unread(SweepPlan((120.0, 130.0), (2.5,)), 5e-4)
    lone = near_families((RATIO,), np.array([0.5]), np.array([0.1]), one_level, SPREAD, 0)
    assert {len(family) for family in lone} == {32}
