"""How well ARF, RF and damping are read, of linear responses whose truth is known."""

import math

import numpy as np
import pytest
from worlds.linear_truths import NOTED, TWO_PERCENT, Truth, pair

from analysis.resonance import extract
from daq.frf import DB_PER_NEPER, FrequencyResponse

DRAWS = 40


def readings(truth, noise, draws=DRAWS, **how):
    """Errors over their truth and stated errors, shape (draws, 5): ARF, RF, RF-ARF, dampings."""
    arf, rf = truth.extrema()
    off, std = [], []
    for seed in range(draws):
        (level,) = extract(truth.measured(seed, noise, **how))
        assert level.arf is not None, level.flags
        assert level.rf is not None, level.flags
        assert (level.arf.method, level.rf.method) == ("rational", "rational")
        off.append(
            (
                level.arf.frequency_hz - arf,
                level.rf.frequency_hz - rf,
                level.difference_hz - (rf - arf),
                level.arf.damping_ratio / truth.zeta_zero - 1,
                level.rf.damping_ratio / truth.zeta_pole - 1,
            )
        )
        std.append(
            (
                level.arf.std_hz,
                level.rf.std_hz,
                level.difference_std_hz,
                level.arf.damping_std / truth.zeta_zero,
                level.rf.damping_std / truth.zeta_pole,
            )
        )
    return np.array(off), np.array(std)


def rms(values):
    return np.sqrt(np.mean(values**2, axis=0))


def test_noted_truth_has_known_extrema():
    np.testing.assert_allclose(NOTED.extrema(), (39.966, 70.168), atol=1e-3)


@pytest.mark.parametrize(
    ("truth", "how"),
    [
        (NOTED, {}),
        pytest.param(Truth(), {}, marks=pytest.mark.long),
        pytest.param(Truth(integrator=False), {}, marks=pytest.mark.long),
        pytest.param(Truth(corner=135.0, delay_s=1e-3), {}, marks=pytest.mark.long),
        pytest.param(Truth(corner=135.0, delay_s=1e-3), {"stated": False}, marks=pytest.mark.long),
    ],
    ids=["noted", "5 %", "bare", "filtered", "filtered, noise unknown"],
)
def test_linear_truth_is_within_bounds_and_errors(truth, how):
    off, std = readings(truth, TWO_PERCENT, **how)
    error = rms(off)
    assert error[0] < 0.0125
    assert error[1] < 0.02
    assert np.all(error[3:] < 0.01)
    covered = np.mean(np.abs(off) < 1.96 * std, axis=0)
    assert np.all(covered >= 0.85), covered
    assert np.mean(covered) < 0.99
    # The mean is off by no more than chance allows: no bias behind the scatter.
    assert np.all(np.abs(off.mean(axis=0)) < 4 * error / math.sqrt(DRAWS))


@pytest.mark.long
def test_twice_the_noise_power_stays_within_bounds():
    off, std = readings(NOTED, 0.02)
    error = rms(off)
    assert error[0] < 0.01
    assert error[1] < 0.02
    assert np.all(error[3:] < 0.01)
    covered = np.mean(np.abs(off) < 1.96 * std, axis=0)
    assert np.all(covered >= 0.85), covered
    assert np.mean(covered) < 0.99


def test_gain_alone_is_read_with_wider_bars():
    off, std = readings(NOTED, TWO_PERCENT, phase=False)
    _, std_with_phase = readings(NOTED, TWO_PERCENT, draws=10)
    covered = np.mean(np.abs(off) < 1.96 * std, axis=0)
    assert np.all(covered >= 0.85), covered
    assert np.mean(covered) < 0.99
    assert np.all(rms(std) > 1.2 * rms(std_with_phase))
    assert rms(off)[0] < 0.02
    assert rms(off)[1] < 0.03


