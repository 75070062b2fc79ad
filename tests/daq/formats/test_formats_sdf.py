"""What is read of files in HP's Standard Data Format, and what is refused."""

import struct
from dataclasses import replace

import numpy as np
import pytest
import sdfascii
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from worlds.sdf_files import HP_35665A, HP_35670A, VOLT, Channel, File

from daq.errors import FileFormatError, InputError
from daq.formats import Reading, read_response, sdf, write_response
from daq.formats.reading import remarks_of
from daq.frf import PointFlag


def saved(tmp_path, file: File):
    path = tmp_path / "TRACE.DAT"
    path.write_bytes(file.content())
    return path


def test_records_have_sizes_of_the_format():
    content = File().content()
    assert struct.unpack(">hl", content[2:8]) == (10, 64)
    assert struct.unpack(">hl", content[66:72]) == (11, 140)
    assert struct.unpack(">hl", content[206:212]) == (12, 134)
    assert struct.unpack(">hl", content[340:346]) == (13, 18)
    assert struct.unpack(">hl", content[358:364]) == (14, 192)


@pytest.mark.parametrize("application", [HP_35670A, HP_35665A])
def test_a_frequency_response_is_read(tmp_path, application):
    path = saved(tmp_path, File(application=application, title=b"run 7"))
    response = read_response(path)
    np.testing.assert_array_equal(response.frequency_hz, [100.0, 102.5, 105.0, 107.5])
    np.testing.assert_array_equal(response.gain, File().gain)
    assert np.all(np.isnan(response.source_vpk))
    assert response.unit == "run 7"
    assert response.provenance["started"] == "2026-11-21T12:34:00"
    assert response.provenance["channels"] == ["Chan  2", "Chan  1"]
    assert not np.any(response.flags)


def test_reading_agrees_with_unscaled_library_reading(tmp_path):
    """Compared with a file to which the library applies no scale."""
    path = saved(tmp_path, File(application=HP_35665A, channels=(Channel(unit=2.0), Channel())))
    _, values = sdfascii.read_sdf_file(str(path))
    np.testing.assert_allclose(read_response(path).gain, values, rtol=1e-7)


def test_spacing_by_ratio_and_by_list(tmp_path):
    path = saved(tmp_path, File(x_type=1, step=1.1))
    np.testing.assert_allclose(
        read_response(path).frequency_hz, 100.0 * 1.1 ** np.arange(4), rtol=1e-15
    )
    listed = (100.0, 101.0, 150.0, 151.015625)
    path = saved(tmp_path, File(x_type=2, abscissa=listed))
    np.testing.assert_array_equal(read_response(path).frequency_hz, listed)


def test_double_precision_is_kept(tmp_path):
    gain = tuple(np.array([1 / 3, 2j / 7, -0.1, 1e-9]) + 0j)
    path = saved(tmp_path, File(gain=gain, y_code=4, application=HP_35665A))
    np.testing.assert_array_equal(read_response(path).gain, gain)


def test_only_the_measured_span_counts(tmp_path):
    path = saved(tmp_path, File(span=(1, 2)))
    np.testing.assert_array_equal(read_response(path).frequency_hz, [102.5, 105.0])


def test_engineering_units_and_windows_are_applied(tmp_path):
    channels = (Channel(unit=4.0, window=2.0), Channel(b"Chan  2", unit=0.5, window=2.0))
    path = saved(tmp_path, File(channels=channels))
    expected = (2.0 / 0.5) / (2.0 / 4.0)
    np.testing.assert_allclose(read_response(path).gain, expected * np.array(File().gain))


def test_an_overload_flags_every_point(tmp_path):
    channels = (Channel(), Channel(b"Chan  2", overloaded=1))
    response = read_response(saved(tmp_path, File(channels=channels)))
    assert np.all(response.flags == PointFlag.OVERLOAD)


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"data_type": 2}, "Auto-power spectrum"),
        ({"is_complex": 0, "gain": (1.0, 2.0, 3.0, 4.0)}, "not a complex frequency response"),
        ({"is_valid": 0}, "marked as not valid"),
        ({"rows": 2}, "waterfall"),
        ({"x_unit": VOLT}, "abscissa is not in Hz"),
        ({"first": -1.0}, "point 1: -1 Hz"),
        ({"gain": (1.0, np.nan, 1j, 2.0)}, "point 2: 102.5 Hz with the gain nan"),
        ({"points": 9, "span": (0, 8)}, "cut short"),
        ({"span": (2, 1)}, "points 2 to 1"),
        ({"span": (-3, 1)}, "points -3 to 1"),
        ({"revision": 3}, "cannot be read as SDF"),
        ({"revision": 9}, "cannot be read as SDF"),
        ({"records": (7, 0)}, "cannot be read as SDF"),
        ({"x_type": 2}, "is cut short"),
        ({"channels": (Channel(unit=0.0), Channel())}, "cannot be|can not"),
    ],
)
def test_other_sdf_files_are_refused(tmp_path, changes, fault):
    path = saved(tmp_path, replace(File(), **changes))
    with pytest.raises(FileFormatError, match=fault):
        read_response(path)


@settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damage_never_ends_the_program(tmp_path, data):
    content = bytearray(File().content())
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(0, len(content) - 1))]
    for place in data.draw(st.lists(st.integers(0, max(len(content) - 1, 0)), max_size=6)):
        if content:
            content[place] ^= data.draw(st.integers(1, 255))
    path = tmp_path / "DAMAGED.DAT"
    path.write_bytes(content)
    told = complaint(path)
    assert told is None or (str(path) in told and "\n" not in told)


def complaint(path) -> str | None:
    try:
        sdf.read(path)
    except FileFormatError as error:
        return str(error)
    return None


def test_the_format_is_only_read(tmp_path):
    response = read_response(saved(tmp_path, File()))
    with pytest.raises(InputError, match="cannot write"):
        write_response(response, tmp_path / "new.dat")


def test_zero_frequency_row_is_omitted_with_note(tmp_path):
    path = tmp_path / "TRACE1.DAT"
    path.write_bytes(File(first=0.0).content())
    response = read_response(path, Reading(level_vpk=2.5, unit_name="ADSS", direction="up"))
    np.testing.assert_allclose(response.frequency_hz, [2.5, 5.0, 7.5])
    assert remarks_of(response) == ["the row at 0 Hz of TRACE1.DAT left out"]
    np.testing.assert_array_equal(response.levels_vpk, [2.5])
    assert (response.unit, response.direction) == ("ADSS", "up")
    write_response(response, tmp_path / "known.csv")
    np.testing.assert_allclose(read_response(tmp_path / "known.csv").gain, response.gain)


def test_text_dat_file_is_read_as_table(tmp_path):
    path = tmp_path / "t.dat"
    path.write_text("Frequency (Hz) Gain (dB)\n10 -3\n20 -4\n30 -5\n")
    np.testing.assert_allclose(read_response(path).gain_db, [-3, -4, -5])
