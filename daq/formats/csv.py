"""Frequency responses as CSV: comment lines in TOML, one header, one row per reading.

Owns the reading and writing of that text and nothing else. A file with any
fault is refused whole, with the line of the fault; no row is dropped, sorted,
repaired or filled in.

::

    # unit = "ADSS"
    # sweep = "up"
    # settle_cycles = 20
    # integrate_cycles = 30
    frequency_hz,source_vpk,gain_db,phase_deg,gain_std_db
    100.0,1.5,-13.935,-144.412,0.3279

`phase_deg` and `gain_std_db` may be empty. Comment keys other than those in
`_PROCEDURE` are provenance and come back as they were. Readings that a session
marked as spoilt are not written as rows but listed under `spoilt_points`. A
frequency that comes twice in a level is a slip, unless `repeated_points` is
true: an analyser sets frequencies in steps, and two that were asked for may
fall on one.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from daq.bounded_text import parse_toml, read_bytes
from daq.errors import FileFormatError, InputError
from daq.formats.atomic import write_text
from daq.formats.believable import disbelief
from daq.formats.csv_columns import EXTRA_KEYS, extra_columns, extra_comments
from daq.formats.toml import toml_key, toml_value
from daq.frf import GAIN_STD_COMPONENTS, GAIN_STD_IS, FrequencyResponse, PointFlag

__all__ = ["COLUMNS", "read", "write"]

COLUMNS = ("frequency_hz", "source_vpk", "gain_db", "phase_deg", "gain_std_db")
"""The header, in this order."""

_LIMIT_BYTES = 64 << 20
"""Size above which a file is not read; a million readings have less."""

_MAY_BE_EMPTY = ("phase_deg", "gain_std_db")
_PROCEDURE = (
    "unit",
    "sweep",
    "settle_cycles",
    "integrate_cycles",
    "from_rest",
    "point_flags",
    "repeated_points",
    "spoilt_points",
    *EXTRA_KEYS,
)
_OUT_OF_ORDER = ("out of order", 'a level must rise (or fall, with sweep = "down")')
_REPEATED = (
    "repeated",
    "take one out, or write '# repeated_points = true' above the header if both were measured",
)
_PLAIN = re.compile(r"[0-9+\-.eE, \r]*\Z")
"""Characters of which Python makes no number but one that `_NUMBER` is, too."""
_CHUNK = 1 << 18
"""Characters that are taken apart at once."""
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\Z")


@dataclass(frozen=True, slots=True)
class _Table:
    """What the lines of a file hold: the comments, and the rows with their line numbers."""

    path: Path
    comments: dict[str, Any]
    lines: NDArray[np.int64]
    columns: NDArray[np.float64]

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return self.columns[:, COLUMNS.index(name)]


def read(path: Path) -> FrequencyResponse:
    """Read a CSV file.

    Returns
    -------
    FrequencyResponse
        Rows in the order of the file. Its provenance holds the file's own
        comment keys, and ``kind = "measured"`` where the file names no kind.

    Raises
    ------
    FileFormatError
        If the file cannot be read or anything in it is wrong; names file, line
        and value.
    """
    table = _parse(path)
    procedure = _procedure(table)
    _check_values(table)
    _check_order(table, procedure["direction"])
    phase = table["phase_deg"]
    known = np.isfinite(phase)
    magnitude = 10.0 ** (table["gain_db"] / 20.0)
    angle = np.radians(np.where(known, phase, 0.0))
    provenance = {k: v for k, v in table.comments.items() if k not in _PROCEDURE}
    if "spoilt_points" in table.comments:
        provenance["spoilt_points"] = table.comments["spoilt_points"]
    if _is_plain(table):
        provenance[GAIN_STD_COMPONENTS] = 2
    return FrequencyResponse.from_arrays(
        table["frequency_hz"],
        table["source_vpk"],
        magnitude * np.exp(1j * angle),
        phase_known=known,
        gain_std_db=table["gain_std_db"],
        **extra_columns(table.comments, len(table.lines), path),
        provenance={"kind": "measured"} | provenance,
        **procedure,
    )


def write(response: FrequencyResponse, path: Path) -> None:
    """Write a CSV file, whole or not at all, with every digit of frequency, gain and phase.

    Raises
    ------
    InputError
        If a reading that is not marked as spoilt has no value, the rows are in
        an order that `read` refuses, the provenance holds something that TOML
        cannot say, or no file can be made at `path`.
    """
    spoilt = (response.flags & PointFlag.SPOILT) != 0
    kept = response.take(~spoilt)
    if len(kept) == 0:
        raise InputError(f"{path}: there is no usable reading to write; measure first")
    columns = np.column_stack(
        [kept.frequency_hz, kept.source_vpk, kept.gain_db, kept.phase_deg, kept.gain_std_db]
    )
    for row in np.flatnonzero(~np.all(np.isfinite(columns[:, :3]), axis=1)):
        why = "is zero: nothing moved" if kept.gain[row] == 0 else "is no finite number"
        raise InputError(
            f"{path}: the gain at {kept.frequency_hz[row]:g} Hz and {kept.source_vpk[row]:g} V "
            f"{why}; drive it harder or mark the reading as spoilt"
        )
    comments = _comments(kept, response.take(spoilt))
    try:
        lines = [f"# {toml_key(key)} = {toml_value(value)}" for key, value in comments.items()]
    except TypeError as error:
        raise InputError(f"{path}: the provenance cannot be written ({error})") from error
    lines.append(",".join(COLUMNS))
    table = _Table(path, comments, len(lines) + 1 + np.arange(len(kept)), columns)
    # What would be refused when it is read is not written.
    _check_values(table)
    _check_order(table, kept.direction)
    extra_columns(comments, len(kept), path)
    lines += [",".join(_cell(value) for value in row) for row in columns.tolist()]
    write_text(path, "\n".join(lines) + "\n")


def _is_plain(table: _Table) -> bool:
    """Whether a file has the keys of this format alone, its cycles, and errors.

    By the format its errors are those of the mean over these cycles. A file that names a `kind`
    came through a program, and one that knows no cycles cannot have counted any.
    """
    stated = {"settle_cycles", "integrate_cycles"} <= table.comments.keys()
    words = {"kind", GAIN_STD_COMPONENTS, GAIN_STD_IS} & table.comments.keys()
    return stated and not words and bool(np.any(table["gain_std_db"] > 0.0))


def _cell(value: float) -> str:
    return repr(value) if np.isfinite(value) else ""


def _comments(kept: FrequencyResponse, spoilt: FrequencyResponse) -> dict[str, Any]:
    """Comment keys in the order in which they are written."""
    comments: dict[str, Any] = {
        "unit": kept.unit,
        "sweep": kept.direction,
        "settle_cycles": kept.settle_cycles,
        "integrate_cycles": kept.integrate_cycles,
        "from_rest": kept.from_rest,
    }
    if np.any(kept.flags):
        comments["point_flags"] = kept.flags
    if len(set(zip(kept.source_vpk, kept.frequency_hz, strict=True))) < len(kept):
        comments["repeated_points"] = True
    comments |= extra_comments(kept)
    comments |= {k: v for k, v in kept.provenance.items() if k not in _PROCEDURE}
    listed = list(kept.provenance.get("spoilt_points", []))
    listed += np.column_stack([spoilt.frequency_hz, spoilt.source_vpk]).tolist()
    if listed:
        comments["spoilt_points"] = listed
    return {key: value for key, value in comments.items() if value is not None}


def _parse(path: Path) -> _Table:
    chunks = _chunks(_text(path))
    comments: dict[str, Any] = {}
    header, number, rest = "", 0, []
    while not header and (lines := next(chunks, None)) is not None:
        for place, line in enumerate(map(str.strip, lines)):
            number += 1
            if line.startswith("#"):
                _add_comment(comments, line[1:].strip(), f"{path}, line {number}")
            elif line:
                header, rest = line, lines[place + 1 :]
                break
    _check_header(path, header)
    numbers, parts = [], []
    for lines in chain([rest], chunks):
        kept = [(number + k, line) for k, line in enumerate(lines, start=1) if line.strip()]
        number += len(lines)
        if kept:
            numbers.append(np.array([at for at, _ in kept]))
            parts.append(_rows(kept, path))
    if not parts:
        raise FileFormatError(f"{path}: has a header but no rows; give a whole file")
    return _Table(path, comments, np.concatenate(numbers), np.concatenate(parts))


def _chunks(text: str) -> Iterator[list[str]]:
    """The lines of a text, some thousands at a time."""
    start = 0
    while start <= len(text):
        end = text.find("\n", start + _CHUNK)
        end = len(text) if end < 0 else end
        yield text[start:end].split("\n")
        start = end + 1


def _text(path: Path) -> str:
    if os.path.isdir(path):
        raise FileFormatError(f"{path}: is a directory; give a CSV file")
    try:
        content = read_bytes(path, _LIMIT_BYTES)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileFormatError(f"{path}: cannot be read ({reason}); give a CSV file") from error
    if not content.strip():
        raise FileFormatError(f"{path}: is empty; give a CSV file with a header and rows")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(
            f"{path}: is not text in UTF-8 (byte {error.start}); save it as a CSV in UTF-8"
        ) from error
    if "\x00" in text:
        raise FileFormatError(f"{path}: is not text (it holds zero bytes); give a CSV")
    return text


def _add_comment(comments: dict[str, Any], text: str, place: str) -> None:
    if not text:
        return
    try:
        if text.startswith("["):
            raise ValueError("a section has no place here")
        entry = parse_toml(text)
    except ValueError as error:
        raise FileFormatError(
            f"{place}: comment {_shown(text)} is not 'key = value' in TOML ({error}); "
            "write '# notes = \"...\"', or leave it out"
        ) from error
    for key, value in entry.items():
        if key in comments:
            raise FileFormatError(f"{place}: {key!r} is given twice; give it once")
        comments[key] = value


def _check_header(path: Path, header: str) -> None:
    names = tuple(name.strip() for name in header.split(","))
    if names == COLUMNS:
        return
    wanted = f"the header must be {','.join(COLUMNS)}"
    if not set(names) & set(COLUMNS):
        found = f"found {_shown(header)}" if header else "found none"
        raise FileFormatError(f"{path}: no header; {found}; {wanted}")
    unknown = [_shown(name) for name in names if name not in COLUMNS]
    missing = [name for name in COLUMNS if name not in names]
    faults = []
    if missing:
        faults.append(f"column {', '.join(missing)} is missing")
    if unknown:
        faults.append(f"column {', '.join(unknown)} is not known")
    raise FileFormatError(
        f"{path}: {'; '.join(faults) or 'columns repeated or out of order'}; {wanted}"
    )


def _rows(kept: list[tuple[int, str]], path: Path) -> NDArray[np.float64]:
    """Values (lines, columns) of numbered lines: at once where all are plain, else line by line."""
    values = _plain_rows([line for _, line in kept])
    if values is None:
        values = np.array([_row(line, f"{path}, line {at}") for at, line in kept], dtype=float)
    return values


def _plain_rows(lines: list[str]) -> NDArray[np.float64] | None:
    """The values of lines that hold five numbers each, or nothing where that may be; else None."""
    if any(line.count(",") != len(COLUMNS) - 1 for line in lines):
        return None
    text = ",".join(lines)
    if not _PLAIN.fullmatch(text):
        return None
    try:
        flat = [float(cell) if cell else math.nan for cell in text.split(",")]
    except ValueError:
        return None
    values = np.array(flat).reshape(len(lines), len(COLUMNS))
    full = [name not in _MAY_BE_EMPTY for name in COLUMNS]
    sound = not np.any(np.isinf(values)) and not np.any(np.isnan(values[:, full]))
    return values if sound else None


def _row(line: str, place: str) -> list[float]:
    if line.lstrip().startswith("#"):
        raise FileFormatError(f"{place}: a comment after the header; move it above the header")
    cells = [cell.strip() for cell in line.split(",")]
    if len(cells) != len(COLUMNS):
        raise FileFormatError(
            f"{place}: {len(cells)} values where the header has {len(COLUMNS)} columns: "
            f"{_shown(line.strip())}"
        )
    return [_number(cell, name, place) for cell, name in zip(cells, COLUMNS, strict=True)]


def _number(cell: str, name: str, place: str) -> float:
    if not cell:
        if name in _MAY_BE_EMPTY:
            return float("nan")
        raise FileFormatError(f"{place}: {name} is empty; give a number")
    # Python would also take "nan", "1_000" and digits of other scripts.
    value = float(cell) if _NUMBER.match(cell) else float("nan")
    if not np.isfinite(value):
        raise FileFormatError(f"{place}: {name} {_shown(cell)} is not a finite number")
    return value


def _shown(text: str) -> str:
    return repr(text if len(text) <= 60 else text[:57] + "...")


def _procedure(table: _Table) -> dict[str, Any]:
    """Fields of the response that the comments fill, checked."""
    comments, path = table.comments, table.path
    if "unit" not in comments:
        raise FileFormatError(f'{path}: no comment names the unit; add a line # unit = "NAME"')
    unit, sweep = comments["unit"], comments.get("sweep")
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


def _flags(table: _Table) -> NDArray[np.int64] | None:
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


def _check_values(table: _Table) -> None:
    for name in ("frequency_hz", "source_vpk"):
        for row in np.flatnonzero(table[name] <= 0.0):
            _refuse(table, row, f"{name} {table[name][row]:g} is not above 0")
    for row in np.flatnonzero(table["gain_std_db"] < 0.0):
        value = table["gain_std_db"][row]
        _refuse(table, row, f"gain_std_db {value:g} is negative; give 0 or more, or nothing")
    for name in COLUMNS:
        found = disbelief(name, table[name])
        if found is not None:
            _refuse(table, *found)


def _check_order(table: _Table, direction: str | None) -> None:
    """Ascending in each level, or descending where the sweep is said to go down."""
    may_repeat = bool(table.comments.get("repeated_points"))
    for level, rows in _levels(table):
        frequency = table["frequency_hz"][rows]
        if direction == "down" and frequency[0] > frequency[-1]:
            frequency = -frequency
        step = np.diff(frequency)
        wrong = np.flatnonzero(step < 0.0 if may_repeat else step <= 0.0)
        if wrong.size:
            row = rows[wrong[0] + 1]
            what, remedy = _REPEATED if step[wrong[0]] == 0.0 else _OUT_OF_ORDER
            _refuse(
                table,
                row,
                f"frequency_hz {table['frequency_hz'][row]:g} is {what} at source level "
                f"{level:g} V; {remedy}",
            )


def _levels(table: _Table) -> Iterator[tuple[float, NDArray[np.intp]]]:
    levels, place = np.unique(table["source_vpk"], return_inverse=True)
    order = np.argsort(place, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(place[order])) + 1)
    yield from zip(levels.tolist(), parts, strict=True)


def _refuse(table: _Table, row: int | np.intp, fault: str) -> NoReturn:
    raise FileFormatError(f"{table.path}, line {table.lines[int(row)]}: {fault}")
