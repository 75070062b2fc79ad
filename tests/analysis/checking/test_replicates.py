"""Runs of a hypothesis in place of the observation, with what a bench adds to them."""

from dataclasses import replace

import numpy as np
import pytest
from worlds.synthetic import ROWS, candidate, observation, read

from analysis.checking.replicates import replicates_of
from analysis.observation.reading_noise import estimate_noise, scatter_sampling

NOISE_V = 0.02


def replicated(variance, seed):
    """Scatter (runs, rows) that replicates of a plain model show, as a share of its noise."""
    seen = observation(read((), np.array([0.5]), np.random.default_rng(seed)))
    volts = seen.source_vpk * np.exp(seen.values[0])
    seen = replace(seen, noise_v=NOISE_V, noise=NOISE_V / volts, loudest_v=NOISE_V)
    one = candidate(seen, (), seed)
    quiet = np.full((len(one.population), ROWS), variance) * seen.noise**2
    read_off = 0.5 * np.log(quiet + 2.0 * seen.noise**2) - seen.values[2]
    difference = one.surface.difference.copy()
    difference[:, 2] = read_off
    one = replace(
        one,
        population=replace(one.population, variance=quiet),
        surface=replace(one.surface, difference=difference),
    )
    rng = np.random.default_rng(seed)
    shown = [run.as_read[2] + seen.values[2] for run in replicates_of(one, rng)]
    return np.exp(shown) / (np.sqrt(2.0) * seen.noise)


@pytest.mark.parametrize("seed", range(4))
def test_scattering_stated_errors_show_in_replicates(seed):
    """Each standard error of 30 cycles is off by 13 % (1 / root of 58)."""
    scatter = np.log(replicated(0.0, seed))
    assert scatter.std(axis=1).mean() == pytest.approx(0.131, rel=0.1)


@pytest.mark.parametrize("seed", range(4))
def test_replicates_show_observed_noise_when_quiet(seed):
    sampling = scatter_sampling(30)
    shown = [estimate_noise(np.sqrt(2.0) * one, sampling) for one in replicated(0.0, seed)]
    assert np.median(shown) == pytest.approx(1.0, abs=0.05)
    assert np.median(replicated(0.0, seed)) == pytest.approx(1.0, abs=0.05)


def test_scattering_motion_is_not_altered():
    np.testing.assert_allclose(replicated(1e6, 1), np.sqrt(5e5), rtol=1e-4)
