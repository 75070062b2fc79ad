"""The likelihood: its density, its log-variance term, its priors, its branches."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student

from analysis.emulation.likelihood import match_prediction
from analysis.emulation.quadratic import TAIL_FREEDOM, Prediction
from analysis.observation.observation import observe
from daq.frf import GAIN_STD_IS, FrequencyResponse, error_words

ROWS = 40
WORDS = error_words(30, 2)


def observation(gain=None, **fields):
    f = np.linspace(100.0, 140.0, ROWS)
    gain = np.full(ROWS, 0.1) if gain is None else gain
    scatter = {"gain_std_db": np.linspace(0.2, 0.21, ROWS), "provenance": {GAIN_STD_IS: WORDS}}
    seen = observe(FrequencyResponse.from_arrays(f, 2.5, gain, unit="ADSS", **scatter, **fields))
    return replace(seen, noise=np.zeros(ROWS))


FAR = np.zeros((1, 3, ROWS))
FAR[:, 0] = 1e6
"""A run that nobody would take for what was observed."""

COMMON = np.log(0.5) + (ROWS - 1) * np.log(0.95 + 0.5 * 0.05)
"""What it costs to follow the common run all the way: half at first, then to stay or come back."""


def prediction(seen, std=0.05, shift=0.0, runs=FAR):
    mean = np.where(np.isfinite(seen.values), seen.values, 0.0)
    mean[0] += shift
    slopes = np.zeros((1, 3, ROWS))
    slopes[0, 0] = 1.0
    return Prediction(
        mean=mean,
        std=np.full((3, ROWS), std),
        slopes=slopes,
        sigmas=np.array([1e-9]),
        runs=runs,
        shares=np.full(len(runs), 1.0 / len(runs)),
    )


def test_likelihood_is_student_t_per_point():
    seen = observation()
    got = match_prediction(seen, prediction(seen, std=0.05, shift=0.12))
    exact = student(TAIL_FREEDOM)
    centre = 2 * ROWS * (exact.logpdf(0.0) - np.log(0.05))
    off = ROWS * (exact.logpdf(0.12 / 0.05) - np.log(0.05))
    constant = 3 * ROWS * exact.logpdf(0.0)
    expected = centre + off - constant + COMMON
    assert got.log_likelihood == pytest.approx(expected, abs=1e-6)


def test_wide_prediction_lowers_the_likelihood():
    seen = observation()
    tight = match_prediction(seen, prediction(seen, std=0.02))
    wide = match_prediction(seen, prediction(seen, std=2.0))
    assert tight.log_likelihood - wide.log_likelihood == pytest.approx(3 * ROWS * np.log(100.0))


def test_a_deviation_is_fitted_within_its_prior():
    seen = observation()
    free = replace(prediction(seen, std=0.01, shift=-0.03), sigmas=np.array([1.0]))
    held = replace(free, sigmas=np.array([1e-5]))
    assert match_prediction(seen, free).deviations[0] == pytest.approx(0.03, rel=1e-3)
    assert abs(match_prediction(seen, held).deviations[0]) < 1e-5


def test_unmeasured_readings_do_not_count():
    without_phase = observation(phase_known=False)
    got = match_prediction(without_phase, prediction(without_phase, std=0.05))
    assert got.log_likelihood == pytest.approx(-2 * ROWS * np.log(0.05) + COMMON)
    assert np.all(np.isnan(got.residual[1]))


def test_phases_meet_across_180_degrees():
    seen = observation(gain=np.full(ROWS, -0.1 + 1e-6j))
    other = prediction(seen)
    other.mean[1] -= 2.0 * np.pi - 0.01
    assert np.abs(match_prediction(seen, other).residual[1] + 0.01).max() < 1e-9


def test_rare_branch_explains_part_of_response():
    quiet = observation(gain=np.where(np.arange(ROWS) < ROWS // 2, 0.1, 0.02))
    rare = np.zeros((10, 3, ROWS))
    common = prediction(quiet, std=0.05)
    common.mean[0] = np.log(0.1)
    known = np.zeros((10, 3, ROWS))
    known[0, 0, ROWS // 2 :] = np.log(0.2)
    without = match_prediction(quiet, replace(common, runs=rare, shares=np.full(10, 0.1)))
    with_branch = match_prediction(quiet, replace(common, runs=known, shares=np.full(10, 0.1)))
    # Twenty points at 32 sigma cost the t distribution about 14 each; one change costs a few.
    assert with_branch.log_likelihood - without.log_likelihood > 100.0
