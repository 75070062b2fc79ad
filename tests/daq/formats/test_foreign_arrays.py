"""MATLAB and HDF5 files of other programs, by the names of their variables."""

import h5py
import numpy as np
import pytest
from foreign_files import DB, DEG, GAIN, HERTZ, NAMED, told
from scipy.io import savemat

from daq.errors import FileFormatError, InputError
from daq.formats import Reading, read_response
from daq.formats.reading import remarks_of


def test_matlab_variables_are_read_by_name(tmp_path):
    path = tmp_path / "m.mat"
    savemat(path, {"f": HERTZ, "H": GAIN[:, None], "notes": "text", "fs": 1000.0})
    with pytest.raises(FileFormatError, match=r"f 1x181, H 181x1; say what these are"):
        read_response(path)
    response = read_response(path, NAMED)
    np.testing.assert_allclose(response.gain, GAIN)
    assert remarks_of(response) == ["read: f as frequency_hz, H as gain_complex"]
    guessed = read_response(path, Reading(as_guessed=True, level_vpk=2.0))
    np.testing.assert_allclose(guessed.gain, GAIN)
    np.testing.assert_array_equal(guessed.levels_vpk, [2.0])


def test_struct_fields_and_matrix_columns_have_names(tmp_path):
    path = tmp_path / "s.mat"
    matrix = np.column_stack([GAIN, 2 * GAIN, 3 * GAIN])
    savemat(path, {"data": {"w": 2 * np.pi * HERTZ, "frf": matrix, "x": np.zeros((2, 181, 2))}})
    reading = told(("frequency_rad_s", "data.w"), ("gain_complex", "data.frf(:,2)"))
    response = read_response(path, reading)
    np.testing.assert_allclose(response.gain, 2 * GAIN)
    np.testing.assert_allclose(response.frequency_hz, HERTZ)
    with pytest.raises(InputError, match="has no column 'data.frf'; it has"):
        read_response(path, told(("frequency_hz", "data.w"), ("gain_complex", "data.frf")))


@pytest.mark.parametrize("pair", [None, ("r", "i"), ("real", "imag")])
def test_hdf5_data_sets_are_read_by_path(tmp_path, pair):
    path = tmp_path / "d.h5"
    values = GAIN
    if pair is not None:
        values = np.zeros(181, [(name, float) for name in pair])
        values[pair[0]], values[pair[1]] = GAIN.real, GAIN.imag
    with h5py.File(path, "w") as file:
        file["run/f"] = HERTZ
        file.create_dataset("run/H", data=values, chunks=(50,), compression="gzip")
        file["elsewhere"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "x")
    with pytest.raises(FileFormatError, match=r"run/H 181, run/f 181; say what these are"):
        read_response(path)
    response = read_response(path, told(("frequency_hz", "run/f"), ("gain_complex", "run/H")))
    np.testing.assert_allclose(response.gain, GAIN)


def test_matlab_version_73_is_read_alike(tmp_path):
    path = tmp_path / "v73.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["f"], file["db"], file["deg"] = HERTZ[None], DB[None], DEG[None]
    content = bytearray(path.read_bytes())
    content[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(content)
    reading = told(("frequency_hz", "f"), ("gain_db", "db"), ("phase_deg", "deg"))
    np.testing.assert_allclose(read_response(path, reading).gain, GAIN, rtol=1e-9)


@pytest.mark.parametrize(
    ("held", "reading", "fault"),
    [
        ({"f": HERTZ, "H": GAIN[:-1]}, NAMED, "has no column 'H'"),
        ({"f": HERTZ, "H": np.abs(GAIN) * np.nan}, NAMED, "element 1: gain is missing"),
        ({"f": HERTZ[::-1] * 0 + 5, "H": GAIN}, NAMED, "element 2: frequency 5 Hz comes twice"),
        ({"f": HERTZ, "H": GAIN}, told(("gain_db", "H")), "gain_db is a column of complex"),
        ({"words": "none"}, NAMED, "holds no vector"),
        ({"f": HERTZ, "a": DB, "b": DB}, Reading(as_guessed=True), "no column is named"),
    ],
)
def test_variables_without_response_are_refused(tmp_path, held, reading, fault):
    path = tmp_path / "m.mat"
    savemat(path, held)
    with pytest.raises(InputError, match=fault):
        read_response(path, reading)


def test_foreign_bomb_is_refused_in_bounded_memory(tmp_path):
    path = tmp_path / "bomb.h5"
    with h5py.File(path, "w") as file:
        file["f"] = HERTZ
        file.create_dataset("H", (10**9,), "f8", chunks=(10**5,), compression="gzip")
    with pytest.raises(InputError, match="bomb.h5"):
        read_response(path, NAMED)
