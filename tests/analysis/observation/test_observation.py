"""Channels of comparison: what is kept of a response, and what a simulation is made to show."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.observation.observation import (
    LEAST_NOISE,
    channels_of_readings,
    observe,
    readings_of_cycles,
)
from daq.errors import AnalysisError, InputError
from daq.frf import DB_PER_NEPER, GAIN_STD_COMPONENTS, FrequencyResponse, PointFlag


def response(levels=(1.5, 2.5), frequencies=(100.0, 110.0, 120.0), **changes):
    f = np.tile(frequencies, len(levels))
    v = np.repeat(levels, len(frequencies))
    fields = {
        "gain": 0.1 * np.exp(1j * np.linspace(-1.0, 1.0, len(f))),
        "unit": "ADSS",
        "gain_std_db": np.linspace(0.1, 1.0, len(f)),
        "settle_cycles": 7,
        "integrate_cycles": 9,
        "direction": "down",
        "provenance": {"gain_std_components": 2},
    }
    return FrequencyResponse.from_arrays(f, v, **{**fields, **changes})


def test_channels_are_log_gain_phase_log_scatter():
    one = response()
    seen = observe(one)
    np.testing.assert_allclose(seen.values[0], np.log(0.1))
    np.testing.assert_allclose(seen.values[1], np.angle(one.gain))
    np.testing.assert_allclose(np.exp(seen.values[2]) * DB_PER_NEPER, one.gain_std_db)


def test_gain_only_error_is_half_the_scatter():
    both, along = response(), response(provenance={"gain_std_components": 1})
    np.testing.assert_allclose(
        observe(along).values[2] - observe(both).values[2], 0.5 * np.log(2.0)
    )


@pytest.mark.parametrize("components", [(1, 1), (1, 2), (2, 2)])
def test_scatter_is_of_what_all_sweeps_state(components):
    """Along the gain only where every sweep states it so."""
    sweeps = [
        response(levels=(level,), provenance={GAIN_STD_COMPONENTS: count})
        for level, count in zip((1.5, 2.5), components, strict=True)
    ]
    assert observe(*sweeps).components == max(components)


def test_rows_are_sorted_by_level_and_frequency():
    one = response()
    order = np.array([4, 1, 5, 0, 3, 2])
    shuffled, plain = observe(one.take(order)), observe(one)
    np.testing.assert_array_equal(shuffled.frequency_hz, plain.frequency_hz)
    np.testing.assert_array_equal(shuffled.values, plain.values)
    assert [(b.start, b.stop) for b in plain.blocks] == [(0, 3), (3, 6)]


def test_levels_on_one_grid_share_plan():
    """The plan has the procedure of the sweep."""
    ((plan, rows),) = observe(response()).plans
    assert plan.levels_vpk == (1.5, 2.5)
    assert (plan.settle_cycles, plan.integrate_cycles, plan.direction) == (7, 9, "down")
    np.testing.assert_array_equal(rows, np.arange(6))


def test_levels_on_different_grids_are_simulated_apart():
    parts = observe(response().take(np.array([0, 1, 2, 3, 5]))).plans
    assert [(p.levels_vpk, len(p.frequencies_hz), list(r)) for p, r in parts] == [
        ((1.5,), 3, [0, 1, 2]),
        ((2.5,), 2, [3, 4]),
    ]


def test_driven_dc_offset_is_simulated():
    ((plan, _),) = observe(response(provenance={"dc_offset_v": -0.5})).plans
    assert plan.dc_offset_v == -0.5


@pytest.mark.parametrize("stated", ["1 V", True, float("nan"), [1.0]])
def test_invalid_dc_offset_is_refused(stated):
    with pytest.raises(InputError, match="is no voltage; give it in V"):
        observe(response(provenance={"dc_offset_v": stated}))


@pytest.mark.parametrize(
    "slip",
    [
        # Its frequencies are in kHz; a cycle count has some noughts too many, or no end.
        {"frequencies": (0.001, 0.0011, 0.0012)},
        {"settle_cycles": 10**9},
        {"integrate_cycles": 10**24},
    ],
)
def test_a_sweep_without_end_is_refused(slip):
    with pytest.raises(InputError, match="up to 14400 s can be simulated: see whether freq"):
        observe(response(**slip))


@pytest.mark.parametrize(
    ("slip", "said"),
    [
        ({"levels": (1.5, 2500.0)}, "the source drove 2.5e[+]03 V at one point; up to 1000 V"),
        ({"levels": (1e30,)}, "the source drove 1e[+]30 V"),
        # A gain of 6000 dB, and one of 54 dB at 2.5 V.
        (
            {"gain": 1e300},
            "the response is 2.5e[+]300 V at one point; up to 1000 V can be believed",
        ),
        ({"gain": 500.0}, "the response is 1.25e[+]03 V"),
    ],
)
def test_implausible_voltages_are_refused(slip, said):
    with pytest.raises(InputError, match=said):
        observe(response(**slip))


def test_repeated_reading_is_named_by_frequency_level():
    twice = response(frequencies=(100.0, 110.015625, 110.015625))
    said = r"holds 110\.015625 Hz more than once at source level 1\.5 V, .*; leave one row of it"
    with pytest.raises(InputError, match=said):
        observe(twice)
    with pytest.raises(InputError, match=r" 100 Hz .* 2\.5 V, one of 2 such frequencies, "):
        observe(response((2.5,), (100.0, 100.0, 110.0, 110.0, 110.0)))
    # Either of them will do; one that is spoilt is out already, and another sweep is no repetition.
    for flags in ([0, 0, PointFlag.SPOILT] * 2, [0, PointFlag.SPOILT, 0] * 2):
        ((plan, _),) = observe(replace(twice, flags=np.array(flags))).plans
        assert plan.frequencies_hz == (100.0, 110.015625)
    assert len(observe(response(), response(gain=0.2))) == 12


def test_voltages_up_to_a_kilovolt_are_accepted():
    seen = observe(response((999.0,), gain=1.0))
    assert list(seen.source_vpk) == [999.0] * 3


def test_long_sweep_of_slow_machine_is_accepted():
    # Of a slow machine, three hours: 61 points at three levels from 0.5 Hz on.
    grid = tuple(np.geomspace(0.5, 50.0, 61))
    slow = response((1.0, 2.0, 4.0), grid, settle_cycles=20, integrate_cycles=100)
    ((plan, _),) = observe(slow).plans
    assert 9000.0 < plan.duration_s < 14_400.0


def test_sweeps_combine_by_level_with_own_plans():
    high, low = (100.0, 105.0, 115.0, 120.0), (100.0, 120.0)
    first = response()
    second = response((2.5,), high, direction="up", provenance={"dc_offset_v": 1.0})
    third = response((1.5,), low, gain=0.3, integrate_cycles=None)
    seen = observe(first, second, third)
    assert list(seen.source_vpk) == [1.5] * 5 + [2.5] * 7
    assert [(b.start, b.stop) for b in seen.blocks] == [(0, 3), (3, 5), (5, 8), (8, 12)]
    assert [(b.start, b.stop) for b in seen.levels] == [(0, 5), (5, 12)]
    plans = [(p.levels_vpk, p.direction, p.dc_offset_v, p.integrate_cycles) for p, _ in seen.plans]
    # A response that does not say how long it averaged is taken to have done so for 30 cycles.
    # They stand as they were given, though their rows do not.
    assert plans == [
        ((1.5, 2.5), "down", 0.0, 9), ((2.5,), "up", 1.0, 9), ((1.5,), "down", 0.0, 30)
    ]  # fmt: skip
    for one in (first, second, third):
        alone = observe(one)
        for sweep, rows in seen.by_plan():
            if sweep.sweeps() == alone.sweeps():
                np.testing.assert_array_equal(sweep.values, alone.values)
                np.testing.assert_array_equal(seen.values[:, rows], alone.values)
                break
        else:
            pytest.fail("a sweep is none of those that are together")


def test_some_rows_keep_every_sweep_apart():
    seen = observe(response(), response((2.5,), (101.0, 111.0, 121.0), direction="up"))
    seen = seen.at_rows(np.array([0, 2, 3, 5, 6, 8]))
    assert list(seen.frequency_hz) == [100.0, 120.0, 100.0, 120.0, 101.0, 121.0]
    assert [list(rows) for _, rows in seen.plans] == [[0, 1, 2, 3], [4, 5]]
    assert [(b.start, b.stop) for b in seen.blocks] == [(0, 2), (2, 4), (4, 6)]


def test_unknown_values_stay_unknown():
    seen = observe(response(phase_known=False, gain=0.1, gain_std_db=np.nan))
    assert np.all(np.isnan(seen.values[1]))
    assert np.all(np.isnan(seen.values[2]))
    assert np.all(np.isfinite(seen.values[0]))


def test_spoilt_and_overloaded_points_do_not_count():
    flags = [0, PointFlag.SPOILT, 0, 0, PointFlag.OVERLOAD, 0]
    assert list(observe(response(flags=flags)).frequency_hz) == [100.0, 120.0, 100.0, 120.0]
    with pytest.raises(AnalysisError, match="no usable point"):
        observe(response(flags=PointFlag.SPOILT))


def test_unknown_source_level_is_refused_in_words():
    with pytest.raises(AnalysisError, match="at which source level"):
        observe(response(levels=(np.nan,)))


def test_noise_is_taken_from_quietest_points():
    rng = np.random.default_rng(1)
    f = np.linspace(100.0, 200.0, 200)
    gain = np.full(200, 0.1)
    scatter = np.hypot(
        np.sqrt(2) * 5e-4 / 2.5 / gain, rng.exponential(0.05, 200) * (rng.random(200) < 0.8)
    )
    one = FrequencyResponse.from_arrays(
        f, 2.5, gain, unit="ADSS", gain_std_db=DB_PER_NEPER * scatter
    )
    assert observe(one).noise_v == pytest.approx(5e-4, rel=0.1)


@pytest.mark.parametrize("cycles", [12, 30])
def test_motion_that_repeats_shows_median_noise(cycles):
    """The quietest of 75 points are so by chance: by 40 % with 12 cycles, by 25 % with 30."""
    found = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        shown = np.sqrt(rng.chisquare(cycles - 1, 75) / (cycles - 1)) * 2e-4 / (2.5 * 0.1)
        shown[rng.random(75) < 0.1] *= 10.0
        one = FrequencyResponse.from_arrays(
            np.linspace(10.0, 30.0, 75), 2.5, np.full(75, 0.1), unit="FEED-AXIS",
            gain_std_db=DB_PER_NEPER * shown, integrate_cycles=cycles,
            provenance={GAIN_STD_COMPONENTS: 1},
        )  # fmt: skip
        seen = observe(one)
        found.append((seen.noise_v, seen.noise_v * seen.quietest))
    noise_v, quietest_v = np.median(found, axis=0)
    assert noise_v == pytest.approx(2e-4, rel=0.06)
    # What a network has learned with.
    assert quietest_v < 1.7e-4


def test_noise_free_reading_takes_analyser_floor():
    quiet, loud, unknown = 1e-12, 1.0, 0.0
    gain = np.array([0.2, 0.1, 0.1], dtype=complex)
    one = response((2.0,), gain=gain, gain_std_db=np.array([loud, quiet, unknown]))
    seen = observe(one)
    # The loudest reading sets the range; half as loud a one shows twice the share of noise.
    least = np.sqrt(2.0) * LEAST_NOISE * 0.2 / 0.1
    np.testing.assert_allclose(np.exp(seen.values[2, :2]), [loud / DB_PER_NEPER, least])
    assert np.isnan(seen.values[2, 2])
    silent = observe(response((1.0, 4.0), gain_std_db=np.full(6, quiet)))
    assert silent.noise_v == pytest.approx(LEAST_NOISE * 0.1 * 4.0)


def test_point_lost_in_noise_bounds_the_motion():
    """500 readings of a servo that friction holds: what is left of their noise is of no weight."""
    rng, noise_v, level = np.random.default_rng(5), 5e-4, 1.5
    noise = noise_v / level
    gain = np.full(500, 1e-7) + noise * (rng.standard_normal((2, 500)).T @ [1.0, 1j])
    gain[0] = 5.0 * noise
    one = FrequencyResponse.from_arrays(
        np.linspace(100.0, 200.0, 500), level, gain, unit="ADSS",
        gain_std_db=DB_PER_NEPER * np.sqrt(2.0) * noise / np.abs(gain),
    )  # fmt: skip
    seen = observe(one)
    assert seen.noise_v == pytest.approx(noise_v)
    held = slice(1, None)
    np.testing.assert_allclose(seen.floor[held], 2.0 * noise)
    np.testing.assert_allclose(seen.noise[held], 0.25)
    assert np.all(np.isnan(seen.values[1:, held]))
    shown = channels_of_readings(np.full(500, 1e-7 + 0j), np.zeros(500), seen.noise, seen.floor)
    off = (seen.values[0] - shown[0])[held]
    # By the exponential distribution of a squared noise: 0.18 above the floor, scattered by 0.16.
    assert np.mean(off) == pytest.approx(0.18, abs=0.03)
    assert np.std(off) == pytest.approx(0.16, abs=0.03)
    # One that moves after all is told from it by ten of these.
    moving = channels_of_readings(np.full(500, 0.05 + 0j), np.zeros(500), seen.noise, seen.floor)
    assert np.all(moving[0, held] - seen.values[0, held] > 10 * 0.25)
    # What has not drowned is as it was read.
    assert (seen.floor[0], seen.noise[0]) == (0.0, pytest.approx(0.2))
    assert seen.values[0, 0] == pytest.approx(np.log(gain[0]).real, abs=1e-7)


def test_simulated_channels_show_mean_scatter_and_noise():
    rng = np.random.default_rng(2)
    truth = np.array([0.2 * np.exp(0.7j), 0.05 * np.exp(-2.0j)])
    noise = np.array([0.01, 0.02])
    cycles = 4000
    spread = rng.standard_normal((2, cycles)) + 1j * rng.standard_normal((2, cycles))
    readings = readings_of_cycles(truth[:, None] * (1 + 0.3 * spread))
    channels = channels_of_readings(*readings, noise, np.zeros(2))
    np.testing.assert_allclose(channels[0], np.log(np.abs(truth)), atol=0.02)
    np.testing.assert_allclose(channels[1], np.angle(truth), atol=0.02)
    expected = np.sqrt(2 * 0.3**2 / cycles + 2 * noise**2)
    np.testing.assert_allclose(np.exp(channels[2]), expected, rtol=0.02)


@pytest.mark.parametrize("angle", [0.0, 0.4, 0.5 * np.pi])
def test_scatter_along_the_gain_is_apart(angle):
    """Oracle: cycles that lie on a line at an angle to the mean."""
    gain, steps = 0.2 * np.exp(0.7j), np.array([-1.0, 0.0, 1.0, -2.0, 2.0])
    cycles = gain * (1.0 + 0.01 * np.exp(1j * angle) * steps)[None]
    of_mean = np.var(0.01 * steps, ddof=1) / len(steps)
    mean, both = readings_of_cycles(cycles)
    assert mean[0] == pytest.approx(gain)
    assert both[0] == pytest.approx(of_mean)
    _, along = readings_of_cycles(cycles, 1)
    assert along[0] == pytest.approx(2.0 * of_mean * np.cos(angle) ** 2, abs=1e-18)
