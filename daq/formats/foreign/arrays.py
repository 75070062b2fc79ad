"""Responses in MATLAB and HDF5 files of other programs, by the names of their variables.

Owns the way from named arrays to columns: which vectors belong together, and what parts of a
matrix are called. What a name means is `mapping`'s part, as for tables. `daq.formats` calls it in
a child process: the libraries do not survive every damaged file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.foreign.columns import Columns
from daq.formats.foreign.mapping import assigned_columns
from daq.formats.foreign.profiles import load_profile
from daq.formats.foreign.quantities import response_of
from daq.formats.foreign.table import Table
from daq.formats.reading import Reading, remarked
from daq.formats.record import ROW_LIMIT
from daq.frf import FrequencyResponse

if TYPE_CHECKING:
    import h5py

__all__ = ["response_in_h5", "response_in_mat", "vectors_in_mat"]

_MOST_BYTES = 256 << 20
_MOST_PARTS = 400
_DEEP = 6
_LISTED = 20


def response_in_mat(content: bytes, reading: Reading, path: Path) -> FrequencyResponse:
    """The response in a MATLAB file, version 5 or older, or 7.3, that another program wrote.

    Raises
    ------
    FileFormatError
        If it cannot be read, or nothing says which variables are the response; lists them.
    """
    if content[:10] == b"MATLAB 7.3":
        import h5py

        try:
            with h5py.File(BytesIO(content), "r") as file:
                return response_in_h5(file, reading, path)
        except OSError as error:
            raise FileFormatError(f"{path}: is a damaged MATLAB file ({error})") from error
    arrays = _loaded(content, path)
    if not reading.columns and not reading.profile and not reading.as_guessed:
        _refuse_unnamed({name: values.shape for name, values in arrays.items()}, path)
    return _response(arrays, reading, path)


def _loaded(content: bytes, path: Path) -> dict[str, NDArray[Any]]:
    from scipy.io import loadmat

    try:
        found = loadmat(BytesIO(content), squeeze_me=False, struct_as_record=True)
    except Exception as error:
        # The reader has no error of its own: what it dislikes ends in any built-in one.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FileFormatError(f"{path}: cannot be read as a MATLAB file ({reason})") from error
    return dict(_in_structs(found, "", 0))


def vectors_in_mat(content: bytes, path: Path) -> dict[str, NDArray[Any]]:
    """Numeric arrays of a MATLAB file of any version, by name.

    Raises
    ------
    FileFormatError
        If it cannot be read.
    """
    if content[:10] != b"MATLAB 7.3":
        return _loaded(content, path)
    import h5py

    try:
        with h5py.File(BytesIO(content), "r") as file:
            return {
                name: np.asarray(held[()])
                for name, held in _in_groups(file, "", 0)
                if held.dtype.kind in "fiu" and held.size * held.dtype.itemsize <= _MOST_BYTES
            }
    except OSError as error:
        raise FileFormatError(f"{path}: is a damaged MATLAB file ({error})") from error


def response_in_h5(file: h5py.File, reading: Reading, path: Path) -> FrequencyResponse:
    """The same for an open HDF5 file; data sets are called by their paths.

    Nothing but names and shapes is read unless `reading` says which data sets are the response.
    """
    sets = dict(_in_groups(file, "", 0))
    if not reading.columns and not reading.profile and not reading.as_guessed:
        _refuse_unnamed({name: held.shape for name, held in sets.items()}, path)
    arrays: dict[str, NDArray[Any]] = {}
    for name, held in sets.items():
        if held.size * held.dtype.itemsize <= _MOST_BYTES:
            arrays[name] = _complex_of(np.asarray(held[()]))
    return _response(arrays, reading, path)


def _in_structs(held: Any, prefix: str, depth: int) -> Iterator[tuple[str, NDArray[Any]]]:
    """Numeric arrays of variables and of the fields of structs, by names such as ``a.b``."""
    for name, value in held.items():
        if str(name).startswith("__") or depth > _DEEP:
            continue
        full = f"{prefix}{name}"
        if isinstance(value, np.ndarray) and value.dtype.names and value.size == 1:
            record = value.reshape(-1)[0]
            fields = {field: record[field] for field in value.dtype.names}
            yield from _in_structs(fields, f"{full}.", depth + 1)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiuc" and value.size > 1:
            yield full, value


def _in_groups(group: Any, prefix: str, depth: int) -> Iterator[tuple[str, Any]]:
    """Data sets of numbers that are held in the file itself, by paths such as ``a/b``."""
    import h5py

    for name in group:
        link = group.get(name, getlink=True)
        # A link may lead out of the file, and so may the storage of a data set.
        if not isinstance(link, h5py.HardLink) or depth > _DEEP:
            continue
        held, full = group[name], f"{prefix}{name}"
        if isinstance(held, h5py.Group):
            yield from _in_groups(held, f"{full}/", depth + 1)
        elif isinstance(held, h5py.Dataset) and not held.is_virtual and not held.external:
            kind = held.dtype.kind
            parts = set(held.dtype.names or ())
            pair = parts in ({"r", "i"}, {"real", "imag"})
            if held.shape and held.size and held.size > 1 and (kind in "fiuc" or pair):
                yield full, held


def _complex_of(values: NDArray[Any]) -> NDArray[Any]:
    """Pairs of real and imaginary part, as MATLAB and h5py write them, as complex numbers."""
    names = values.dtype.names
    if not names:
        return values
    real, imag = ("r", "i") if "r" in names else ("real", "imag")
    return np.asarray(values[real] + 1j * values[imag])


def _refuse_unnamed(shapes: Mapping[str, tuple[int, ...]], path: Path) -> None:
    listed = [
        f"{name} {'x'.join(map(str, shape))}" for name, shape in list(shapes.items())[:_LISTED]
    ]
    rest = len(shapes) - len(listed)
    held = ", ".join(listed) + (f" and {rest} more" if rest else "") if listed else "no numbers"
    raise FileFormatError(
        f"{path}: another program wrote it, or it is damaged; it holds {held}; say what these are: "
        "--column frequency_hz=NAME --column gain_complex=NAME (or gain_db, phase_deg, ...)"
    )


def _response(
    arrays: Mapping[str, NDArray[Any]], reading: Reading, path: Path
) -> FrequencyResponse:
    table = _table(arrays, [where for _, where in reading.columns], path)
    profile = load_profile(reading.profile) if reading.profile else None
    found = assigned_columns(table, reading.columns, profile, path)
    held = {one.quantity: table.columns[one.column] for one in found}
    columns = Columns(path, held, lambda row: f"element {row + 1}")
    said = ", ".join(f"{table.names[one.column]} as {one.quantity}" for one in found)
    return remarked(response_of(columns, reading), f"read: {said}")


def _table(arrays: Mapping[str, NDArray[Any]], named: list[str], path: Path) -> Table:
    """The vectors of one length, and the parts of matrices along it, as columns."""
    lengths = Counter(a.size for a in arrays.values() if max(a.shape) == a.size)
    told = [arrays[name].size for name in named if name in arrays]
    told = [size for size in told if size in lengths]
    if not lengths:
        raise FileFormatError(f"{path}: holds no vector that could be the frequencies")
    rows = told[0] if told else max(lengths, key=lambda size: (lengths[size], size))
    if rows > ROW_LIMIT:
        raise FileFormatError(f"{path}: has {rows} rows, more than any response")
    columns = dict(_parts(arrays, rows))
    if not columns:
        raise FileFormatError(f"{path}: holds no vectors of one length")
    return Table(tuple(columns.values()), tuple(columns), np.arange(1, rows + 1), (), "comma", ".")


def _parts(arrays: Mapping[str, NDArray[Any]], rows: int) -> Iterator[tuple[str, NDArray[Any]]]:
    """Vectors by their names; parts of a matrix by names such as ``H(:,2)``, counted from 1."""
    count = 0
    for name, values in arrays.items():
        if values.size == rows and max(values.shape) == rows:
            yield name, _numbers(values.reshape(-1))
            continue
        axes = [k for k, size in enumerate(values.shape) if size == rows]
        if len(axes) != 1:
            continue
        ranges = [range(1) if k == axes[0] else range(n) for k, n in enumerate(values.shape)]
        for place in product(*ranges):
            count += 1
            if count > _MOST_PARTS:
                return
            words = [":" if k == axes[0] else str(n + 1) for k, n in enumerate(place)]
            index = tuple(slice(None) if k == axes[0] else n for k, n in enumerate(place))
            yield f"{name}({','.join(words)})", _numbers(values[index])


def _numbers(values: NDArray[Any]) -> NDArray[Any]:
    return values.astype(complex if values.dtype.kind == "c" else float)
