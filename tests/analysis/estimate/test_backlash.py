"""Backlash by stage from a ratio and a total that are known together."""

import numpy as np
import pytest

from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.model import Hypothesis
from analysis.estimate.backlash import backlash_of_places, backlash_of_sizes
from daq.configs import config_path
from sim.unit import load_unit

ADSS = load_unit("adss")
B_T, N = ADSS.backlash.b_t_deg, ADSS.output_ratio
WORN = ("load-inertia", "total-backlash")


def drawn(hypothesis, found, rng, count=400_000):
    """Ratio and total of machines drawn from what is known, one by one."""
    places = rng.multivariate_normal(found.mean, found.covariance, count)
    total = np.full(count, hypothesis.unit.backlash.b_t_deg)
    for at, (_, parameter) in enumerate(hypothesis.parameters, start=1):
        if parameter.name == "b_t_deg":
            low, high = hypothesis.logs[at - 1]
            total = np.exp(low + (high - low) * places[:, at])
    return places[:, 0], total


@pytest.mark.parametrize("correlation", [-0.9, 0.0, 0.9])
def test_ratio_and_total_use_their_correlation(correlation):
    hypothesis = Hypothesis(ADSS, WORN)
    std = np.array([0.05, 0.03, 0.06])
    matrix = np.eye(3)
    at = 1 + [name for name, _ in hypothesis.parameters].index("total-backlash")
    matrix[0, at] = matrix[at, 0] = correlation
    found = ParameterPosterior(np.array([0.4, 0.5, 0.5]), matrix * np.outer(std, std))
    told = backlash_of_sizes(hypothesis, found)
    ratio, total = drawn(hypothesis, found, np.random.default_rng(1))
    for number, values in (
        (told.b1_deg, ratio * total * N),
        (told.b2_deg, (1 - ratio) * total),
        (told.b_t_deg, total),
    ):
        # Of 400,000 draws the standard deviation is known to 0.2 % or so.
        assert number.value == pytest.approx(values.mean(), rel=0.01)
        assert number.std == pytest.approx(values.std(), rel=0.02)
        assert number.interval95 == pytest.approx(np.quantile(values, [0.025, 0.975]), rel=0.02)
    assert told.contribution_ratio.value == pytest.approx(0.4)
    assert told.contribution_ratio.std == pytest.approx(0.05)


def test_total_from_datasheet_has_no_interval():
    told = backlash_of_sizes(
        Hypothesis(ADSS, ("load-inertia",)),
        ParameterPosterior(np.array([0.3, 0.5]), 4e-4 * np.eye(2)),
    )
    assert (told.b_t_deg.value, told.b_t_deg.std, told.b_t_deg.interval95) == (B_T, 0.0, None)
    assert told.b1_deg.value == pytest.approx(0.3 * B_T * N)
    assert told.b2_deg.std == pytest.approx(0.02 * B_T)


@pytest.mark.parametrize("mean", [0.98, 0.02])
def test_an_interval_ends_where_a_ratio_does(mean):
    told = backlash_of_sizes(
        Hypothesis(ADSS, ()), ParameterPosterior(np.array([mean]), np.array([[0.05**2]]))
    )
    low, high = told.contribution_ratio.interval95
    assert (low if mean < 0.5 else 1.0 - high) == 0.0
    assert told.contribution_ratio.value == pytest.approx(mean)
    assert told.b1_deg.interval95 == pytest.approx((low * B_T * N, high * B_T * N))
    assert told.b2_deg.interval95 == pytest.approx(((1 - high) * B_T, (1 - low) * B_T))


def test_one_stage_drive_holds_all_backlash():
    one = load_unit(str(config_path("templates", "one-stage")))
    hypothesis = Hypothesis(one, ("total-backlash",))
    found = ParameterPosterior(np.array([1.0, 0.5]), np.diag([0.0, 0.05**2]))
    told = backlash_of_sizes(hypothesis, found)
    assert told.b1_deg == told.b_t_deg
    assert told.b1_deg.std > 0.0
    assert (told.b2_deg.value, told.b2_deg.std) == (0.0, 0.0)


def test_weighted_places_give_posterior_mean():
    ratios, total = np.array([0.2, 0.4]), np.array([0.05, 0.1])
    told = backlash_of_places(ADSS, ratios, total, np.array([0.25, 0.75]))
    assert told.b_t_deg.value == pytest.approx(0.0875)
    assert told.b2_deg.value == pytest.approx(0.25 * 0.8 * 0.05 + 0.75 * 0.6 * 0.1)
