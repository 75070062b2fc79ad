"""Columns of a response that a CSV's table has no place for, as comment keys.

Owns those keys: one list each, a value per row, complex ones as pairs. They
are written only where something is known, and read back to the last digit.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.believable import disbelief
from daq.frf import FrequencyResponse

__all__ = ["EXTRA_KEYS", "extra_columns", "extra_comments"]

_COLUMNS: Mapping[str, tuple[str, bool]] = {
    "point_phase_std_deg": ("phase_std_deg", False),
    "point_dc_v": ("dc_v", False),
    "point_harmonic2": ("harmonic2", True),
    "point_harmonic3": ("harmonic3", True),
}
EXTRA_KEYS = tuple(_COLUMNS)
"""Comment keys that this module writes and reads."""


def extra_comments(response: FrequencyResponse) -> dict[str, Any]:
    """The keys of a response's further columns; none for a column where nothing is known."""
    comments: dict[str, Any] = {}
    for key, (name, is_complex) in _COLUMNS.items():
        values = getattr(response, name)
        if not np.all(np.isnan(values)):
            comments[key] = np.column_stack([values.real, values.imag]) if is_complex else values
    return comments


def extra_columns(comments: Mapping[str, Any], rows: int, path: Path) -> dict[str, Any]:
    """The columns behind the keys of a file.

    Raises
    ------
    FileFormatError
        If a key holds anything but one number (or pair) per row, or one that cannot be.
    """
    columns: dict[str, Any] = {}
    for key, (name, is_complex) in _COLUMNS.items():
        if key in comments:
            shape = (rows, 2) if is_complex else (rows,)
            values = _numbers(comments[key], shape, key, path)
            columns[name] = values.view(complex)[:, 0] if is_complex else values
            found = disbelief(key, columns[name])
            if found is not None:
                raise FileFormatError(f"{path}: row {found[0] + 1}: {found[1]}")
    return columns


def _numbers(held: Any, shape: tuple[int, ...], key: str, path: Path) -> NDArray[np.float64]:
    try:
        values = np.array(held)
    except ValueError:
        values = np.empty(0)
    if values.shape != shape or values.dtype.kind not in "fiu" or np.any(np.isinf(values)):
        pairs = "pairs of numbers" if len(shape) == 2 else "numbers"
        raise FileFormatError(f"{path}: {key} must be {shape[0]} {pairs}, one per row")
    return np.ascontiguousarray(values, dtype=float)