def cramer_rao(truth, noise):
    """Least standard deviation of ARF and RF for this truth with gain, slope, phase and delay free.

    Derivatives by central differences: independent of the fit's own.
    """
    f = truth.f
    names = ("zero", "zeta_zero", "pole", "zeta_pole")
    rows, by = [], []
    for name in names:
        at = getattr(truth, name)
        d = 1e-5 * at
        more, less = {name: at + d}, {name: at - d}
        rows.append((np.log(truth.response(f, **more) / truth.response(f, **less))) / (2 * d))
        by.append((truth.extrema(**more) - truth.extrema(**less)) / (2 * d))
    rows += [np.ones_like(f) + 0j, np.log(f) + 0j, 1j * np.ones_like(f), 1j * f]
    by += [np.zeros(2)] * 4
    # A slope of the surrounding moves the extrema too.
    slope = 1e-4
    tilted = []
    for sign in (-1, 1):
        grid = truth.extrema()[(sign + 1) // 2] + np.linspace(-0.5, 0.5, 20_001)
        level = [
            grid[np.argmax(sign * (np.log(np.abs(truth.response(grid))) + t * np.log(grid)))]
            for t in (-30 * slope, 30 * slope)
        ]
        tilted.append((level[1] - level[0]) / (60 * slope))
    by[5] = np.array(tilted)
    j = np.array(rows)
    fisher = np.real(j @ j.conj().T) / noise**2
    scale = np.sqrt(np.diag(fisher))
    covariance = np.linalg.inv(fisher / np.outer(scale, scale)) / np.outer(scale, scale)
    g = np.array(by).T
    return np.sqrt(np.diag(g @ covariance @ g.T))


@pytest.mark.parametrize(
    "truth",
    [
        Truth(zero=130, pole=145, zeta_zero=0.02, zeta_pole=0.02, start=100, stop=180),
        pytest.param(Truth(zero=130, pole=145, start=100, stop=180), marks=pytest.mark.long),
        pytest.param(
            Truth(130, 0.02, 145, 0.02, start=100, stop=180, step=80 / 60),
            marks=pytest.mark.long,
        ),
    ],
    ids=["130/145 Hz, 2 %", "130/145 Hz, 5 %", "130/145 Hz on 61 points"],
)
def test_errors_approach_the_cramer_rao_bound(truth):
    off, std = readings(truth, TWO_PERCENT)
    least = cramer_rao(truth, TWO_PERCENT)
    # 40 draws know a standard deviation to 11 %.
    assert np.all(rms(off)[:2] < 1.3 * least), (rms(off)[:2], least)
    assert np.all(rms(off)[:2] > 0.75 * least), (rms(off)[:2], least)
    covered = np.mean(np.abs(off) < 1.96 * std, axis=0)
    assert np.all(covered >= 0.85), covered
    assert np.mean(covered) < 0.99


def test_bars_grow_with_noise():
    widths = [rms(readings(NOTED, noise, draws=4)[1])[0] for noise in (0.005, 0.02, 0.05)]
    assert widths[1] / widths[0] == pytest.approx(4, rel=0.1)
    assert widths[2] / widths[1] == pytest.approx(2.5, rel=0.1)


def test_noise_free_response_is_exact():
    """With a distant mode."""
    truth = Truth(zeta_zero=0.03, start=10, stop=300)
    f = truth.f
    h = truth.response(f) * pair(f, 200, 0.02) / pair(f, 230, 0.02)
    (level,) = extract(FrequencyResponse.from_arrays(f, 1.0, h, unit="truth"))
    grid = np.arange(30, 80, 1e-3)
    exact = np.abs(truth.response(grid) * pair(grid, 200, 0.02) / pair(grid, 230, 0.02))
    k = int(np.argmin(exact))
    assert level.arf.frequency_hz == pytest.approx(grid[k], abs=0.01)
    assert level.rf.frequency_hz == pytest.approx(grid[k + np.argmax(exact[k:])], abs=0.02)
    assert abs(level.arf.frequency_hz - grid[k]) < 3 * level.arf.std_hz + 1e-3


def test_roll_off_does_not_hide_anti_resonance():
    """A band that falls off beyond the resonance."""
    truth = Truth(zeta_zero=0.03, corner=135.0, start=5, stop=300)
    (level,) = extract(truth.measured(1, 0.02))
    assert np.abs(truth.response(np.array([300.0]))) < np.abs(truth.response(np.array([40.0])))
    arf, rf = truth.extrema()
    assert level.arf.frequency_hz == pytest.approx(arf, abs=4 * level.arf.std_hz)
    assert level.rf.frequency_hz == pytest.approx(rf, abs=4 * level.rf.std_hz)


def test_zeros_in_the_right_half_plane():
    f = NOTED.f
    rng = np.random.default_rng(5)
    noise = 1 + 0.01 * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size))
    h = pair(f, 40, -0.03) / pair(f, 70, 0.05) * noise
    (level,) = extract(FrequencyResponse.from_arrays(f, 1.0, h, unit="truth", gain_std_db=0.087))
    bare = Truth(zeta_zero=0.03, integrator=False).extrema()
    assert level.arf.method == "rational"
    assert level.arf.frequency_hz == pytest.approx(bare[0], abs=4 * level.arf.std_hz)
    assert level.arf.damping_ratio == pytest.approx(0.03, rel=0.05)


def test_understated_errors_are_widened_and_flagged():
    truth, noise = NOTED, 0.02
    response = truth.measured(0, noise)
    stated = FrequencyResponse.from_arrays(
        response.frequency_hz, 1.0, response.gain, unit="", gain_std_db=noise * DB_PER_NEPER / 1.45
    )
    (right,), (small,) = extract(response), extract(stated)
    assert small.arf.method == "rational"
    assert small.arf.std_hz == pytest.approx(right.arf.std_hz, rel=0.15)
    assert any("times the stated errors" in flag for flag in small.flags)
