"""What HDF5, MATLAB and UFF files give back, and what they refuse."""

import math
import os
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from worlds.edited_files import edit
from worlds.responses import measured, responses, same

from daq.errors import FileFormatError, InputError, LashbenchError
from daq.formats import READABLE, read_response, write_response
from daq.formats.record import FILE_LIMIT_BYTES
from daq.frf import FrequencyResponse, PointFlag

SUFFIXES = [".h5", ".mat", ".uff"]
every_format = pytest.mark.parametrize("suffix", SUFFIXES)
often = settings(
    max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def read_here(path: Path) -> FrequencyResponse:
    """Read in this process, without the child that `read_response` starts for binary files."""
    return import_module(READABLE[path.suffix]).read(path)


@every_format
@often
@given(response=responses())
def test_any_response_survives_bit_for_bit(tmp_path, suffix, response):
    path = tmp_path / f"any{suffix}"
    write_response(response, path)
    same(read_here(path), response)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@every_format
def test_file_of_many_rows_is_read_back(tmp_path, suffix):
    response = measured(levels=(0.5, 1.0, 2.5), points=801)
    write_response(response, tmp_path / f"many{suffix}")
    same(read_response(tmp_path / f"many{suffix}"), response)


@pytest.mark.parametrize(
    "suffix",
    [SUFFIXES[0], *(pytest.param(one, marks=pytest.mark.long) for one in SUFFIXES[1:])],
)
def test_chained_conversions_lose_nothing(tmp_path, suffix):
    response = measured()
    path = tmp_path / "first.h5"
    write_response(response, path)
    for step, through in enumerate([suffix, ".mat", ".uff", suffix]):
        following = tmp_path / f"step{step}{through}"
        write_response(read_response(path), following)
        path = following
    same(read_response(path), response)


@every_format
def test_provenance_arrays_and_tuples_return_as_lists(tmp_path, suffix):
    path = tmp_path / f"p{suffix}"
    provenance = {"a": np.arange(3), "b": (1, 2.5), "c": np.float64(0.1), "d": math.nan}
    write_response(measured(provenance=provenance), path)
    read = read_response(path).provenance
    assert read["a"] == [0, 1, 2]
    assert read["b"] == [1, 2.5]
    assert read["c"] == 0.1
    assert math.isnan(read["d"])


@every_format
@pytest.mark.parametrize("odd", [b"bytes", object(), {1: "x"}, {"x": {2, 3}}])
def test_unwritable_provenance_is_refused_without_file(tmp_path, suffix, odd):
    with pytest.raises(InputError, match="provenance cannot be written"):
        write_response(measured(provenance={"odd": odd}), tmp_path / f"x{suffix}")
    assert list(tmp_path.iterdir()) == []


@every_format
@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"frequency_hz": -1.0}, "frequency_hz is not a positive number in row 2"),
        ({"frequency_hz": math.nan}, "frequency_hz is not a positive number in row 2"),
        ({"source_vpk": 0.0}, "source_vpk is neither positive nor unknown in row 2"),
        ({"source_vpk": math.inf}, "source_vpk is neither positive nor unknown in row 2"),
        ({"gain": complex(math.nan, 0)}, "gain is not finite, but the point is not marked"),
        ({"gain_std_db": -0.1}, "gain_std_db is negative or infinite in row 2"),
        ({"phase_std_deg": math.inf}, "phase_std_deg is negative or infinite in row 2"),
        ({"flags": 32}, "flags are not those of a point in row 2"),
        ({"flags": -1}, "flags are not those of a point in row 2"),
    ],
)
def test_impossible_reading_is_refused_both_ways(tmp_path, suffix, changes, fault):
    response = measured(flags=0)
    path = tmp_path / f"x{suffix}"
    write_response(response, path)

    def impossible(arrays, document):
        for name, value in changes.items():
            arrays[name][1] = value

    edit(path, impossible)
    with pytest.raises(FileFormatError, match=fault):
        read_here(path)
    for name, value in changes.items():
        getattr(response, name)[1] = value
    other = tmp_path / f"y{suffix}"
    with pytest.raises(InputError, match=fault):
        write_response(response, other)
    assert not other.exists()


