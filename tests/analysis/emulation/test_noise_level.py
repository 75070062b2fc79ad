"""The reading's own noise, where the quietest points show it and where they do not."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.emulation.noise_level import draw_noises, likeliest_noise, possible_noises
from analysis.observation.observation import channels_of_readings, unread
from analysis.observation.reading_noise import USUAL_NOISE_V
from daq.plan import SweepPlan

ROWS = 40
PLAN = SweepPlan(tuple(np.linspace(100.0, 180.0, ROWS)), (1.0,))


def seen(noise_v):
    return unread(PLAN, noise_v)


def test_usual_noise_leaves_one_candidate():
    for noise in (1e-5, USUAL_NOISE_V, 1.2 * USUAL_NOISE_V):
        observation = seen(noise)
        assert possible_noises(observation) == [observation]
        assert likeliest_noise([observation], lambda _: pytest.fail("asked")) is observation


def test_candidate_noises_span_usual_to_quietest_points():
    noises = [one.noise_v for one in possible_noises(seen(2e-3))]
    assert noises[0] == pytest.approx(USUAL_NOISE_V)
    assert noises[-1] == pytest.approx(2e-3)
    assert noises == sorted(noises)


def test_noise_is_relative_to_response():
    observation = seen(2e-3)
    louder = observation.with_noise(4e-3)
    np.testing.assert_allclose(louder.noise, 2.0 * observation.noise)
    assert louder.noise_v == 4e-3


def scatter_likelihood(chatter_v, read):
    """Log-likelihood of scatters (rows,) read where the motion itself scatters by so much."""

    def likelihood(observation):
        variance = np.full((1, ROWS), 2.0 * chatter_v**2)
        mean = np.ones((1, ROWS), dtype=complex)
        expected = channels_of_readings(mean, variance, observation.noise, observation.floor)[0, 2]
        return float(-0.5 * np.sum(((read - expected) / 0.1) ** 2))

    return likelihood


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("chatter_v", "noise_v"), [(2e-3, 5e-4), (2e-4, 2e-3)])
def test_simulations_separate_noise_from_chatter(chatter_v, noise_v, seed):
    # Both benches read about 2 mV everywhere: one is noisy, the other's motion chatters.
    rng = np.random.default_rng(seed)
    read = np.log(np.sqrt(2.0) * np.hypot(chatter_v, noise_v)) + 0.1 * rng.standard_normal(ROWS)
    shown = replace(seen(1.0), noise_v=2e-3, noise=np.full(ROWS, 2e-3), loudest_v=2e-3)
    heard = likeliest_noise(possible_noises(shown), scatter_likelihood(chatter_v, read))
    assert heard.noise_v == pytest.approx(noise_v, rel=0.35)


def test_noise_below_chatter_is_taken_as_usual():
    shown = replace(seen(1.0), noise_v=5e-3, noise=np.full(ROWS, 5e-3), loudest_v=5e-3)
    heard = likeliest_noise(possible_noises(shown), lambda _: 0.0)
    assert heard.noise_v == pytest.approx(USUAL_NOISE_V)


def test_quiet_points_fix_noise_of_runs():
    rng = np.random.default_rng(1)
    np.testing.assert_array_equal(draw_noises(seen(4e-4), 7, rng), np.full(7, 4e-4))
    # Answers for quiet benches do not depend on what is done about others.
    assert rng.random() == np.random.default_rng(1).random()


@pytest.mark.parametrize("seed", range(5))
def test_uncertain_noise_is_drawn_over_its_range(seed):
    heard = seen(8.0 * USUAL_NOISE_V).with_noise(1.1 * USUAL_NOISE_V)
    heard = heard.at_rows(np.arange(0, len(heard), 2))
    noises = draw_noises(heard, 48, np.random.default_rng(seed))
    shares = np.sort(np.log(noises / USUAL_NOISE_V) / np.log(8.0))
    # One in each of as many equal parts.
    np.testing.assert_array_equal(np.floor(48 * shares), np.arange(48))
    assert not np.array_equal(noises, np.sort(noises))
