"""The meaning of the normalised variance, held against draws of a known scatter."""

import math

import numpy as np
import pytest

from daq.driving.variance import gain_standard_error, normalised_variance


def test_variance_is_single_cycle_relative_to_mean():
    cycles = np.array([2.0 + 0j, 2.0 + 2j, 2.0 - 2j, 2.0])
    assert normalised_variance(cycles) == pytest.approx((4 + 4) / 3 / 4)
    assert normalised_variance(5j * cycles) == pytest.approx(normalised_variance(cycles))


def test_one_cycle_or_zero_mean_gives_zero():
    assert normalised_variance(np.array([1.0 + 0j])) == 0.0
    assert normalised_variance(np.array([1.0 + 0j, -1.0])) == 0.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_standard_error_covers_scatter_of_gains(seed):
    generator = np.random.default_rng(seed)
    n, runs, sigma_1, sigma_2, gain = 30, 2000, 0.02, 0.15, 0.4 * np.exp(1j)

    def cycles(mean, sigma):
        parts = generator.normal(0.0, sigma / math.sqrt(2.0), (2, runs, n))
        return mean + abs(mean) * (parts[0] + 1j * parts[1])

    source, output = cycles(2.5, sigma_1), cycles(2.5 * gain, sigma_2)
    measured = output.mean(axis=1) / source.mean(axis=1)
    relative = measured / gain
    errors = np.array(
        [
            gain_standard_error(normalised_variance(one), normalised_variance(two), n)
            for one, two in zip(source, output, strict=True)
        ]
    )
    scatter_db = np.std(20.0 * np.log10(np.abs(relative)))
    scatter_deg = np.std(np.degrees(np.angle(relative)))
    # 2000 runs settle a standard deviation to 1.6 %.
    assert np.sqrt(np.mean(errors[:, 0] ** 2)) == pytest.approx(scatter_db, rel=0.06)
    assert np.sqrt(np.mean(errors[:, 1] ** 2)) == pytest.approx(scatter_deg, rel=0.06)


@pytest.mark.parametrize(
    ("one", "two", "cycles"),
    [(None, 0.1, 30), (0.1, None, 30), (-0.1, 0.2, 30), (0.0, 0.0, 30), (0.1, 0.1, 1)],
)
def test_unknown_standard_error_is_none(one, two, cycles):
    assert gain_standard_error(one, two, cycles) is None


def test_zero_source_variance_still_gives_error():
    gain_std_db, phase_std_deg = gain_standard_error(0.0, 0.06, 30)
    assert gain_std_db == pytest.approx(8.685889638 * math.sqrt(0.06 / 60))
    assert phase_std_deg == pytest.approx(math.degrees(math.sqrt(0.06 / 60)))
