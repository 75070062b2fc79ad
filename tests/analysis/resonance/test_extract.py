"""ARF, RF and damping of linear responses whose truth is written down as zeros and poles."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from analysis.resonance import extract, to_json
from daq.frf import DB_PER_NEPER, FrequencyResponse, PointFlag

DRAWS = 100


def pair(f, f_0, zeta):
    return 1 - (f / f_0) ** 2 + 2j * zeta * f / f_0


@dataclass(frozen=True)
class Truth:
    """A zero pair over a pole pair, and what surrounds them; all frequencies in Hz."""

    zero: float = 40.0
    zeta_zero: float = 0.05
    pole: float = 70.0
    zeta_pole: float = 0.05
    integrator: bool = True
    corner: float = math.inf
    delay_s: float = 0.0
    start: float = 20.0
    stop: float = 110.0
    step: float = 0.5

    @property
    def f(self):
        return np.arange(self.start, self.stop + 1e-9, self.step)

    def response(self, f, zero=None, zeta_zero=None, pole=None, zeta_pole=None):
        h = pair(f, zero or self.zero, zeta_zero or self.zeta_zero)
        h = h / pair(f, pole or self.pole, zeta_pole or self.zeta_pole)
        if self.integrator:
            h = h * 30.0 / (1j * f)
        if math.isfinite(self.corner):
            h = h / pair(f, self.corner, 1.0)
        return h * np.exp(-2j * np.pi * f * self.delay_s)

    def extrema(self, **changed):
        """Exact ARF and RF."""

        def level(f, sign):
            return sign * np.log(np.abs(self.response(np.array([f]), **changed)[0]))

        middle = math.sqrt(self.zero * self.pole)
        options = {"xatol": 1e-9}
        arf = minimize_scalar(
            level, bounds=(0.7 * self.zero, middle), args=(1,), method="bounded", options=options
        )
        rf = minimize_scalar(
            level, bounds=(middle, 1.3 * self.pole), args=(-1,), method="bounded", options=options
        )
        return np.array([arf.x, rf.x])

    def measured(self, seed, noise, *, stated=True, phase=True):
        """One sweep; `noise` is the standard deviation of each relative component."""
        rng = np.random.default_rng(seed)
        f = self.f
        h = self.response(f) * (
            1 + noise * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size))
        )
        return FrequencyResponse.from_arrays(
            f,
            2.5,
            h if phase else np.abs(h),
            unit="truth",
            phase_known=phase,
            gain_std_db=noise * DB_PER_NEPER if stated else None,
        )


TWO_PERCENT = 0.02 / math.sqrt(2)
"""2 % root mean square of the complex noise: this much along the gain, and across it."""

NOTED = Truth(zeta_zero=0.03)
"""ARF 39.966 Hz and RF 70.168 Hz."""


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


def test_the_noted_truth_is_the_one_meant():
    np.testing.assert_allclose(NOTED.extrema(), (39.966, 70.168), atol=1e-3)


@pytest.mark.parametrize(
    ("truth", "how"),
    [
        (NOTED, {}),
        (Truth(), {}),
        (Truth(integrator=False), {}),
        (Truth(corner=135.0, delay_s=1e-3), {}),
        (Truth(corner=135.0, delay_s=1e-3), {"stated": False}),
    ],
    ids=["noted", "5 %", "bare", "filtered", "filtered, noise unknown"],
)
def test_linear_truth_is_read_within_bounds_and_bars(truth, how):
    off, std = readings(truth, TWO_PERCENT, **how)
    error = rms(off)
    assert error[0] < 0.0125
    assert error[1] < 0.02
    assert np.all(error[3:] < 0.01)
    covered = np.mean(np.abs(off) < 1.96 * std, axis=0)
    assert np.all(covered >= 0.88), covered
    assert np.mean(covered) < 0.99
    # The mean is off by no more than chance allows: no bias behind the scatter.
    assert np.all(np.abs(off.mean(axis=0)) < 4 * error / math.sqrt(DRAWS))


def test_twice_the_noise_power_on_the_noted_truth_stays_within_bounds():
    off, std = readings(NOTED, 0.02)
    error = rms(off)
    assert error[0] < 0.01
    assert error[1] < 0.02
    assert np.all(error[3:] < 0.01)
    covered = np.mean(np.abs(off) < 1.96 * std, axis=0)
    assert np.all(covered >= 0.88), covered
    assert np.mean(covered) < 0.99


def test_gain_alone_is_read_with_wider_bars():
    off, std = readings(NOTED, TWO_PERCENT, phase=False)
    _, std_with_phase = readings(NOTED, TWO_PERCENT, draws=20)
    covered = np.mean(np.abs(off) < 1.96 * std, axis=0)
    assert np.all(covered >= 0.88), covered
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
        Truth(zero=130, pole=145, start=100, stop=180),
        Truth(
            zero=130, pole=145, zeta_zero=0.02, zeta_pole=0.02, start=100, stop=180, step=80 / 60
        ),
    ],
    ids=["130/145 Hz, 2 %", "130/145 Hz, 5 %", "130/145 Hz on 61 points"],
)
def test_no_unbiased_reader_could_do_much_better(truth):
    off, std = readings(truth, TWO_PERCENT)
    least = cramer_rao(truth, TWO_PERCENT)
    # 100 draws know a standard deviation to 7 %.
    assert np.all(rms(off)[:2] < 1.25 * least), (rms(off)[:2], least)
    assert np.all(rms(off)[:2] > 0.8 * least), (rms(off)[:2], least)
    covered = np.mean(np.abs(off) < 1.96 * std, axis=0)
    assert np.all(covered >= 0.88), covered
    assert np.mean(covered) < 0.99


def test_bars_grow_with_noise():
    widths = [rms(readings(NOTED, noise, draws=20)[1])[0] for noise in (0.005, 0.02, 0.05)]
    assert widths[1] / widths[0] == pytest.approx(4, rel=0.1)
    assert widths[2] / widths[1] == pytest.approx(2.5, rel=0.1)


def test_noise_free_response_with_a_distant_mode_is_exact():
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


def test_a_band_that_falls_off_beyond_rf_does_not_hide_the_anti_resonance():
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


def test_errors_stated_too_small_widen_the_bars_and_say_so():
    truth, noise = NOTED, 0.02
    response = truth.measured(0, noise)
    stated = FrequencyResponse.from_arrays(
        response.frequency_hz, 1.0, response.gain, unit="", gain_std_db=noise * DB_PER_NEPER / 1.45
    )
    (right,), (small,) = extract(response), extract(stated)
    assert small.arf.method == "rational"
    assert small.arf.std_hz == pytest.approx(right.arf.std_hz, rel=0.15)
    assert any("times the stated errors" in flag for flag in small.flags)


@pytest.mark.parametrize(
    ("band", "missing", "why"),
    [
        ((42.0, 110.0), "arf", "lower edge"),
        ((20.0, 68.0), "rf", "upper edge"),
        ((75.0, 110.0), "both", "edge"),
        ((20.0, 39.0), "both", "edge"),
    ],
    ids=["ARF below", "RF above", "falling only", "falling to ARF"],
)
def test_features_outside_the_band_are_null_with_a_reason(band, missing, why):
    truth = Truth(zeta_zero=0.03, start=band[0], stop=band[1])
    for seed in range(10):
        (level,) = extract(truth.measured(seed, 0.02))
        assert (level.arf is None) == (missing in ("arf", "both"))
        assert (level.rf is None) == (missing in ("rf", "both"))
        assert level.difference_hz is None
        assert level.difference_std_hz is None
        for name in ("arf", "rf"):
            if getattr(level, name) is None:
                assert any(flag.startswith(f"{name}: ") and why in flag for flag in level.flags)


def test_what_is_left_in_the_band_is_still_read():
    truth = Truth(zeta_zero=0.03, start=42)
    off = []
    for seed in range(50):
        (level,) = extract(truth.measured(seed, 0.02))
        off.append((level.rf.frequency_hz - truth.extrema()[1]) / level.rf.std_hz)
    assert np.sqrt(np.mean(np.square(off))) < 1.4


@pytest.mark.parametrize("points", [31, 61, 181])
@pytest.mark.parametrize("stated", [True, False])
def test_nothing_is_found_in_noise(points, stated):
    found = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        f = np.linspace(20, 110, points)
        h = 1 + 0.1 * (rng.normal(size=points) + 1j * rng.normal(size=points))
        std = 0.1 * DB_PER_NEPER if stated else None
        (level,) = extract(FrequencyResponse.from_arrays(f, 1.0, h, unit="", gain_std_db=std))
        found += level.arf is not None or level.rf is not None
        assert level.flags
    # Chance finds one in 2 % at most; 60 draws with more than 5 have a chance below 1e-3.
    assert found <= 5


def test_a_feature_buried_in_scatter_is_null_with_a_reason():
    truth = Truth(zeta_zero=0.4, zeta_pole=0.4, step=2.0, integrator=False)
    (level,) = extract(truth.measured(4, 1.2))
    assert level.arf is None
    assert level.rf is None
    assert any("scatter" in flag or "edge" in flag for flag in level.flags)


def test_levels_come_ascending_and_each_on_its_own():
    one, two = NOTED.measured(0, 0.01), Truth(zero=50, pole=80).measured(1, 0.01)
    f = np.concatenate([two.frequency_hz, one.frequency_hz[::-1]])
    levels = np.concatenate([np.full(len(two), 4.0), np.full(len(one), 1.5)])
    both = FrequencyResponse.from_arrays(
        f, levels, np.concatenate([two.gain, one.gain[::-1]]), unit="", gain_std_db=0.087
    )
    low, high = extract(both)
    assert (low.source_vpk, high.source_vpk) == (1.5, 4.0)
    assert low.arf.frequency_hz == pytest.approx(39.97, abs=0.1)
    assert high.arf.frequency_hz == pytest.approx(50, abs=0.3)


def test_spoilt_rows_do_not_count():
    response = NOTED.measured(0, 0.01)
    gain, flags = response.gain.copy(), np.zeros(len(response), dtype=int)
    gain[40] = 1e-6
    flags[40] = int(PointFlag.SPOILT)
    spoilt = FrequencyResponse.from_arrays(
        response.frequency_hz, 2.5, gain, unit="", gain_std_db=response.gain_std_db, flags=flags
    )
    (level,), (clean,) = extract(spoilt), extract(response)
    assert level.arf.frequency_hz == pytest.approx(clean.arf.frequency_hz, abs=0.01)


def test_repeats_say_what_the_noise_is():
    truth, noise = NOTED, 0.02
    f = np.repeat(truth.f, 4)
    rng = np.random.default_rng(8)
    h = truth.response(f) * (1 + noise * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size)))
    (level,) = extract(FrequencyResponse.from_arrays(f, 1.0, h, unit=""))
    (single,) = extract(truth.measured(0, noise))
    assert level.arf.std_hz == pytest.approx(single.arf.std_hz / 2, rel=0.2)
    assert level.arf.frequency_hz == pytest.approx(truth.extrema()[0], abs=4 * level.arf.std_hz)


def test_a_level_without_usable_rows_says_so():
    response = FrequencyResponse.from_arrays([1.0, 2.0], 1.0, [np.nan, 0.0], unit="")
    (level,) = extract(response)
    assert level.arf is None
    assert any(flag.startswith("level: ") for flag in level.flags)
    assert extract(FrequencyResponse.from_arrays([], [], [], unit="")) == ()


def test_rows_that_name_no_level_are_one_level():
    response = NOTED.measured(0, 0.01)
    nameless = FrequencyResponse.from_arrays(response.frequency_hz, np.nan, response.gain, unit="")
    (level,) = extract(nameless)
    assert math.isnan(level.source_vpk)
    assert to_json((level,))["levels"][0]["source_vpk"] is None


def test_json_has_the_promised_fields():
    document = to_json(extract(NOTED.measured(0, 0.02)))
    (level,) = document["levels"]
    assert set(level) >= {"source_vpk", "arf", "rf", "difference_hz", "damping_ratio", "flags"}
    assert level["source_vpk"] == 2.5
    for name in ("arf", "rf"):
        assert set(level[name]) >= {"frequency_hz", "std_hz", "gain_db"}
        assert set(level["damping_ratio"][name]) == {"value", "std"}
    assert set(level["difference_hz"]) == {"value", "std"}
    assert level["difference_hz"]["value"] == pytest.approx(
        level["rf"]["frequency_hz"] - level["arf"]["frequency_hz"]
    )


@pytest.mark.parametrize("seed", range(10))
def test_a_minimum_that_noise_makes_hides_no_resonance(seed):
    """A resonance and then the noise floor, in which a pair of zeros often fits."""
    rng = np.random.default_rng(seed)
    f = np.geomspace(20.0, 400.0, 60)
    h = 1 / pair(f, 60.0, 0.05) / (1 + 1j * f / 150.0) ** 2
    share, floor = rng.normal(size=(2, 2, f.size))
    h = h * (1 + 0.01 * (share[0] + 1j * share[1])) + 0.01 * (floor[0] + 1j * floor[1])
    std_db = np.hypot(0.01, 0.01 / np.abs(h)) * DB_PER_NEPER
    (level,) = extract(FrequencyResponse.from_arrays(f, 2.0, h, unit="X", gain_std_db=std_db))
    assert level.rf is not None, level.flags
    assert level.rf.frequency_hz == pytest.approx(60.0, rel=0.02)
    for pairs in level.pairs:
        if pairs.arf is not None and level.arf is None:
            assert any(flag.startswith("arf: noise may have made") for flag in level.flags)


@pytest.mark.parametrize("zeta", [0.0005, 0.002])
def test_a_sharp_anti_resonance_whose_depth_is_not_known_is_still_one(zeta):
    """On a coarse grid nothing tells how deep it is; where it is stays known."""
    for seed in range(5):
        truth = Truth(zeta_zero=zeta, step=3.0)
        f, rng = truth.f, np.random.default_rng(seed)
        noise = rng.normal(size=(2, f.size))
        h = truth.response(f)
        size = 0.02 * np.abs(h).max()
        h = h + size * (noise[0] + 1j * noise[1])
        std_db = size / np.abs(h) * DB_PER_NEPER
        (level,) = extract(FrequencyResponse.from_arrays(f, 2.0, h, unit="X", gain_std_db=std_db))
        assert level.arf is not None, level.flags
        assert level.arf.frequency_hz == pytest.approx(40.0, rel=0.05)
        assert level.rf is not None
