"""Values that no bench has: what is refused of a file, and what stays."""

from dataclasses import replace

import numpy as np
import pytest
from worlds.responses import measured
from worlds.sdf_files import File

from daq.errors import FileFormatError
from daq.formats import read_response, write_response
from daq.formats.believable import BOUNDS, check_reading, disbelief
from daq.frf import FrequencyResponse

HEADER = '# unit = "ADSS"\nfrequency_hz,source_vpk,gain_db,phase_deg,gain_std_db\n'
ROW = {"frequency_hz": 100.0, "source_vpk": 1.5, "gain_db": -3.0, "phase_deg": 10.0}


def text(comment="", **changes):
    values = ROW | {"gain_std_db": 0.1} | changes
    return f"{comment}{HEADER}90,1.5,-3,10,0.1\n{','.join(map(repr, values.values()))}\n"


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("gain_db", 5000.0, "gain_db 5000 is above the 200 dB that can be believed; see whether"),
        ("gain_db", -5000.0, "gain_db -5000 is below the -400 dB"),
        ("gain_std_db", 1e9, r"gain_std_db 1e\+09 is above the 100000 dB that"),
        ("phase_deg", 1e12, r"phase_deg 1e\+12 is above the 360000 deg"),
        ("phase_deg", -1e12, r"phase_deg -1e\+12 is below the -360000 deg"),
        ("source_vpk", 1e9, r"source_vpk 1e\+09 is above the 1000 V"),
        ("source_vpk", 1e-15, "source_vpk 1e-15 is below the 1e-09 V"),
        ("frequency_hz", 1e9, r"frequency_hz 1e\+09 is above the 1e\+07 Hz"),
    ],
)
def test_implausible_value_is_refused_by_line(tmp_path, name, value, said):
    path = tmp_path / "slip.csv"
    path.write_text(text(**{name: value}))
    with pytest.raises(FileFormatError, match=rf"slip\.csv, line 4: {said}") as caught:
        read_response(path)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("bound", ["least", "most"])
@pytest.mark.parametrize("name", [*ROW, "gain_std_db"])
def test_value_at_limit_is_read(tmp_path, name, bound):
    path = tmp_path / "far.csv"
    # At a level of its own, so that frequencies need not rise.
    path.write_text(text(**{"source_vpk": 2.0, name: getattr(BOUNDS[name], bound)}))
    assert len(read_response(path)) == 2


@pytest.mark.parametrize(
    ("comment", "said"),
    [
        ("point_phase_std_deg = [0.1, 1e9]", r"row 2: point_phase_std_deg 1e\+09 is above"),
        ("point_phase_std_deg = [0.1, -1.0]", "row 2: point_phase_std_deg -1 is below the 0 deg"),
        ("point_dc_v = [-1e5, nan]", "row 1: point_dc_v -100000 is below the -1000 V"),
        ("point_harmonic2 = [[0.0, 1.0], [0.0, 1e11]]", r"row 2: point_harmonic2 1e\+11 is"),
        ("point_harmonic3 = [[nan, nan], [1.5e308, 1.5e308]]", "row 2: point_harmonic3 inf is"),
        ("dc_offset_v = 1e9", r"dc_offset_v 1e\+09 is above the 1000 V"),
    ],
)
def test_implausible_header_value_is_refused(tmp_path, comment, said):
    path = tmp_path / "slip.csv"
    path.write_text(text(f"# {comment}\n"))
    with pytest.raises(FileFormatError, match=rf"slip\.csv: {said}"):
        read_response(path)


@pytest.mark.parametrize(
    "changes",
    [{"gain": 1e11}, {"gain_std_db": 1e6}, {"source_vpk": 2e3}, {"dc_v": 1e4}, {"harmonic3": 1e11}],
)
def test_unreadable_values_are_not_written(tmp_path, changes):
    fields = {"frequency_hz": [100.0, 101.0], "source_vpk": 1.5, "gain": 0.5} | changes
    path = tmp_path / "x.csv"
    with pytest.raises(FileFormatError, match="can be believed"):
        write_response(FrequencyResponse.from_arrays(**fields, unit="ADSS"), path)
    assert not path.exists()


def test_point_lost_in_noise_is_plausible(tmp_path):
    """Of a hundred thousand readings of nothing, none is refused: chance errs by one in 1e8."""
    rng = np.random.default_rng(3)
    gain = 1e-7 * (rng.standard_normal((2, 100_000)).T @ [1.0, 1j])
    lost = FrequencyResponse.from_arrays(
        np.linspace(100.0, 200.0, len(gain)), 1.5, gain, unit="ADSS",
        gain_std_db=8.686e-7 / np.abs(gain), phase_std_deg=57.3e-7 / np.abs(gain),
    )  # fmt: skip
    for name, values in (
        ("gain_db", lost.gain_db),
        ("gain_std_db", lost.gain_std_db),
        ("point_phase_std_deg", lost.phase_std_deg),
    ):
        assert disbelief(name, values) is None


def test_files_of_other_programs_have_same_bounds(tmp_path):
    path = tmp_path / "TRACE.DAT"
    path.write_bytes(replace(File(), gain=(1.0, 1j, 1e30, 1.0), y_code=4).content())
    with pytest.raises(FileFormatError, match=r"TRACE\.DAT, row 3, at 105 Hz: gain_db 600 is"):
        read_response(path)
    # A gain of zero is none, and an unknown level is no level.
    nothing = FrequencyResponse.from_arrays([100.0], [np.nan], [0.0], unit="unknown")
    check_reading(nothing, path)
    odd = FrequencyResponse.from_arrays([100.0, 101.0], 3000.0, 1.0, unit="unknown")
    with pytest.raises(FileFormatError, match="row 1, at 100 Hz: source_vpk 3000 is above the"):
        check_reading(odd, path)


@pytest.mark.parametrize("suffix", [".h5", ".mat", ".uff"])
def test_stored_odd_value_is_read_back(tmp_path, suffix):
    path = tmp_path / f"odd{suffix}"
    odd = measured()
    odd.gain[1] = 1e20
    write_response(odd, path)
    assert read_response(path).gain[1] == 1e20