@every_format
def test_a_response_without_readings_is_refused(tmp_path, suffix):
    nothing = measured().take(np.array([], dtype=int))
    with pytest.raises(InputError, match="no reading"):
        write_response(nothing, tmp_path / f"x{suffix}")


@every_format
def test_a_newer_file_is_refused(tmp_path, suffix):
    path = tmp_path / f"new{suffix}"
    write_response(measured(), path)
    edit(path, lambda arrays, document: document.update(version=9))
    with pytest.raises(FileFormatError, match=r"newer lashbench \(version 9"):
        read_response(path)


@every_format
def test_a_missing_array_is_refused(tmp_path, suffix):
    path = tmp_path / f"x{suffix}"
    write_response(measured(), path)
    edit(path, lambda arrays, document: arrays.pop("dc_v"))
    with pytest.raises(FileFormatError, match="dc_v"):
        read_response(path)


@every_format
def test_columns_of_unequal_length_are_refused(tmp_path, suffix):
    path = tmp_path / f"x{suffix}"
    write_response(measured(), path)
    edit(path, lambda arrays, document: arrays.update(dc_v=arrays["dc_v"][:-1]))
    with pytest.raises(FileFormatError, match="dc_v has shape"):
        read_here(path)


@every_format
@often
@given(data=st.data())
def test_damaged_file_is_refused_or_unchanged(tmp_path, suffix, data):
    good = tmp_path / f"good{suffix}"
    if not good.exists():
        write_response(measured(), good)
    content = bytearray(good.read_bytes())
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(0, len(content) - 1))]
    else:
        for place in data.draw(st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=5)):
            content[place] ^= data.draw(st.integers(1, 255))
    bad = tmp_path / f"bad{suffix}"
    bad.write_bytes(content)
    told = complaint(bad)
    if told is None:
        read = read_here(bad)
        # A universal file whose companion cannot be found is one of another program.
        if not (suffix == ".uff" and read.unit == "unknown"):
            same(read, measured())
    else:
        assert str(bad) in told
        assert "\n" not in told


@every_format
@pytest.mark.parametrize(
    "part", [0.2, 0.99, *(pytest.param(one, marks=pytest.mark.long) for one in (0.5, 0.9))]
)
def test_a_cut_file_is_refused(tmp_path, suffix, part):
    path = tmp_path / f"cut{suffix}"
    write_response(measured(), path)
    content = path.read_bytes()
    path.write_bytes(content[: int(part * len(content))])
    with pytest.raises(FileFormatError):
        read_response(path)


@every_format
@often
@given(content=st.binary(max_size=400))
def test_garbage_is_refused(tmp_path, suffix, content):
    path = tmp_path / f"garbage{suffix}"
    path.write_bytes(content)
    with pytest.raises(FileFormatError):
        read_here(path)


@every_format
def test_invalid_file_is_refused(tmp_path, suffix):
    with pytest.raises(FileFormatError, match="cannot be read"):
        read_response(tmp_path / f"none{suffix}")
    folder = tmp_path / f"folder{suffix}"
    folder.mkdir()
    with pytest.raises(FileFormatError, match="is a directory"):
        read_response(folder)
    with pytest.raises(InputError, match="is a directory; give a file"):
        read_response(tmp_path)
    empty = tmp_path / f"empty{suffix}"
    empty.touch()
    with pytest.raises(FileFormatError, match="is empty"):
        read_response(empty)


@every_format
def test_an_absurd_size_is_refused_unread(tmp_path, suffix):
    path = tmp_path / f"huge{suffix}"
    with path.open("wb") as file:
        file.truncate(FILE_LIMIT_BYTES + 1)
    with pytest.raises(FileFormatError, match="more than any response"):
        read_response(path)


