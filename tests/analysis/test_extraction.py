"""What the model of the whole band adds: all pairs, coarse grids, corners, spikes."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

from analysis.resonance import extract, summary, to_json
from daq.frf import DB_PER_NEPER, FrequencyResponse

sys.path.insert(0, str(Path(__file__).parents[1] / "studies"))
from extraction import CASES, measured, truth


def case(name):
    return next(one for one in CASES if one.name == name)


def read(name, draw=0):
    (level,) = extract(measured(case(name), draw))
    return level


def near(feature, hz, zeta=None):
    assert feature.frequency_hz == pytest.approx(hz, abs=4 * feature.std_hz)
    if zeta is not None:
        assert feature.damping_ratio == pytest.approx(zeta, abs=4 * feature.damping_std)


def held(name, draws=25):
    """Share of 95 % intervals that hold the truth: frequencies, dampings."""
    true = truth(case(name))
    hz, zeta = [], []
    for draw in range(draws):
        level = read(name, draw)
        for sign, at, damping in true:
            feature = level.arf if sign < 0 else level.rf
            assert feature is not None, level.flags
            hz.append(abs(feature.frequency_hz - at) < 1.96 * feature.std_hz)
            zeta.append(abs(feature.damping_ratio - damping) < 1.96 * feature.damping_std)
    return np.mean(hz), np.mean(zeta)


def test_every_pair_in_band_is_listed():
    level = read("second pair at 140 / 200 Hz")
    assert [(pair.arf is None, pair.rf is None) for pair in level.pairs] == [(False, False)] * 2
    for pair, (arf, rf) in zip(level.pairs, ((35, 62.5), (140, 200)), strict=True):
        assert pair.arf.frequency_hz == pytest.approx(arf, rel=0.01)
        assert pair.rf.frequency_hz == pytest.approx(rf, rel=0.01)
    assert (level.arf, level.rf) == (level.pairs[0].arf, level.pairs[0].rf)
    (said,) = [flag for flag in level.flags if "pairs" in flag]
    assert said.startswith("level: 2 pairs in the band")
    assert "139." in said or "140." in said
    (document,) = json.loads(json.dumps(to_json([level])))["levels"]
    assert document["pairs"][1]["arf"]["damping_ratio"]["value"] == pytest.approx(0.03, rel=0.1)
    assert document["pairs"][0]["arf"]["frequency_hz"] == document["arf"]["frequency_hz"]
    assert any("ARF 2" in line for line in summary([level]))


def test_small_pair_does_not_replace_strong_one():
    level = read("small pair at 28 / 29 Hz")
    assert level.arf.frequency_hz == pytest.approx(45, rel=0.01)
    assert level.rf.frequency_hz == pytest.approx(70, rel=0.01)
    assert level.pairs[0].rf.frequency_hz == pytest.approx(29, rel=0.02)


def test_single_pair_is_listed():
    level = read("zeta 0.03 / 0.05, noise 2 %")
    assert [(pair.arf, pair.rf) for pair in level.pairs] == [(level.arf, level.rf)]
    assert level.flags == ()


def test_damping_on_coarse_grid_ignores_stated_errors():
    for draw in range(5):
        level = read("3 Hz steps, zeta 0.01 / 0.02, errors stated at a sixth", draw)
        near(level.arf, 40.0, 0.01)
        near(level.rf, 70.0, 0.02)
        assert level.arf.damping_std < 0.003
        assert any("times the stated errors" in flag for flag in level.flags)


def test_coarse_log_grid_keeps_deep_valley():
    level = read("40 points in log f, zeta 0.005 / 0.01")
    near(level.arf, 40.0, 0.005)
    near(level.rf, 70.0, 0.01)
    assert level.arf.std_hz < 0.2


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("low-pass at 1.1 RF, zeta 1", marks=pytest.mark.long),
        pytest.param("low-pass at RF, zeta 0.7", marks=pytest.mark.long),
        pytest.param("zeta 0.3 / 0.3", marks=pytest.mark.long),
        pytest.param("mode above the band", marks=pytest.mark.long),
        "constant noise above the valley's depth",
    ],
)
def test_intervals_cover_despite_disturbance(name):
    hz, zeta = held(name)
    # 50 intervals of 95 %: fewer than 43 hold with a chance of 0.2 %.
    assert hz >= 0.86
    assert zeta >= 0.86


@pytest.mark.parametrize("name", ["nothing, and one spike", "nothing"])
def test_one_spike_is_no_resonance(name):
    for draw in range(5):
        level = read(name, draw)
        assert level.arf is None
        assert level.rf is None
        assert level.pairs == ()
        assert any("left out" in flag for flag in level.flags) == ("spike" in name)
        assert any(flag.startswith("arf: ") for flag in level.flags)
        assert any(flag.startswith("rf: ") for flag in level.flags)


def test_spike_near_pair_is_omitted_and_named():
    level = read("a pair and one spike")
    near(level.arf, truth(case("a pair and one spike"))[0][1], 0.03)
    near(level.rf, truth(case("a pair and one spike"))[1][1], 0.05)
    f = measured(case("a pair and one spike"), 0).frequency_hz
    assert any(f"the reading at {f[3 * f.size // 4]:.6g} Hz" in flag for flag in level.flags)


def test_minimum_without_zeros_is_no_anti_resonance():
    level = read("no zeros")
    assert level.arf is None
    near(level.rf, truth(case("no zeros"))[0][1], 0.05)
    (said,) = [flag for flag in level.flags if flag.startswith("arf: ")]
    assert "no pair of zeros" in said


def test_anti_resonance_above_resonance_is_flagged():
    level = read("ARF above RF")
    rf, arf = (hz for _, hz, _ in truth(case("ARF above RF")))
    near(level.arf, arf, 0.03)
    assert level.rf is None
    assert [pair.arf is None for pair in level.pairs] == [True, False]
    near(level.pairs[0].rf, rf, 0.05)
    (said,) = [flag for flag in level.flags if flag.startswith("rf: ")]
    assert "lies below" in said
    assert "edge" not in said


def test_half_power_damping_includes_grid_step():
    """A response that leaps has no model; its damping is known no better than its grid."""
    f = np.arange(20.0, 110.0, 3.0)
    rng = np.random.default_rng(3)
    gain = 10 ** ((-30 + 25 * (f > 68) - 12 * np.exp(-(((f - 41) / 2) ** 2))) / 20) * (
        1 + 0.02 * rng.normal(size=f.size)
    )
    (level,) = extract(FrequencyResponse.from_arrays(f, 1.0, gain, unit="", gain_std_db=0.05))
    assert level.arf.method != "rational"
    step_share = 0.2 * 3.0 / level.arf.frequency_hz
    assert level.arf.damping_std > 0.9 * step_share


def test_stated_error_does_not_choose_model():
    """The same readings with errors at a half and at twice give the same features."""
    one = measured(case("zeta 0.03 / 0.05, noise 2 %"), 1)
    found = []
    for factor in (0.5, 1.0, 2.0):
        stated = FrequencyResponse.from_arrays(
            one.frequency_hz, 1.0, one.gain, unit="", gain_std_db=0.014 * DB_PER_NEPER * factor
        )
        (level,) = extract(stated)
        found.append((level.arf.frequency_hz, level.arf.std_hz))
    assert found[0][0] == pytest.approx(found[1][0], abs=0.3 * found[1][1])
    assert found[0][1] == pytest.approx(found[1][1], rel=0.3)
    assert math.isclose(found[2][1], 2 * found[1][1], rel_tol=0.3)
