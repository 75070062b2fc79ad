"""What is not in the band, not there, or not usable, is not read; levels, flags and JSON."""

import math

import numpy as np
import pytest
from worlds.linear_truths import NOTED, Truth, pair

from analysis.resonance import extract, to_json
from daq.frf import DB_PER_NEPER, FrequencyResponse, PointFlag


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
def test_feature_outside_band_is_null_with_reason(band, missing, why):
    truth = Truth(zeta_zero=0.03, start=band[0], stop=band[1])
    for seed in range(4):
        (level,) = extract(truth.measured(seed, 0.02))
        assert (level.arf is None) == (missing in ("arf", "both"))
        assert (level.rf is None) == (missing in ("rf", "both"))
        assert level.difference_hz is None
        assert level.difference_std_hz is None
        for name in ("arf", "rf"):
            if getattr(level, name) is None:
                assert any(flag.startswith(f"{name}: ") and why in flag for flag in level.flags)


def test_remaining_feature_in_band_is_read():
    truth = Truth(zeta_zero=0.03, start=42)
    off = []
    for seed in range(12):
        (level,) = extract(truth.measured(seed, 0.02))
        off.append((level.rf.frequency_hz - truth.extrema()[1]) / level.rf.std_hz)
    assert np.sqrt(np.mean(np.square(off))) < 1.4


@pytest.mark.parametrize(
    ("points", "stated"),
    [
        (31, True),
        *(
            pytest.param(*one, marks=pytest.mark.long)
            for one in ((31, False), (61, True), (61, False), (181, True), (181, False))
        ),
    ],
)
def test_noise_has_no_features(points, stated):
    found = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        f = np.linspace(20, 110, points)
        h = 1 + 0.1 * (rng.normal(size=points) + 1j * rng.normal(size=points))
        std = 0.1 * DB_PER_NEPER if stated else None
        (level,) = extract(FrequencyResponse.from_arrays(f, 1.0, h, unit="", gain_std_db=std))
        found += level.arf is not None or level.rf is not None
        assert level.flags
    # Chance finds one in 2 % at most; 40 draws with more than 4 have a chance below 2e-3.
    assert found <= 4


def test_feature_buried_in_scatter_is_null():
    """The reason is stated."""
    truth = Truth(zeta_zero=0.4, zeta_pole=0.4, step=2.0, integrator=False)
    (level,) = extract(truth.measured(4, 1.2))
    assert level.arf is None
    assert level.rf is None
    assert any("scatter" in flag or "edge" in flag for flag in level.flags)


def test_levels_are_ascending_and_independent():
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


def test_repeated_readings_determine_the_noise():
    truth, noise = NOTED, 0.02
    f = np.repeat(truth.f, 4)
    rng = np.random.default_rng(8)
    h = truth.response(f) * (1 + noise * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size)))
    (level,) = extract(FrequencyResponse.from_arrays(f, 1.0, h, unit=""))
    (single,) = extract(truth.measured(0, noise))
    assert level.arf.std_hz == pytest.approx(single.arf.std_hz / 2, rel=0.2)
    assert level.arf.frequency_hz == pytest.approx(truth.extrema()[0], abs=4 * level.arf.std_hz)


def test_level_without_usable_rows_is_flagged():
    response = FrequencyResponse.from_arrays([1.0, 2.0], 1.0, [np.nan, 0.0], unit="")
    (level,) = extract(response)
    assert level.arf is None
    assert any(flag.startswith("level: ") for flag in level.flags)
    assert extract(FrequencyResponse.from_arrays([], [], [], unit="")) == ()


def test_rows_without_level_are_one_level():
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
def test_noise_minimum_hides_no_resonance(seed):
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
def test_sharp_anti_resonance_may_lack_its_depth(zeta):
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