@every_format
def test_failed_write_keeps_the_old_file(tmp_path, suffix, monkeypatch):
    path = tmp_path / f"x{suffix}"
    write_response(measured(unit="old"), path)
    before = path.read_bytes()

    def refuse(_handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(LashbenchError, match="No space left"):
        write_response(measured(unit="new"), path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def complaint(path: Path) -> str | None:
    try:
        read_here(path)
    except FileFormatError as error:
        return str(error)
    return None


def test_hdf5_has_attributes_for_viewers(tmp_path):
    import h5py

    response = measured()
    write_response(response, tmp_path / "x.h5")
    with h5py.File(tmp_path / "x.h5") as file:
        default = file[file.attrs["default"]]
        data = default[default.attrs["default"]]
        assert data.attrs["NX_class"] == "NXdata"
        np.testing.assert_array_equal(data[data.attrs["signal"]][()], response.gain_db)
        assert list(data.attrs["axes"]) == ["frequency_hz"]
        assert data["frequency_hz"].attrs["units"] == "Hz"
        assert all("units" in data[name].attrs for name in data)


@pytest.mark.parametrize("trick", ["soft", "external", "raw", "virtual", "scalar", "text"])
def test_external_hdf5_link_is_refused(tmp_path, trick):
    import h5py

    secret = tmp_path / "secret.h5"
    path = tmp_path / "x.h5"
    write_response(measured(), secret)
    write_response(measured(), path)
    with h5py.File(path, "a") as file:
        group = file["entry/data"]
        del group["gain"]
        if trick == "soft":
            group["gain"] = h5py.SoftLink("/entry/data/harmonic2")
        elif trick == "external":
            group["gain"] = h5py.ExternalLink(str(secret), "/entry/data/gain")
        elif trick == "raw":
            group.create_dataset("gain", (10,), "c16", external=[(str(secret), 0, 160)])
        elif trick == "virtual":
            layout = h5py.VirtualLayout((10,), "c16")
            layout[:] = h5py.VirtualSource(str(secret), "entry/data/gain", (10,))
            group.create_virtual_dataset("gain", layout)
        elif trick == "scalar":
            group["gain"] = 1j
        else:
            group["gain"] = ["a"] * 10
    with pytest.raises(FileFormatError, match="gain"):
        read_response(path)


def test_expanding_hdf5_is_refused(tmp_path):
    import h5py

    path = tmp_path / "bomb.h5"
    write_response(measured(), path)
    with h5py.File(path, "a") as file:
        del file["entry/data/gain"]
        file["entry/data"].create_dataset(
            "gain", (10**10,), "c16", chunks=(10**5,), compression="gzip"
        )
    with pytest.raises(FileFormatError, match="gain is packed"):
        read_response(path)


@every_format
def test_file_altered_elsewhere_is_refused(tmp_path, suffix):
    import h5py
    from scipy.io import loadmat, savemat

    path = tmp_path / f"x{suffix}"
    write_response(measured(), path)
    if suffix == ".h5":
        with h5py.File(path, "a") as file:
            file["entry/data/gain"][0] = 1.0
    elif suffix == ".mat":
        savemat(path, {k: v for k, v in loadmat(path).items() if not k.startswith("__")})
    else:
        text = path.read_text()
        path.write_text(text.replace("-14.3", "-14.4", 1))
        assert path.read_text() != text
    with pytest.raises(FileFormatError, match=r"altered|another program"):
        read_response(path)


def test_matlab_sees_named_column_vectors(tmp_path):
    from scipy.io import loadmat

    response = measured()
    write_response(response, tmp_path / "x.mat")
    found = loadmat(tmp_path / "x.mat")
    assert found["gain"].shape == (10, 1)
    np.testing.assert_array_equal(found["gain"][:, 0], response.gain)


def test_unknown_level_and_phase_survive(tmp_path):
    response = FrequencyResponse.from_arrays(
        [10.0, 20.0, 30.0],
        math.nan,
        [1.0, math.nan, 3.0],
        unit="U",
        phase_known=[False, True, False],
        flags=[0, PointFlag.SPOILT, 0],
    )
    for suffix in SUFFIXES:
        write_response(response, tmp_path / f"x{suffix}")
        same(read_response(tmp_path / f"x{suffix}"), response)


@every_format
def test_valid_edit_of_a_file_is_read(tmp_path, suffix):
    path = tmp_path / f"x{suffix}"
    write_response(measured(), path)
    edit(path, lambda arrays, document: document["provenance"].update(edited="yes"))
    assert read_here(path).provenance["edited"] == "yes"
