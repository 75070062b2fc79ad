"""The regression against the exact posterior of a linear model with Gaussian errors."""

import numpy as np
import pytest

from analysis.commissioning.regression import Gaussian, Round, expected_std, regress

D, ROWS, FAMILIES, LANES = 4, 60, 150, 5
PRIOR = Gaussian(np.zeros(D), np.eye(D))


def world(seed):
    """Slopes (D, ROWS), of which the last coordinate has none, and errors of the rows."""
    rng = np.random.default_rng(seed)
    slopes = rng.standard_normal((D, ROWS))
    slopes[-1] = 0.0
    return rng, slopes, rng.uniform(0.5, 2.0, ROWS)


def drawn_from(proposal, slopes, std, rng):
    z = proposal.draw(rng, FAMILIES * LANES)
    y = z @ slopes + std * rng.standard_normal((len(z), ROWS))
    return Round(z, np.repeat(np.arange(FAMILIES), LANES), y)


def exact(slopes, std, y):
    precision = (slopes / std**2) @ slopes.T + np.eye(D)
    covariance = np.linalg.inv(precision)
    return covariance @ ((slopes / std**2) @ y), covariance


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("width", [1.0, 0.3])
def test_posterior_is_that_of_linear_model(seed, width):
    """Whether drives are drawn from the prior or close about the answer."""
    rng, slopes, std = world(seed)
    truth = rng.standard_normal(D)
    y = truth @ slopes + std * rng.standard_normal(ROWS)
    mean, covariance = exact(slopes, std, y)
    proposal = PRIOR if width == 1.0 else Gaussian(mean, width**2 * np.eye(D))
    found = regress(drawn_from(proposal, slopes, std, rng), y, proposal, PRIOR)
    wide = np.sqrt(np.diag(covariance))
    # The coordinate without effect keeps its prior, but for chance.
    np.testing.assert_allclose(found.posterior.std[:-1], wide[:-1], rtol=0.25)
    assert found.posterior.std[-1] == pytest.approx(1.0, abs=0.1)
    assert np.all(np.abs(found.posterior.mean - mean)[:-1] < 0.6 * wide[:-1])
    assert abs(found.posterior.mean[-1]) < 0.35


@pytest.mark.parametrize("turns", [-1, 0, 3])
def test_whole_turns_of_phase_change_nothing(turns):
    """A phase near 180 degrees comes as +179 of one drive and -179 of the next."""
    rng, slopes, std = world(5)
    plain = drawn_from(PRIOR, 0.1 * slopes, 0.1 * std, rng)
    y = 0.1 * (rng.standard_normal(D) @ slopes + std * rng.standard_normal(ROWS))
    angles = np.arange(ROWS) % 3 == 0
    offset = np.where(angles, np.pi, 0.0)

    def wrapped(values):
        turned = np.angle(np.exp(1j * (values + offset))) + 2.0 * np.pi * turns
        return np.where(angles, turned, values)

    drawn = Round(plain.z, plain.families, wrapped(plain.y), angles)
    assert np.ptp(drawn.y[:, angles], axis=0).min() > 6.0
    same, found = (regress(one, at, PRIOR, PRIOR)
                   for one, at in ((plain, y), (drawn, wrapped(y))))  # fmt: skip
    np.testing.assert_allclose(found.posterior.mean, same.posterior.mean, atol=1e-6)
    assert found.misfit == pytest.approx(same.misfit)
    everything = np.ones(ROWS, dtype=bool)
    assert expected_std(drawn, PRIOR, everything, plain.z[:, 0]) == pytest.approx(
        expected_std(plain, PRIOR, everything, plain.z[:, 0])
    )


def test_intervals_hold_the_truth():
    """95 % intervals of 60 worlds with three coordinates: 171 of 180, by chance 162 or more."""
    held = 0
    for seed in range(60):
        rng, slopes, std = world(seed)
        truth = rng.standard_normal(D)
        y = truth @ slopes + std * rng.standard_normal(ROWS)
        found = regress(drawn_from(PRIOR, slopes, std, rng), y, PRIOR, PRIOR).posterior
        held += int(np.sum(np.abs(found.mean - truth)[:-1] < 1.96 * found.std[:-1]))
    assert held >= 162


def test_unexplained_pattern_is_a_misfit():
    rng, slopes, std = world(1)
    drawn = drawn_from(PRIOR, slopes, std, rng)
    plain = rng.standard_normal(D) @ slopes + std * rng.standard_normal(ROWS)
    strange = plain + 4.0 * std * np.sin(np.linspace(0.0, 9.0, ROWS))
    assert regress(drawn, plain, PRIOR, PRIOR).misfit < 1.3
    found = regress(drawn, strange, PRIOR, PRIOR)
    assert found.misfit > 1.8
    assert found.misfit_rank == 1.0


def test_missing_reading_has_no_influence():
    rng, slopes, std = world(2)
    drawn = drawn_from(PRIOR, slopes, std, rng)
    y = rng.standard_normal(D) @ slopes
    y[::2] = np.nan
    half = Round(drawn.z, drawn.families, drawn.y[:, 1::2])
    found, same = regress(drawn, y, PRIOR, PRIOR), regress(half, y[1::2], PRIOR, PRIOR)
    np.testing.assert_allclose(found.posterior.mean, same.posterior.mean)


def test_next_proposal_is_wider_than_posterior():
    last = Gaussian(np.zeros(2), np.diag([1.0, 4.0]))
    found = Gaussian(np.ones(2), np.diag([1e-6, 1.0])).proposal(last)
    np.testing.assert_allclose(found.mean, 1.0)
    np.testing.assert_allclose(found.std, [0.35, 1.5])


def test_more_rows_narrow_the_posterior():
    rng, slopes, std = world(3)
    drawn = drawn_from(PRIOR, slopes, std, rng)
    errors = [
        expected_std(drawn, PRIOR, np.arange(ROWS) < rows, drawn.z[:, 0]) for rows in (5, 20, 60)
    ]
    assert errors[0] > errors[1] > errors[2]
    precision = (slopes / std**2) @ slopes.T + np.eye(D)
    assert errors[2] == pytest.approx(np.sqrt(np.linalg.inv(precision)[0, 0]), rel=0.25)
