"""The text of a CSV file of ours, taken apart: comments, header, and rows with their lines.

Owns the grammar of that text. What comments and columns mean, and which values can be, is not its
business.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.untrusted.bounded_text import parse_toml, read_bytes

__all__ = ["COLUMNS", "Table", "has_our_header", "is_ours", "parsed", "text_of"]

COLUMNS = ("frequency_hz", "source_vpk", "gain_db", "phase_deg", "gain_std_db")
"""The header, in this order."""

_LIMIT_BYTES = 64 << 20
"""Size above which a file is not read; a million readings have less."""

_HEAD_BYTES = 1 << 16
_KEY = re.compile(
    r"^#\s*(unit|sweep|settle_cycles|integrate_cycles|from_rest|gain_std_is|kind)\s*=", re.MULTILINE
)
_MAY_BE_EMPTY = ("phase_deg", "gain_std_db")
_PLAIN = re.compile(r"[0-9+\-.eE, \r]*\Z")
"""Characters of which Python makes no number but one that `_NUMBER` is, too."""
_CHUNK = 1 << 18
"""Characters that are taken apart at once."""
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\Z")


@dataclass(frozen=True, slots=True)
class Table:
    """What the lines of a file hold: the comments, and the rows with their line numbers."""

    path: Path
    comments: dict[str, Any]
    lines: NDArray[np.int64]
    columns: NDArray[np.float64]

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return self.columns[:, COLUMNS.index(name)]


def is_ours(path: Path) -> bool:
    """Whether a file has a comment key or three columns of this format, or cannot be read at all.

    What is no text in UTF-8 is not: another program wrote it.
    """
    text = _head_of(path)
    if not text.strip() or _KEY.search(text):
        return True
    names = _names_in(text)
    return names == [""] or len(set(names) & set(COLUMNS)) > 2


def has_our_header(path: Path) -> bool:
    """Whether the header of a file is that of this format."""
    return tuple(_names_in(_head_of(path))) == COLUMNS


def _head_of(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return file.read(_HEAD_BYTES).decode("utf-8-sig", "replace")
    except (OSError, ValueError):
        return ""


def _names_in(text: str) -> list[str]:
    """The cells of the first line that is no comment; one empty cell where there is none."""
    lines = (line.strip() for line in text.split("\n"))
    header = next((line for line in lines if line and not line.startswith("#")), "")
    return [name.strip() for name in header.split(",")]


def parsed(text: str, path: Path) -> Table:
    """The comments and rows of a text.

    Raises
    ------
    FileFormatError
        If a line is none that the format has; names it.
    """
    chunks = _chunks(text)
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
    return Table(path, comments, np.concatenate(numbers), np.concatenate(parts))


def _chunks(text: str) -> Iterator[list[str]]:
    """The lines of a text, some thousands at a time."""
    start = 0
    while start <= len(text):
        end = text.find("\n", start + _CHUNK)
        end = len(text) if end < 0 else end
        yield text[start:end].split("\n")
        start = end + 1


def text_of(path: Path) -> str:
    """What a file holds, as text in UTF-8.

    Raises
    ------
    FileFormatError
        If it cannot be read, or is no such text.
    """
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
        raise FileFormatError(
            f"{path}: no header; {found}; {wanted}; a table that another program saved is read "
            "with --as-guessed or --column"
        )
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
