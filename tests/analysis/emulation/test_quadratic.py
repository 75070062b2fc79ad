"""Local regression over draws: known means, slopes and scatter come back, outliers do not count."""

import numpy as np
import pytest

from analysis.emulation.quadratic import QuadraticEmulator
from daq.errors import AnalysisError

ROWS = 12


def mean_at(x):
    row = np.linspace(0.0, 1.0, ROWS)
    return np.stack([np.sin(2 * x) + row * x, x**2 - row, -2.0 + 0.3 * x + 0.0 * row])


SLOPE = np.stack([np.linspace(1.0, 2.0, ROWS), np.linspace(-1.0, 0.5, ROWS), np.zeros(ROWS)])
SCALE = np.array([0.02, 0.03, 0.1])[:, None] * np.ones(ROWS)


def drawn(seed, count=400, outliers=0.0):
    rng = np.random.default_rng(seed)
    x = rng.uniform(-0.5, 0.5, count)
    d = rng.choice([-0.01, 0.01], count)
    channels = np.array([mean_at(v) + e * SLOPE for v, e in zip(x, d, strict=True)])
    channels += rng.standard_normal(channels.shape) * SCALE
    wild = rng.random(count) < outliers
    channels[wild] += 1.0
    return QuadraticEmulator(
        x[:, None],
        d[:, None],
        channels,
        (slice(0, ROWS),),
        np.array([0.15]),
        np.array([0.005]),
        0.004,
    )


@pytest.mark.parametrize("seed", range(4))
def test_mean_slope_and_scatter_come_back(seed):
    prediction = drawn(seed).predict(np.array([0.1]))
    assert np.abs((prediction.mean - mean_at(0.1)) / SCALE).max() < 0.8
    # 170 draws bear on the slope at 0.01 each: one sigma is SCALE / 0.01 / 13.
    assert np.abs((prediction.slopes[0] - SLOPE) / (SCALE / 0.01 / 13)).max() < 5.0
    np.testing.assert_allclose(np.median(prediction.std / SCALE), 1.0, atol=0.35)
    np.testing.assert_array_equal(prediction.slopes[1, 0], 1.0)
    np.testing.assert_array_equal(prediction.slopes[1, 1:], 0.0)
    np.testing.assert_array_equal(prediction.sigmas, [0.005, 0.004])


@pytest.mark.parametrize("seed", range(4))
def test_outlying_runs_bias_neither_mean_nor_scale(seed):
    # One run in seven lies 10 to 50 standard deviations off, always on one side:
    # plain regression would be off by up to 7 and state up to 18.
    prediction = drawn(seed, outliers=0.15).predict(np.array([0.1]))
    assert np.abs((prediction.mean - mean_at(0.1)) / SCALE).max() < 2.0
    assert np.median(prediction.std / SCALE) < 6.0


def test_phase_near_180_degrees_is_continuous():
    emulator = drawn(0)
    emulator.channels[:, 1] = np.angle(np.exp(1j * (emulator.channels[:, 1] + np.pi)))
    prediction = emulator.predict(np.array([0.1]))
    error = np.angle(np.exp(1j * (prediction.mean[1] - mean_at(0.1)[1] - np.pi)))
    assert np.abs(error).max() < 0.05
    assert prediction.std[1].max() < 0.1


def test_reach_grows_until_draws_suffice_or_raises():
    emulator = drawn(0, count=30)
    assert np.all(np.isfinite(emulator.predict(np.array([0.0])).mean))
    with pytest.raises(AnalysisError, match="simulated machines"):
        drawn(0, count=5).predict(np.array([0.0]))
