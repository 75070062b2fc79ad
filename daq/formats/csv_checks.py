"""What the comments and columns of a CSV file of ours may hold, row by row.

Owns those checks; each names the line of the fault. It reads no text and builds no response.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.believable import disbelief
from daq.formats.csv_text import COLUMNS, Table
from daq.frf import PointFlag

__all__ = ["check_order", "check_values", "procedure_of"]

_OUT_OF_ORDER = ("out of order", 'a level must rise (or fall, with sweep = "down")')
_REPEATED = (
    "repeated",
    "take one out, or write '# repeated_points = true' above the header if both were measured",
)


def procedure_of(table: Table, unit_name: str | None = None) -> dict[str, Any]:
    """Fields of the response that the comments fill, checked; a name of the unit may be told."""
    comments, path = table.comments, table.path
    if "unit" not in comments and not unit_name:
        raise FileFormatError(
            f'{path}: no comment names the unit; add a line # unit = "NAME", or give --unit-name'
        )
    unit, sweep = comments.get("unit", unit_name), comments.get("sweep")
    if not isinstance(unit, str) or not unit:
        raise FileFormatError(f"{path}: unit {unit!r} is not a name in quotes")
    if sweep not in (None, "up", "down"):
        raise FileFormatError(f"{path}: sweep {sweep!r} is not 'up' or 'down'")
    for key in ("from_rest", "repeated_points"):
        if not isinstance(comments.get(key), bool | None):
            raise FileFormatError(f"{path}: {key} {comments[key]!r} is not true or false")
    return {
        "unit": unit,
        "direction": sweep,
        "settle_cycles": _count(comments, "settle_cycles", 0, path),
        "integrate_cycles": _count(comments, "integrate_cycles", 1, path),
        "from_rest": comments.get("from_rest"),
        "flags": _flags(table),
    }


def _count(comments: Mapping[str, Any], key: str, least: int, path: Path) -> int | None:
    value = comments.get(key)
    if value is None:
        return None
    if type(value) is not int or value < least:
        raise FileFormatError(f"{path}: {key} {value!r} is not a whole number of {least} or more")
    return value


def _flags(table: Table) -> NDArray[np.int64] | None:
    flags = table.comments.get("point_flags")
    if flags is None:
        return None
    every = sum(PointFlag)
    if (
        not isinstance(flags, list)
        or len(flags) != len(table.lines)
        or any(type(flag) is not int or not 0 <= flag <= every for flag in flags)
    ):
        raise FileFormatError(
            f"{table.path}: point_flags must be {len(table.lines)} whole numbers, one per row, "
            f"each 0 to {every}"
        )
    return np.array(flags, dtype=np.int64)


def check_values(table: Table) -> None:
    """Refuse values that cannot be; a frequency of 0 Hz can, and is left out by whoever reads."""
    for row in np.flatnonzero(table["frequency_hz"] < 0.0):
        _refuse(table, row, f"frequency_hz {table['frequency_hz'][row]:g} is not above 0")
    for row in np.flatnonzero(table["source_vpk"] <= 0.0):
        _refuse(table, row, f"source_vpk {table['source_vpk'][row]:g} is not above 0")
    for row in np.flatnonzero(table["gain_std_db"] < 0.0):
        value = table["gain_std_db"][row]
        _refuse(table, row, f"gain_std_db {value:g} is negative; give 0 or more, or nothing")
    for name in COLUMNS:
        zero = (table[name] == 0.0) & (name == "frequency_hz")
        found = disbelief(name, np.where(zero, np.nan, table[name]))
        if found is not None:
            _refuse(table, *found)


def check_order(table: Table, direction: str | None) -> None:
    """Ascending in each level, or descending where the sweep is said to go down."""
    may_repeat = bool(table.comments.get("repeated_points"))
    for level, rows in _levels(table):
        frequency = table["frequency_hz"][rows]
        if direction == "down" and frequency[0] > frequency[-1]:
            frequency = -frequency
        step = np.diff(frequency)
        wrong = np.flatnonzero(step < 0.0 if may_repeat else step <= 0.0)
        if wrong.size:
            row = int(rows[wrong[0] + 1])
            what, remedy = _REPEATED if step[wrong[0]] == 0.0 else _OUT_OF_ORDER
            _refuse(
                table,
                row,
                f"frequency_hz {table['frequency_hz'][row]:g} is {what} at source level "
                f"{level:g} V; {remedy}",
            )


def _levels(table: Table) -> Iterator[tuple[float, NDArray[np.intp]]]:
    levels, place = np.unique(table["source_vpk"], return_inverse=True)
    order = np.argsort(place, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(place[order])) + 1)
    yield from zip(levels.tolist(), parts, strict=True)


def _refuse(table: Table, row: int | np.intp, fault: str) -> NoReturn:
    raise FileFormatError(f"{table.path}, line {table.lines[int(row)]}: {fault}")
