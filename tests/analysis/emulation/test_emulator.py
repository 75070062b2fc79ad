import numpy as np
import pytest
from worlds.synthetic import ROWS, SCATTER, SIGMAS, candidate, observation, read

PLACE = np.array([0.55, 0.4])
EFFECT = ("load-inertia",)


def seen(seed=3, **given):
    return observation(read(EFFECT, PLACE, np.random.default_rng(seed), **given))


def test_the_emulator_is_exact_between_linear_runs():
    surface = candidate(observation(np.zeros((3, ROWS))), EFFECT, groups=40).surface
    mean, std = surface.expected(PLACE)
    truth = read(EFFECT, PLACE, np.random.default_rng(0), scatter=0.0)
    assert np.abs(mean - truth)[:2].max() < 0.02
    np.testing.assert_allclose(
        np.median(std / SCATTER, axis=1), 1.2, atol=0.3
    )  # a Gaussian seen as t


@pytest.mark.parametrize("seed", range(4))
def test_a_climb_finds_the_place(seed):
    found = candidate(seen(seed), EFFECT, seed).best
    np.testing.assert_allclose(found.place, PLACE, atol=0.06)
    z = found.residual[:2] / found.std[:2]
    assert 0.7 < np.sqrt(np.mean(z**2)) < 1.3


def test_deviations_are_found_and_bounded_by_tolerance():
    off = np.array([2.0, -2.0, 0.0, 1.0, -1.0]) * SIGMAS
    surface = candidate(seen(deviations=off, scatter=0.1), EFFECT).surface
    fit = surface.fit(PLACE)
    assert np.abs(fit.deviations[:5] - off).max() < 1.3 * SIGMAS[0]
    # A hundred tolerances off is not believed, however well it would fit.
    far = candidate(seen(deviations=100.0 * off, scatter=0.1), EFFECT).surface.fit(PLACE)
    assert far.log_likelihood < fit.log_likelihood - 50.0


def test_unrequested_rows_do_not_enter_fit():
    values = read(EFFECT, PLACE, np.random.default_rng(1))
    first = np.arange(ROWS) < ROWS // 2
    spoilt = values.copy()
    spoilt[:, ~first] += 3.0
    one = candidate(observation(values), EFFECT).surface.fit(PLACE, first)
    other = candidate(observation(spoilt), EFFECT).surface.fit(PLACE, first)
    np.testing.assert_allclose(one.deviations, other.deviations, atol=1e-12)
    assert one.log_likelihood == pytest.approx(other.log_likelihood)


def test_unobserved_readings_do_not_count():
    values = read(EFFECT, PLACE, np.random.default_rng(1))
    values[1] = np.nan
    found = candidate(observation(values), EFFECT).best
    assert np.all(np.isnan(found.residual[1]))
    assert np.all(found.density[1] == 0.0)
    np.testing.assert_allclose(found.place, PLACE, atol=0.08)


def test_one_wild_point_moves_the_place_little():
    values = read(EFFECT, PLACE, np.random.default_rng(1))
    values[0, 7] += 5.0
    np.testing.assert_allclose(candidate(observation(values), EFFECT).best.place, PLACE, atol=0.06)
