"""Large responses: bounded work, and the answer says of what it is made."""

import cProfile
import json
import pstats
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.estimate import estimate_response
from analysis.observation.thinning import MOST_ROWS, thin, thin_responses
from analysis.resonance import extract
from daq.errors import InputError
from daq.formats import read_response, write_response
from daq.frf import FrequencyResponse, PointFlag
from sim.unit import load_unit
from tui.cli import main
from tui.text.output import Console


def linear(frequency_hz):
    """A servo with a zero pair at 130 and a pole pair at 150 Hz."""
    s = 1j * frequency_hz
    top = s**2 + 2 * 0.03 * 130 * s + 130**2
    return 100 / s * top / (s**2 + 2 * 0.02 * 150 * s + 150**2)


def large(levels, points, band=(100.0, 180.0), seed=0, **changes):
    frequency = np.tile(np.linspace(*band, points), len(levels))
    noise = np.random.default_rng(seed).normal(size=(2, len(frequency)))
    return FrequencyResponse.from_arrays(
        frequency,
        np.repeat(levels, points),
        linear(frequency) * (1 + 0.01 * (noise[0] + 1j * noise[1])),
        unit="ADSS",
        gain_std_db=0.0869,
        **changes,
    )


def peak_bytes(work):
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_usual_size_response_is_not_thinned():
    usual = large([1.5, 2.5, 4.0], MOST_ROWS // 3)
    (kept,), doubts = thin_responses([usual])
    assert kept is usual
    assert doubts == []


@given(
    levels=st.lists(st.floats(0.1, 5.0), min_size=1, max_size=30, unique=True),
    points=st.integers(1, 120),
    most=st.integers(8, 200),
    spoilt=st.integers(0, 3),
)
def test_thinned_rows_are_limited_subset(levels, points, most, spoilt):
    flags = np.zeros(len(levels) * points, dtype=int)
    flags[:spoilt] = PointFlag.SPOILT
    whole = large(sorted(levels), points, flags=flags)
    kept = thin(whole, most)
    assert len(kept) <= max(most, 1)
    rows = set(zip(whole.source_vpk, whole.frequency_hz, whole.gain, strict=True))
    assert set(zip(kept.source_vpk, kept.frequency_hz, kept.gain, strict=True)) <= rows
    if len(kept) < len(whole) and not spoilt:
        assert {kept.source_vpk.min(), kept.source_vpk.max()} == {min(levels), max(levels)}


def test_points_are_kept_where_the_gain_changes():
    kept = thin(large([2.5], 20_000, band=(1.0, 1000.0)), 366)
    near = np.count_nonzero((kept.frequency_hz > 110) & (kept.frequency_hz < 170))
    # Evenly by frequency there would be 22 of them, by its logarithm 23.
    assert near > 60
    assert kept.frequency_hz.min() == 1.0
    assert kept.frequency_hz.max() == 1000.0


def test_level_of_many_points_has_bounded_memory():
    whole = large([2.5], 200_000)
    assert peak_bytes(lambda: thin(whole, 366)) < 60e6
    assert peak_bytes(lambda: extract(whole)) < 100e6


def test_many_points_are_averaged_without_loss():
    (level,) = extract(large([2.5], 60_000))
    assert "level: read from means of 30 neighbouring points" in level.flags
    # The extrema of the gain itself, on a grid a hundred times finer than the error bars.
    fine = np.linspace(120.0, 160.0, 4_000_001)
    gain = np.abs(linear(fine))
    for feature, at in ((level.arf, np.argmin(gain)), (level.rf, np.argmax(gain))):
        assert abs(feature.frequency_hz - fine[at]) < 4 * feature.std_hz
        assert feature.std_hz < 0.001
    (usual,) = extract(large([2.5], 2000))
    assert not any("means of" in flag for flag in usual.flags)


def test_too_many_levels_are_refused_at_once():
    level = 2.5 + 1e-4 * np.random.default_rng(1).normal(size=100_000)
    measured = FrequencyResponse.from_arrays(np.linspace(100, 180, 100_000), level, 1.0, unit="X")
    with pytest.raises(InputError, match="more than 1000 source levels .* the level that was set"):
        extract(measured)
    with pytest.raises(InputError, match="more than 1000 source levels"):
        estimate_response(measured, load_unit("adss"))


def test_csv_rows_are_read_in_few_calls(tmp_path):
    path = tmp_path / "large.csv"
    whole = large(0.2 * np.arange(1, 21), 1000, seed=2)
    write_response(whole, path)
    profile = cProfile.Profile()
    back = profile.runcall(read_response, path)
    np.testing.assert_allclose(back.gain, whole.gain)
    assert pstats.Stats(profile).total_calls < 8 * len(whole)


@pytest.mark.long
def test_estimate_simulates_the_stated_thinned_rows(tmp_path, capsys):
    path = tmp_path / "large.csv"
    cycles = {"settle_cycles": 1, "integrate_cycles": 2}
    write_response(large(0.2 * np.arange(1, 21), 1000, **cycles), path)
    assert main(["estimate", str(path), "--unit", "adss", "--json", "--as-is"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert any(
        text.startswith("of 20000 points 366 were used, at 6 of 20 source levels")
        for text in found["warnings"]
    )
    # One machine takes 460 s through the whole sweep; some four hundred are simulated.
    assert found["simulated_s"] < 10 * 460


def test_progress_without_terminal_is_reported_rarely(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    console = Console()
    for second in range(40):
        now[0] = float(second)
        console.progress(second / 40, "simulating the range")
    assert capsys.readouterr().err.splitlines() == [
        " 38 %  simulating the range",
        " 75 %  simulating the range",
    ]
    Console(quiet=True).progress(0.5, "silent")
    assert capsys.readouterr().err == ""
