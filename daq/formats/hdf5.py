"""Frequency responses as HDF5, with the attributes that generic viewers of NeXus files follow.

Owns that layout: one group with one data set per array, each with its unit,
and the rest of the response as a JSON document in the root. Decibels and
degrees are written as well, for viewers; they are not read back.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from daq.errors import FileFormatError
from daq.formats.atomic import replacing
from daq.formats.reading import NOTHING_TOLD, Reading
from daq.formats.record import ARRAYS, ROW_LIMIT, checked_file, response_from, taken_apart
from daq.frf import FrequencyResponse

if TYPE_CHECKING:
    import h5py

__all__ = ["read", "write"]

_GROUP = "entry/data"
_KIND = "an HDF5 file that lashbench wrote"
_DOCUMENT_LIMIT_BYTES = 64 << 20


def read(path: Path, reading: Reading = NOTHING_TOLD) -> FrequencyResponse:
    """Read an HDF5 file that `write` made, or another program's by the names of data sets.

    Raises
    ------
    FileFormatError
        If the file is damaged, not one of ours, or holds anything but plain
        arrays of numbers where they are due.
    """
    import h5py

    checked_file(path, _KIND)
    try:
        with h5py.File(path, "r") as file:
            if "document" not in file:
                from daq.formats.foreign.arrays import response_in_h5

                used = ("averages", "profile", "columns", "as_guessed")
                reading.refuse_unused(path, used, "an HDF5 file of another program")
                return response_in_h5(file, reading, path)
            reading.refuse_unused(path, (), "a file that lashbench wrote")
            document = _document(file, path)
            arrays = {name: _array(file, name, path) for name in ARRAYS}
    except (OSError, KeyError, RuntimeError, ValueError, TypeError) as error:
        # h5py reports damage in any of these ways.
        reason = " ".join(str(error).split())
        raise FileFormatError(f"{path}: cannot be read as HDF5 ({reason}); give {_KIND}") from error
    return response_from(arrays, document, path)


def write(response: FrequencyResponse, path: Path) -> None:
    """Write an HDF5 file, whole or not at all; nothing of the response is lost.

    Raises
    ------
    InputError
        If a value is none that a reading can have, the provenance has no form
        in JSON, or no file can be made at `path`.
    """
    import h5py

    arrays, document = taken_apart(response, path)
    shown = {"gain_db": (response.gain_db, "dB"), "phase_deg": (response.phase_deg, "deg")}
    # In memory first: the library does not survive a disk that refuses its data.
    content = BytesIO()
    with h5py.File(content, "w") as file:
        file.attrs.update({"NX_class": "NXroot", "default": "entry"})
        # A data set of its own: attributes are limited to 64 KiB.
        file.create_dataset("document", data=np.frombuffer(document.encode("ascii"), np.uint8))
        group = file.create_group(_GROUP)
        file["entry"].attrs.update({"NX_class": "NXentry", "default": "data"})
        group.attrs.update({"NX_class": "NXdata", "signal": "gain_db", "axes": ["frequency_hz"]})
        for name, values in arrays.items():
            group.create_dataset(name, data=values).attrs["units"] = ARRAYS[name][1]
        for name, (column, unit) in shown.items():
            group.create_dataset(name, data=column).attrs["units"] = unit
    with replacing(path) as stream:
        stream.write(content.getvalue())


def _document(file: h5py.File, path: Path) -> str:
    held = _plain_dataset(file, "document", path)
    if held.dtype != np.uint8 or held.ndim != 1 or len(held) > _DOCUMENT_LIMIT_BYTES:
        raise FileFormatError(f"{path}: its document is not a text; give {_KIND}")
    return bytes(held[()]).decode("ascii")


def _array(file: h5py.File, name: str, path: Path) -> Any:
    held = _plain_dataset(file, f"{_GROUP}/{name}", path)
    if held.dtype.newbyteorder("=") != np.dtype(ARRAYS[name][0]):
        raise FileFormatError(f"{path}: {name} holds {held.dtype}; give {_KIND}")
    if held.ndim != 1 or len(held) > ROW_LIMIT:
        raise FileFormatError(f"{path}: {name} has the shape {held.shape}; give {_KIND}")
    return held[()]


def _plain_dataset(file: h5py.File, name: str, path: Path) -> h5py.Dataset:
    import h5py

    held = file
    for part in name.split("/"):
        # A link may lead out of the file, and so may the storage of a data set.
        if not isinstance(held, h5py.Group) or not isinstance(
            held.get(part, getlink=True), h5py.HardLink
        ):
            raise FileFormatError(f"{path}: {name} is missing; give {_KIND}")
        held = held[part]
    if not isinstance(held, h5py.Dataset) or held.is_virtual or held.external:
        raise FileFormatError(f"{path}: {name} is not an array held in the file; give {_KIND}")
    # Numbers one after the other, as `write` lays them: the library does not survive every
    # damaged chunk, filter or element of varying length, and unpacks without a bound.
    layout = held.id.get_create_plist()
    if layout.get_layout() != h5py.h5d.CONTIGUOUS or layout.get_nfilters():
        raise FileFormatError(f"{path}: {name} is packed or in pieces; give {_KIND}")
    return held
