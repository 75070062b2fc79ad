"""Equations (22) to (24) against the paper's numbers, and half-power points against theory."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.resonance.half_power import (
    HalfPower,
    frequency_reduction,
    measure_half_power,
    resonance_damping,
)
from daq.errors import AnalysisError


@pytest.mark.parametrize(
    ("zeta", "published_percent", "half_a_digit"),
    [(0.075, 0.56, 0.005), (0.083, 0.69, 0.005), (0.135, 1.8, 0.05), (0.246, 6.2, 0.05)],
    ids=["ADSS ARF", "ADSS RF", "EDSS ARF", "EDSS RF"],
)
def test_frequency_reduction_is_the_published_one(zeta, published_percent, half_a_digit):
    assert 100 * frequency_reduction(zeta) == pytest.approx(published_percent, abs=half_a_digit)


def test_frequency_reduction_matches_second_order_peak():
    f = np.linspace(0.3, 1.1, 400_001)
    for zeta in (0.05, 0.2, 0.5):
        gain = 1 / np.abs(1 - f**2 + 2j * zeta * f)
        assert 1 - f[np.argmax(gain)] == pytest.approx(frequency_reduction(zeta), abs=1e-5)


@pytest.mark.parametrize("zeta", [-0.01, 0.708, 1.0, np.nan, np.inf])
def test_frequency_reduction_refuses_overdamped_system(zeta):
    with pytest.raises(AnalysisError, match=r"0 to 0\.707"):
        frequency_reduction(zeta)


def test_frequency_reduction_at_its_limits():
    assert frequency_reduction(0.0) == 0.0
    assert frequency_reduction(np.sqrt(0.5)) == pytest.approx(1.0, abs=1e-7)


def test_resonance_damping_scales_with_frequency():
    # ADSS: 0.075 at 128 Hz; the printed 0.083 came from unrounded values.
    assert resonance_damping(0.075, 128.0, 137.0) == pytest.approx(0.0803, abs=5e-5)
    # EDSS: 0.135 at 40 Hz and RF at 75 Hz.
    assert resonance_damping(0.135, 40.0, 75.0) == pytest.approx(0.253, abs=5e-4)


@pytest.mark.parametrize(
    "arguments", [(0.1, 0.0, 5.0), (0.1, 5.0, -1.0), (-0.1, 5.0, 6.0), (np.nan, 5.0, 6.0)]
)
def test_resonance_damping_refuses_invalid_arguments(arguments):
    with pytest.raises(AnalysisError):
        resonance_damping(*arguments)


def test_half_power_damping_is_equation_22():
    assert HalfPower(128.0, 118.4, 137.6, 0.0, 0.0).damping_ratio == pytest.approx(0.075)
    assert np.isnan(HalfPower(128.0, np.nan, 137.6, np.nan, 0.0).damping_ratio)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("zeta", [0.01, 0.03])
def test_half_power_points_of_lightly_damped_pair(sign, zeta):
    # Velocity-like response f/(1 - f^2 + 2 i zeta f): its half-power width is exactly 2 zeta.
    f = np.linspace(0.8, 1.25, 45_001)
    gain_db = -sign * 20 * np.log10(np.abs((1 - f**2) / f + 2j * zeta))
    k = int(np.argmax(sign * gain_db))
    found = measure_half_power(f, gain_db, k, sign)
    assert found.damping_ratio == pytest.approx(zeta, rel=1e-3)
    assert found.low_hz * found.high_hz == pytest.approx(1.0, abs=1e-4)
    assert found.damping_std == 0.0


def test_half_power_points_missing_on_one_side():
    f = np.linspace(1.0, 2.0, 11)
    found = measure_half_power(f, -20.0 * np.abs(f - 1.1), 1, 1)
    assert np.isnan(found.low_hz)
    assert found.high_hz == pytest.approx(1.1 + 3.0103 / 20.0)
    assert np.isnan(found.damping_ratio)


def test_half_power_error_equals_observed_scatter():
    rng = np.random.default_rng(3)
    f = np.linspace(0.8, 1.2, 21)
    clean = -20 * np.log10(np.abs((1 - f**2) / f + 0.1j))
    std = np.full_like(f, 0.1)
    k = int(np.argmax(clean))
    found = [measure_half_power(f, clean + 0.1 * rng.normal(size=f.size), k, 1) for _ in range(400)]
    scatter = np.std([one.damping_ratio for one in found])
    stated = measure_half_power(f, clean, k, 1, std).damping_std
    # The error at the top moves both points apart together, so the stated one is a bound
    # within a factor of 1.5.
    assert 0.67 < stated / scatter < 1.5


@given(
    st.lists(st.floats(-200, 200), min_size=3, max_size=30),
    st.sampled_from([1, -1]),
    st.data(),
)
def test_half_power_points_enclose_the_extremum(gains, sign, data):
    f = np.arange(1.0, len(gains) + 1.0)
    k = data.draw(st.integers(0, len(gains) - 1))
    found = measure_half_power(f, np.array(gains), k, sign)
    assert np.isnan(found.low_hz) or f[0] <= found.low_hz <= f[k]
    assert np.isnan(found.high_hz) or f[k] <= found.high_hz <= f[-1]
