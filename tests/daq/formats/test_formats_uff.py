"""Universal files, seen by another program and made by another program."""

import numpy as np
import pytest
import pyuff
from worlds.responses import measured, same

from daq.errors import FileFormatError
from daq.formats import read_response, write_response
from daq.formats.uff import COMPANION
from daq.frf import FrequencyResponse, PointFlag

FREQUENCY = np.array([100.015625, 101.5, 180.25, 250.0])
GAIN = np.array([0.5 - 0.25j, -1e-3 + 2j, 1e-12j, -3.0])


def foreign(path, *, levels=(0.0,), **changes) -> None:
    """A file as another program would write it."""
    for level in levels:
        known = {
            "type": 58,
            "binary": 0,
            "func_type": 4,
            "rsp_node": 1,
            "rsp_dir": 1,
            "ref_node": 1,
            "ref_dir": 1,
            "id1": "drive, point 1",
            "abscissa_spacing": 0,
            "abscissa_spec_data_type": 18,
            "ordinate_spec_data_type": 0,
            "orddenom_spec_data_type": 0,
            "z_axis_value": level,
            "z_axis_axis_units_lab": "V peak" if level else "NONE",
            "x": FREQUENCY,
            "data": GAIN.copy(),
        }
        pyuff.UFF(str(path)).write_sets(known | changes, "add")


def test_other_library_reads_written_file(tmp_path):
    path = tmp_path / "x.uff"
    response = measured(levels=(1.5, 2.5))
    write_response(response, path)
    sets = [found for found in pyuff.UFF(str(path)).read_sets() if found["type"] == 58]
    functions = [found for found in sets if found["func_type"] == 4]
    assert [found["z_axis_value"] for found in functions] == [1.5, 2.5]
    for level, found in zip((1.5, 2.5), functions, strict=True):
        part = response.at_level(level)
        np.testing.assert_allclose(found["x"], part.frequency_hz, rtol=1e-5)
        np.testing.assert_allclose(found["data"], part.gain, rtol=1e-12)
        assert found["abscissa_spec_data_type"] == 18
        assert found["ord_data_type"] == 6
        assert found["abscissa_axis_units_lab"] == "Hz"
        assert "ADSS" in found["id1"]
    errors = [found for found in sets if found["func_type"] == 0]
    np.testing.assert_allclose(errors[1]["data"], response.at_level(2.5).gain_std_db, rtol=1e-12)


def test_every_line_fits_the_format(tmp_path):
    path = tmp_path / "x.uff"
    write_response(measured(unit="é" * 200, provenance={"notes": "\n    -1\n" * 50}), path)
    lines = path.read_bytes().decode("ascii").split("\n")
    assert max(len(line) for line in lines) <= 80
    assert sum(line == "    -1" for line in lines) == 2 * 5
    read_response(path)


def test_missing_readings_stay_in_companion_only(tmp_path):
    """Other programs get the finite readings alone."""
    path = tmp_path / "x.uff"
    response = measured(levels=(1.5,), flags=[0, 0, PointFlag.SPOILT, 0, 0])
    response.gain[2] = np.nan
    write_response(response, path)
    found = pyuff.UFF(str(path)).read_sets(0)
    assert len(found["data"]) == 4
    assert np.all(np.isfinite(found["data"]))
    same(read_response(path), response)


def test_response_without_phase_is_written_complex(tmp_path):
    path = tmp_path / "x.uff"
    response = FrequencyResponse.from_arrays(
        FREQUENCY, 1.0, np.abs(GAIN), unit="U", phase_known=False
    )
    write_response(response, path)
    assert pyuff.UFF(str(path)).read_sets(0)["ord_data_type"] == 4
    same(read_response(path), response)


@pytest.mark.parametrize("points", [1, 2, 3])
def test_short_functions_are_whole(tmp_path, points):
    path = tmp_path / "x.uff"
    response = FrequencyResponse.from_arrays(FREQUENCY[:points], 1.0, GAIN[:points], unit="U")
    write_response(response, path)
    assert len(pyuff.UFF(str(path)).read_sets(0)["data"]) == points
    same(read_response(path), response)


