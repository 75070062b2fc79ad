"""Vectors of a MATLAB file, and the columns of its matrices.

Owns what they are called. It runs in a child process: the library can crash on damaged files.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.reading import NOTHING_TOLD, Reading

__all__ = ["read"]

_MOST_COLUMNS = 64


def read(path: Path, _reading: Reading = NOTHING_TOLD) -> dict[str, NDArray[Any]]:
    """Real vectors by name; columns of matrices as ``name(:,2)``.

    Raises
    ------
    FileFormatError
        If it cannot be read.
    """
    from daq.formats.foreign.arrays import vectors_in_mat

    found: dict[str, NDArray[Any]] = {}
    for name, values in vectors_in_mat(path.read_bytes(), path).items():
        if values.dtype.kind == "c" or values.ndim > 2:
            continue
        matrix = values if values.ndim == 2 else values[:, None]
        if 1 in matrix.shape:
            found[name] = matrix.ravel().astype(float)
        elif min(matrix.shape) <= _MOST_COLUMNS:
            tall = matrix if matrix.shape[0] >= matrix.shape[1] else matrix.T
            for k in range(tall.shape[1]):
                found[f"{name}(:,{k + 1})"] = tall[:, k].astype(float)
    if not found:
        raise FileFormatError(f"{path}: holds no vectors of numbers; give a recording")
    return found
