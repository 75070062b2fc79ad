"""Calibration on a problem whose exact answer is known: intervals cover, and no wider than due."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.emulation.parameter_posterior import ParameterPosterior, calibrate
from analysis.ensemble.runs import Population
from analysis.observation.observation import observe, unread
from analysis.observation.reading_noise import USUAL_NOISE_V
from daq.frf import FrequencyResponse
from daq.plan import SweepPlan

ROWS = 30
SCATTER = 0.2
SENSITIVITY = np.linspace(0.5, 2.0, ROWS)
LEVEL = 0.25
"""Source level at which the quietest points show less than a bench's usual noise, V."""

GAIN = 0.005


def channels(x, rng, branch=False, scatter=SCATTER):
    """A response whose log gain follows x, in one piece or with errors shared by a half of it."""
    values = np.zeros((3, ROWS))
    values[0] = np.log(0.1) + SENSITIVITY * x + scatter * rng.standard_normal(ROWS)
    values[1] = scatter * rng.standard_normal(ROWS)
    values[2] = np.log(0.02) + 0.3 * rng.standard_normal(ROWS)
    if branch:
        values[0, : ROWS // 2] += SCATTER * rng.standard_normal()
    return values


def experiment(seed, branch, scatter=SCATTER, step=1):
    """A truth and what is found of it from every so manieth point."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(0.3, 0.7)
    x = rng.uniform(0.0, 1.0, 140)
    drawn = np.array([channels(v, rng, branch, scatter) for v in x])[..., ::step]
    measured = channels(truth, rng, branch, scatter)[:, ::step]
    observation = observed(measured, step)
    return truth, calibrate(observation, runs(x[:, None], drawn), np.array([0.3]), GAIN, rng)


def observed(measured, step=1):
    return observe(
        FrequencyResponse.from_arrays(
            np.linspace(100.0, 130.0, ROWS)[::step],
            LEVEL,
            np.exp(measured[0] + 1j * measured[1]),
            unit="ADSS",
            gain_std_db=8.686 * np.exp(measured[2]),
        )
    )


def runs(places, drawn):
    """Runs (m, 3, rows) at places (m, d) of units as their datasheet says."""
    mean, variance = np.exp(drawn[:, 0] + 1j * drawn[:, 1]), np.exp(2.0 * drawn[:, 2])
    return Population(
        places, np.zeros((len(places), 5)), mean, variance, np.zeros(len(places), int)
    )


@pytest.mark.parametrize("branch", [False, True])
def test_intervals_cover_and_are_near_optimal(branch):
    """They are not wider than the best estimator deserves."""
    results = [experiment(seed, branch) for seed in range(40)]
    z = np.array([(c.mean[0] - t) / np.sqrt(c.covariance[0, 0]) for t, c in results])
    stated = np.median([np.sqrt(c.covariance[0, 0]) for _, c in results])
    # With 95 % coverage 33 or fewer hits of 40 happen once in 500 times.
    assert np.count_nonzero(np.abs(z) < 1.96) > 33
    # The best unbiased estimator's error, from the covariance that made the data.
    covariance = SCATTER**2 * np.eye(ROWS) + 0.005**2
    if branch:
        covariance[: ROWS // 2, : ROWS // 2] += SCATTER**2
    best = 1.0 / np.sqrt(SENSITIVITY @ np.linalg.solve(covariance, SENSITIVITY))
    assert best * 0.8 < stated < best * 2.5


@pytest.mark.parametrize("branch", [False, True])
def test_noise_and_fewer_points_widen_the_interval(branch):
    """Never once narrower, whatever was drawn, and by about as much as is due."""

    def std(seed, **less):
        return np.sqrt(experiment(seed, branch, **less)[1].covariance[0, 0])

    whole = np.array([std(seed) for seed in range(4)])
    # Beyond the prior's reach nothing widens, so less than the factor of 2 or the root of 6.
    for less, least in (({"scatter": 2.0 * SCATTER}, 1.3), ({"step": 6}, 1.5)):
        ratio = np.array([std(seed, **less) for seed in range(4)]) / whole
        assert ratio.min() > 1.0
        assert least < np.median(ratio) < 3.0


def test_two_free_parameters_are_separated():
    rng = np.random.default_rng(3)
    places = rng.uniform(0.0, 1.0, (200, 2))

    def pair(a, b):
        values = channels(a, rng)
        values[1] += np.linspace(-1.0, 1.0, ROWS) * b
        return values

    truth = (0.4, 0.6)
    measured = pair(*truth)
    known = runs(places, np.array([pair(*p) for p in places]))
    found = calibrate(observed(measured), known, np.array([0.3, 0.3]), GAIN, rng)
    z = (found.mean - truth) / np.sqrt(np.diag(found.covariance))
    assert np.abs(z).max() < 4.0
    assert np.all(np.sqrt(np.diag(found.covariance)) < 0.2)
    grid = np.stack([m.ravel() for m in np.meshgrid(*[np.linspace(0, 1, 21)] * 2)], axis=1)
    weight = found.density(grid)
    assert weight.sum() == pytest.approx(1.0)
    assert np.abs(weight @ grid - found.mean).max() < 0.1


CHATTER_V = 1.5e-3
"""Scatter of the motion at half of its range, in components of the reading, V."""


def chattering(truth, noise_v, rng):
    """What is found of a number that shows in how much the motion chatters, and hardly elsewhere.

    Its quietest points show chatter and the reading's noise together; which
    of them is loud is not to be seen.
    """
    quiet = unread(SweepPlan(tuple(np.linspace(100.0, 130.0, ROWS)), (1.0,)), USUAL_NOISE_V)

    def motion(x):
        spread = (
            np.sqrt(2.0) * CHATTER_V * np.exp(1.5 * (x - 0.5) + 0.1 * rng.standard_normal(ROWS))
        )
        gain = 1.0 + 0.02 * (x - 0.5) + CHATTER_V * rng.standard_normal(ROWS)
        return np.array([np.log(gain), np.zeros(ROWS), np.log(spread)])

    x = rng.uniform(0.0, 1.0, 140)
    shown = motion(truth)
    shown[2] = 0.5 * np.log(np.exp(2.0 * shown[2]) + 2.0 * noise_v**2)
    shown[:2] += noise_v * rng.standard_normal((2, ROWS))
    loudest_v = float(np.exp(shown[2].min()) / np.sqrt(2.0))
    doubted = replace(quiet, values=shown, loudest_v=loudest_v)
    # Heard as the belief about benches would have it, right or wrong.
    return calibrate(
        doubted, runs(x[:, None], np.array([motion(v) for v in x])), np.array([0.3]), GAIN, rng
    )


@pytest.mark.parametrize("noise_v", [USUAL_NOISE_V, 1.5e-3])
def test_intervals_cover_with_chatter_or_noise(noise_v):
    """Also where the two cannot be told apart."""
    rng = np.random.default_rng(11)
    truths = rng.uniform(0.3, 0.7, 40)
    found = [chattering(truth, noise_v, rng) for truth in truths]
    z = np.array(
        [(c.mean[0] - t) / np.sqrt(c.covariance[0, 0]) for c, t in zip(found, truths, strict=True)]
    )
    # With 95 % coverage 33 or fewer hits of 40 happen once in 500 times.
    assert np.count_nonzero(np.abs(z) < 1.96) > 33
    # Evenly over its range it would be known to 0.29.
    assert np.median([np.sqrt(c.covariance[0, 0]) for c in found]) < 0.22


def test_sigma_points_have_mean_and_covariance():
    root = np.random.default_rng(3).normal(size=(3, 3))
    found = ParameterPosterior(np.array([0.2, 0.5, -1.0]), root @ root.T)
    places = found.sigma_points(np.full(3, -np.inf), np.full(3, np.inf))
    np.testing.assert_allclose(places.mean(axis=0), found.mean)
    np.testing.assert_allclose(np.cov(places.T, bias=True), found.covariance)
    assert found.sigma_points(np.zeros(3), np.ones(3)).min() == 0.0
