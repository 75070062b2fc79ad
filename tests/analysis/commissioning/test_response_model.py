"""Slopes of a sweep by few drives: known ones, smooth along the sweep or not."""

import numpy as np
import pytest

from analysis.commissioning.regression import Gaussian, Round, regress
from analysis.commissioning.response_model import ResponseModel

D, POINTS, SERIES = 6, 60, 4
SERIES_OF_ROWS = np.repeat(np.arange(SERIES), POINTS)
PRIOR = Gaussian(np.zeros(D), np.eye(D))


def slopes_of(rng, smooth):
    """Slopes (D, rows), root mean square 0.15: resonance curves, or without any order."""
    if not smooth:
        return 0.15 * rng.standard_normal((D, SERIES * POINTS))
    place, shape = np.arange(POINTS), (D, SERIES, 1)
    middle, width = rng.uniform(5, POINTS - 5, shape), rng.uniform(3.0, 10.0, shape)
    curve = rng.choice([-1.0, 1.0], shape) / (1.0 + ((place - middle) / width) ** 2)
    return (0.15 * curve / np.sqrt(np.mean(curve**2, axis=-1, keepdims=True))).reshape(D, -1)


def drives(slopes, count, rng, centre=0.0):
    x = rng.standard_normal((count, D))
    return x, centre + x @ slopes + rng.standard_normal((count, slopes.shape[1]))


def error(model, slopes):
    return float(np.sqrt(np.mean((model.slopes - slopes) ** 2)))


@pytest.mark.parametrize("seed", range(4))
def test_smooth_slopes_are_found_by_few_drives(seed):
    rng = np.random.default_rng(seed)
    slopes = slopes_of(rng, smooth=True)
    x, y = drives(slopes, 60, rng)
    smooth, raw = ResponseModel.fit(x, y, SERIES_OF_ROWS), ResponseModel.fit(x, y)
    assert error(smooth, slopes) < 0.8 * error(raw, slopes)


@pytest.mark.parametrize("seed", range(4))
def test_slopes_without_order_are_not_blurred(seed):
    rng = np.random.default_rng(seed)
    slopes = slopes_of(rng, smooth=False)
    x, y = drives(slopes, 60, rng)
    smooth, raw = ResponseModel.fit(x, y, SERIES_OF_ROWS), ResponseModel.fit(x, y)
    assert error(smooth, slopes) < 1.02 * error(raw, slopes)
    # Where drives are many the slopes are theirs, smoothed or not.
    x, y = drives(slopes, 20_000, rng)
    smooth = ResponseModel.fit(x, y, SERIES_OF_ROWS)
    np.testing.assert_allclose(smooth.slopes, ResponseModel.fit(x, y).slopes, rtol=0.02, atol=1e-3)


def test_other_drives_share_slopes_alone():
    rng = np.random.default_rng(1)
    slopes = slopes_of(rng, smooth=False)
    here, there = drives(slopes, 60, rng), drives(slopes, 180, rng)
    shifted = there[0], there[1] + 7.0
    alone = ResponseModel.fit(*here)
    found, same = (ResponseModel.fit(*here, others=[one]) for one in (there, shifted))
    assert error(found, slopes) < 0.6 * error(alone, slopes)
    np.testing.assert_allclose(found.slopes, same.slopes, atol=1e-9)
    np.testing.assert_allclose(found.centre, same.centre, atol=1e-9)
    assert np.abs(found.centre).max() < 0.7


def test_coordinate_without_effect_stays_regular():
    rng = np.random.default_rng(2)
    slopes = slopes_of(rng, smooth=True)
    slopes[-1] = 0.0
    x, y = drives(slopes, 80, rng)
    model = ResponseModel.fit(x, y, SERIES_OF_ROWS)
    estimate = model.estimate(drives(slopes, 50, rng)[1])
    assert np.all(np.isfinite(estimate))
    assert np.std(estimate[:, -1]) < 0.5


def test_smoothing_narrows_intervals_that_still_hold():
    """Long sweeps and few drives: 95 % intervals of 20 worlds, 120 coordinates, 107 by chance."""
    held, widths = 0, []
    for seed in range(20):
        rng = np.random.default_rng(100 + seed)
        slopes, truth = slopes_of(rng, smooth=True), rng.standard_normal(D)
        target = truth @ slopes + rng.standard_normal(slopes.shape[1])
        x, y = drives(slopes, 90, rng)
        plain = Round(x, np.arange(len(x)), y)
        ordered = Round(x, np.arange(len(x)), y, series=SERIES_OF_ROWS)
        found, raw = (regress(one, target, PRIOR, PRIOR).posterior for one in (ordered, plain))
        held += int(np.sum(np.abs(found.mean - truth) < 1.96 * found.std))
        widths.append(np.linalg.slogdet(found.covariance)[1] - np.linalg.slogdet(raw.covariance)[1])
    assert held >= 107
    assert np.mean(widths) < -0.5
