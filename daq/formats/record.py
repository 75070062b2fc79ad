"""A frequency response as named arrays and one JSON document, for formats that hold both.

Owns what HDF5, MATLAB and UFF files have in common: the names, the meaning of
the document, and the checks that a response must pass on its way in and out.
It reads and writes no file.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError, InputError
from daq.frf import FrequencyResponse, PointFlag
from daq.untrusted.bounded_text import parse_json

__all__ = [
    "ARRAYS",
    "FILE_LIMIT_BYTES",
    "FORMAT",
    "ROW_LIMIT",
    "VERSION",
    "checked_file",
    "response_from",
    "taken_apart",
]

FORMAT = "lashbench frequency response"
VERSION = 1

ROW_LIMIT = 1_000_000
"""Rows above which a file is taken for damaged."""
FILE_LIMIT_BYTES = 512 << 20
"""Size above which a file is not opened."""

ARRAYS: Mapping[str, tuple[type, str]] = {
    "frequency_hz": (np.float64, "Hz"),
    "source_vpk": (np.float64, "V"),
    "gain": (np.complex128, "1"),
    "phase_known": (np.uint8, "1"),
    "gain_std_db": (np.float64, "dB"),
    "phase_std_deg": (np.float64, "deg"),
    "dc_v": (np.float64, "V"),
    "harmonic2": (np.complex128, "1"),
    "harmonic3": (np.complex128, "1"),
    "flags": (np.int64, "1"),
}
"""Element type and unit of each array of a response."""

_PROCEDURE = ("unit", "direction", "settle_cycles", "integrate_cycles", "from_rest")
_FLAGS = sum(PointFlag)


def taken_apart(response: FrequencyResponse, path: Path) -> tuple[dict[str, NDArray[Any]], str]:
    """The arrays of a response, and everything else of it as ASCII JSON.

    Sequences of any kind come back as lists, NumPy scalars and arrays as the
    numbers they hold. The document carries a digest of itself and the arrays,
    so that damage is found in any format.

    Returns
    -------
    tuple
        Arrays by the names of `ARRAYS`, each of shape (rows,), and the document.

    Raises
    ------
    InputError
        If a value is none that a reading can have, or the provenance holds
        something that JSON has no word for; `path` is named.
    """
    fault = _fault(response)
    if fault:
        raise InputError(f"{path}: {fault}")
    arrays: dict[str, NDArray[Any]] = {
        name: np.asarray(getattr(response, name), dtype=ARRAYS[name][0]) for name in ARRAYS
    }
    document: dict[str, Any] = {"format": FORMAT, "version": VERSION}
    document |= {name: getattr(response, name) for name in _PROCEDURE}
    try:
        document["provenance"] = _plain(response.provenance)
        document["sha256"] = _digest(arrays, document)
        return arrays, json.dumps(document)
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: the provenance cannot be written ({error})") from error


def response_from(arrays: Mapping[str, Any], text: str, path: Path) -> FrequencyResponse:
    """The response that `taken_apart` took apart.

    Raises
    ------
    FileFormatError
        If anything is missing, of the wrong kind, newer than this program, or
        none that a reading can have; `path` is named.
    """
    document = _document(text, path)
    missing = [name for name in ARRAYS if name not in arrays]
    if missing:
        raise FileFormatError(f"{path}: {', '.join(missing)} is missing; give a whole file")
    columns: dict[str, Any] = {name: _column(arrays[name], name, path) for name in ARRAYS}
    if document.pop("sha256") != _digest(columns, document):
        raise FileFormatError(f"{path}: was damaged or altered: its digest does not fit")
    columns["phase_known"] = columns["phase_known"].astype(bool)
    del document["format"], document["version"]
    document["provenance"] = MappingProxyType(document["provenance"])
    try:
        response = FrequencyResponse(**columns, **document)
    except InputError as error:
        raise FileFormatError(f"{path}: {error}") from error
    fault = _fault(response)
    if fault:
        raise FileFormatError(f"{path}: {fault}")
    return response


def checked_file(path: Path, kind: str) -> Path:
    """The path, once something of a reasonable size can be read there.

    Raises
    ------
    FileFormatError
        If there is no file, it may not be read, or it is empty or absurdly large.
    """
    if os.path.isdir(path):
        raise FileFormatError(f"{path}: is a directory; give {kind}")
    if os.path.exists(path) and not os.path.isfile(path):
        raise FileFormatError(f"{path}: is not a regular file; give {kind}")
    try:
        with path.open("rb") as file:
            size = path.stat().st_size
            file.read(1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileFormatError(f"{path}: cannot be read ({reason}); give {kind}") from error
    if size == 0:
        raise FileFormatError(f"{path}: is empty; give {kind}")
    if size > FILE_LIMIT_BYTES:
        raise FileFormatError(f"{path}: has {size} bytes, more than any response; give {kind}")
    return path


def _digest(arrays: Mapping[str, NDArray[Any]], document: Mapping[str, Any]) -> str:
    digest = hashlib.sha256(json.dumps(document, sort_keys=True).encode("ascii"))
    for name, (dtype, _) in ARRAYS.items():
        values: NDArray[Any] = np.ascontiguousarray(arrays[name], dtype=dtype)
        if values.dtype.kind in "fc":
            # Text formats know one NaN only.
            values = values.view(np.float64)
            values = np.where(np.isnan(values), np.nan, values)
        digest.update(values.astype(values.dtype.newbyteorder("<")).tobytes())
    return digest.hexdigest()


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise TypeError(f"the key {key!r} is not a name")
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, bytes | bytearray):
        return [_plain(item) for item in value]
    raise TypeError(f"{type(value).__name__} has no form in JSON")


def _document(text: str, path: Path) -> dict[str, Any]:
    try:
        document = parse_json(text)
    except ValueError as error:
        raise FileFormatError(f"{path}: its document is not JSON ({error})") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise FileFormatError(f"{path}: is no {FORMAT}")
    version = document.get("version")
    if type(version) is not int or version < 1:
        raise FileFormatError(f"{path}: the version {version!r} of its document is not a number")
    if version > VERSION:
        raise FileFormatError(
            f"{path}: was written by a newer lashbench (version {version}, this one knows "
            f"{VERSION}); update lashbench to read it"
        )
    if set(document) != {"format", "version", *_PROCEDURE, "provenance", "sha256"}:
        raise FileFormatError(f"{path}: its document has the wrong keys: {sorted(document)}")
    _check_procedure(document, path)
    return document


def _check_procedure(document: Mapping[str, Any], path: Path) -> None:
    def count(name: str, least: int) -> bool:
        value = document[name]
        return value is None or (type(value) is int and value >= least)

    right = {
        "unit": isinstance(document["unit"], str),
        "direction": document["direction"] in (None, "up", "down"),
        "settle_cycles": count("settle_cycles", 0),
        "integrate_cycles": count("integrate_cycles", 1),
        "from_rest": isinstance(document["from_rest"], bool | None),
        "provenance": isinstance(document["provenance"], dict),
    }
    for name, is_right in right.items():
        if not is_right:
            raise FileFormatError(f"{path}: {name} {document[name]!r} is not possible")


def _column(values: Any, name: str, path: Path) -> NDArray[Any]:
    column = np.asarray(values)
    dtype = ARRAYS[name][0]
    if column.ndim != 1 or len(column) > ROW_LIMIT:
        raise FileFormatError(
            f"{path}: {name} has the shape {column.shape}, not that of a list of up to {ROW_LIMIT}"
        )
    kind = "c" if dtype is np.complex128 else "f" if dtype is np.float64 else "iu"
    # An empty or all-integer list of numbers is as good as one of reals.
    if column.dtype.kind not in kind and not (kind in "cf" and column.dtype.kind in "fiu"):
        raise FileFormatError(f"{path}: {name} holds {column.dtype}, not {dtype.__name__}")
    return column.astype(dtype)


def _fault(response: FrequencyResponse) -> str | None:
    """What makes a response impossible, None if nothing does."""
    frequency, level = response.frequency_hz, response.source_vpk
    spoilt = (response.flags & PointFlag.SPOILT) != 0
    faults = {
        "frequency_hz is not a positive number": ~(np.isfinite(frequency) & (frequency > 0)),
        "source_vpk is neither positive nor unknown": ~(np.isnan(level) | (level > 0))
        | np.isinf(level),
        "gain is not finite, but the point is not marked as spoilt": ~np.isfinite(response.gain)
        & ~spoilt,
        "gain_std_db is negative or infinite": _bad_error(response.gain_std_db),
        "phase_std_deg is negative or infinite": _bad_error(response.phase_std_deg),
        "flags are not those of a point": (response.flags < 0) | (response.flags > _FLAGS),
    }
    if len(response) == 0:
        return "there is no reading in it"
    for fault, rows in faults.items():
        if np.any(rows):
            row = int(np.flatnonzero(rows)[0])
            return f"{fault} in row {row + 1}, at {_shown(frequency[row])} Hz"
    return None


def _bad_error(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.isinf(values) | (values < 0)


def _shown(value: float) -> str:
    return f"{value:g}" if math.isfinite(value) else str(value)
