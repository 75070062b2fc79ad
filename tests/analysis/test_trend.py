"""Lines through values with error bars, against numbers worked out by hand and by another fit."""

import numpy as np
import pytest

from analysis.trend import SECONDS_PER_DAY, fit_trend
from daq.errors import InputError


def test_line_and_error_match_reference_fit():
    generator = np.random.default_rng(5)
    days, std = generator.uniform(0, 100, 30), generator.uniform(0.5, 2.0, 30)
    values = 3.0 - 0.25 * days + std * generator.standard_normal(30)
    trend = fit_trend(days * SECONDS_PER_DAY + 1e9, values, std)
    (slope, _), covariance = np.polyfit(days, values, 1, w=1 / std, cov="unscaled")
    assert trend.slope_per_day == pytest.approx(slope, rel=1e-6)
    assert trend.slope_std == pytest.approx(np.sqrt(covariance[0, 0]), rel=1e-6)
    assert abs(trend.slope_per_day + 0.25) < 4 * trend.slope_std
    assert trend.degrees == 28


def test_slope_interval_has_stated_coverage():
    days = np.array([0.0, 1.0, 5.0, 9.0, 30.0])
    inside = 0
    for seed in range(400):
        values = 1.0 + 0.1 * days + 0.3 * np.random.default_rng(seed).standard_normal(5)
        trend = fit_trend(days * SECONDS_PER_DAY, values, [0.3] * 5)
        inside += abs(trend.slope_per_day - 0.1) < trend.slope_std
    # 68.3 % of 400 is 273, one standard deviation of that 9.
    assert 273 - 4 * 9 < inside < 273 + 4 * 9


def test_two_values_by_hand():
    trend = fit_trend([0.0, 2 * SECONDS_PER_DAY], [1.0, 2.0], [0.1, 0.1])
    assert (trend.mean, trend.slope_per_day) == (pytest.approx(1.5), pytest.approx(0.5))
    assert trend.mean_std == pytest.approx(0.1 / np.sqrt(2))
    assert trend.slope_std == pytest.approx(0.1 * np.sqrt(2) / 2)
    assert (trend.chi2, trend.degrees) == (pytest.approx(0.0, abs=1e-20), 0)


def test_without_two_moments_there_is_no_slope():
    trend = fit_trend([7.0, 7.0], [1.0, 2.0], [0.1, 0.1])
    assert trend.slope_per_day is None
    assert (trend.chi2, trend.degrees) == (pytest.approx(50.0), 1)
    assert fit_trend([7.0], [1.0], [0.1]).slope_std is None
    assert fit_trend([], [], []) is None


@pytest.mark.parametrize(
    ("times", "values", "stds"),
    [([1.0], [1.0, 2.0], [1.0]), ([1.0], [1.0], [0.0]), ([1.0], [np.nan], [1.0])],
)
def test_unfittable_values_are_refused(times, values, stds):
    with pytest.raises(InputError, match="trend"):
        fit_trend(times, values, stds)


@pytest.mark.parametrize(
    ("slope", "limits", "limit", "day"),
    [
        (0.1, (None, 2.0), 2.0, 10.0),
        (-0.1, (0.5, 2.0), 0.5, 5.0),
        # Already beyond: when it passed.
        (0.1, (None, 1.2), 1.2, 2.0),
    ],
)
def test_line_meets_limit_it_moves_towards(slope, limits, limit, day):
    days = np.array([0.0, 1.0, 3.0, 4.0])
    trend = fit_trend(1e9 + days * SECONDS_PER_DAY, 1.0 + slope * days, [0.01] * 4)
    found = trend.reaches(*limits)
    assert found[0] == limit
    assert found[1] == pytest.approx(1e9 + day * SECONDS_PER_DAY)


@pytest.mark.parametrize(
    ("slope", "std", "limits"),
    [(0.1, 0.01, (0.5, None)), (0.1, 1.0, (0.5, 2.0)), (0.0, 0.01, (0.5, 2.0))],
)
def test_opposite_or_insignificant_slope_meets_no_limit(slope, std, limits):
    days = np.array([0.0, 1.0, 3.0, 4.0])
    trend = fit_trend(days * SECONDS_PER_DAY, 1.0 + slope * days, [std] * 4)
    assert trend.reaches(*limits) is None