def test_another_programs_file_is_read(tmp_path):
    path = tmp_path / "other.unv"
    foreign(path)
    response = read_response(path)
    np.testing.assert_allclose(response.frequency_hz, FREQUENCY, rtol=1e-5)
    np.testing.assert_allclose(response.gain, GAIN, rtol=1e-11)
    assert np.all(response.phase_known)
    assert np.all(np.isnan(response.source_vpk))
    assert response.provenance["title"] == "drive, point 1"


def test_levels_on_the_third_axis_are_taken(tmp_path):
    path = tmp_path / "other.uff"
    foreign(path, levels=(0.5, 2.0))
    np.testing.assert_array_equal(read_response(path).levels_vpk, [0.5, 2.0])


def test_even_abscissa_and_single_precision_are_read(tmp_path):
    path = tmp_path / "other.uff"
    foreign(path, abscissa_spacing=1, x=np.arange(100.0, 104.0))
    np.testing.assert_allclose(read_response(path).frequency_hz, np.arange(100.0, 104.0))


def test_real_functions_have_no_phase(tmp_path):
    path = tmp_path / "other.uff"
    foreign(path, data=np.abs(GAIN), ordinate_axis_units_lab="V/V")
    response = read_response(path)
    assert not np.any(response.phase_known)
    np.testing.assert_allclose(response.gain, np.abs(GAIN), rtol=1e-11)


@pytest.mark.parametrize(
    ("levels", "changes", "fault"),
    [
        ((0.0, 0.0), {}, "no source level tells apart"),
        ((1.0, 1.0), {}, "no source level tells apart"),
        ((0.0,), {"func_type": 6}, "no frequency response function"),
        ((0.0,), {"abscissa_spec_data_type": 17}, "is not a frequency"),
        ((0.0,), {"x": np.array([-1.0, 1.0, 2.0, 3.0])}, "is negative"),
        ((0.0,), {"x": np.array([1.0, 2.0, 2.0, 3.0])}, "point 3: frequency 2 Hz comes twice"),
        ((0.0,), {"x": np.array([1.0, 3.0, 2.0, 4.0])}, "point 3: frequency 2 Hz is out of order"),
    ],
)
def test_data_of_several_responses_are_refused(tmp_path, levels, changes, fault):
    path = tmp_path / "other.uff"
    foreign(path, levels=levels, **changes)
    with pytest.raises(FileFormatError, match=fault):
        read_response(path)


def altered(path, old: str, new: str, count: int = 1) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, count))


def test_function_unlike_its_companion_is_refused(tmp_path):
    path = tmp_path / "x.uff"
    write_response(FrequencyResponse.from_arrays(FREQUENCY, 1.0, GAIN, unit="U"), path)
    altered(path, "5.000000000000e-01", "5.100000000000e-01")
    with pytest.raises(FileFormatError, match="was altered"):
        read_response(path)


def test_own_file_without_companion_is_read(tmp_path):
    path = tmp_path / "x.uff"
    write_response(measured(), path)
    text = path.read_text()
    path.write_text(text[: text.index(f"    -1\n{COMPANION:6d}")])
    np.testing.assert_allclose(read_response(path).gain, measured().gain, rtol=1e-11)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("|{", "{"),
        ('\\"unit\\": ', '\\"unit\\": 7, '),
        ('"rows"', '"rowz"'),
        ("         4", "         5"),
    ],
)
def test_damage_is_refused(tmp_path, old, new):
    path = tmp_path / "x.uff"
    response = FrequencyResponse.from_arrays(FREQUENCY, 1.0, GAIN, unit="U")
    write_response(response, path)
    altered(path, old, new)
    with pytest.raises(FileFormatError):
        read_response(path)


def test_windows_line_ends_are_as_good(tmp_path):
    path = tmp_path / "x.uff"
    write_response(measured(), path)
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    same(read_response(path), measured())
