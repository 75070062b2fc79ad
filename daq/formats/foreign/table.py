"""The table of numbers in a text of another program: where it is, and what its cells hold.

Owns separators, decimal marks, quotes, preambles and header lines. A table with any row that does
not fit is refused whole, with its line. What a column means is not its business.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError

__all__ = ["SEPARATORS", "Separator", "Table", "table_in"]

Separator = Literal["tab", "semicolon", "comma", "bar", "blanks"]
SEPARATORS: dict[Separator, str] = {
    "tab": "\t",
    "semicolon": ";",
    "comma": ",",
    "bar": "|",
    "blanks": "",
}
"""Separators by name, in the order in which they are preferred."""

_SAMPLE = 300
_LONGEST = 60_000
"""Characters of a line; a thousand columns have less."""
_COMMENT = ("#", "%", "*", ";", "!", "//", "'")
_MISSING = frozenset({"", "nan", "-nan", "n/a", "na", "-", "--", "---", "none", "null", "—"})
_POINT = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eEdD][+-]?[0-9]{1,3})?\Z")
_COMMA = re.compile(r"[+-]?(?:[0-9]+(?:,[0-9]+)?|,[0-9]+)(?:[eEdD][+-]?[0-9]{1,3})?\Z")
_PART = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_IMAGINARY = r"[+-]\s*(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_COMPLEX = re.compile(rf"\(?\s*({_PART})\s*({_IMAGINARY})\s*\*?[ij]\s*\)?\Z")
_POLAR = re.compile(rf"\(\s*({_PART})\s*dB\s*,\s*({_PART})\s*(?:°|Â°|\ufffd|deg)\s*\)")
_LONG = r"[+-]?[0-9]\.[0-9]+[eE][+-]?[0-9]+"
_PAIR = re.compile(rf"\t\s*({_LONG}),({_LONG})(?=\s*(?:\t|\Z))")
_PAIRS = {"polar": ("magnitude (dB)", "phase (deg)"), "cartesian": ("real", "imag")}
"""What the halves of a pair are, as circuit simulators write complex numbers in one cell."""
_STEP = re.compile(r"\s*Step Information:")
_THOUSANDS = re.compile(r"[+-]?[0-9]{1,3},[0-9]{3}\Z")


@dataclass(frozen=True, slots=True)
class Table:
    """A table.

    Parameters
    ----------
    columns
        One array of shape (rows,) for each column, real or complex; NaN where a cell is empty.
    names
        Header of each column, its unit in parentheses where that stood in a line of its own;
        empty texts where there is no header.
    lines
        Number of the line of each row, counted from 1.
    preamble
        The lines above, without the header.
    separator
        A name of `SEPARATORS`.
    decimal
        The decimal mark.
    doubt
        What is in doubt of the way in which numbers were read; empty if nothing is.
    """

    columns: tuple[NDArray[Any], ...]
    names: tuple[str, ...]
    lines: NDArray[np.int64]
    preamble: tuple[str, ...]
    separator: Separator
    decimal: Literal[".", ","]
    doubt: str = ""


@dataclass(frozen=True, slots=True)
class _Form:
    """A way to take lines apart."""

    separator: Separator
    decimal: Literal[".", ","]

    def cells(self, line: str) -> list[str]:
        mark = SEPARATORS[self.separator]
        if not mark:
            return [word.strip('"') for word in line.split()]
        if '"' in line:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=mark))]
        return [cell.strip() for cell in line.split(mark)]

    def number(self, cell: str) -> complex | float | None:
        """The value of a cell, NaN where it is missing, None where it holds something else."""
        pattern = _POINT if self.decimal == "." else _COMMA
        if pattern.match(cell):
            return float(cell.replace(",", ".").replace("d", "e").replace("D", "e"))
        if cell.lower() in _MISSING:
            return float("nan")
        found = _COMPLEX.match(cell) if self.decimal == "." else None
        if found:
            return complex(float(found[1]), float(found[2].replace(" ", "")))
        return None

    def row(self, line: str) -> list[complex | float] | None:
        """The values of a line, None where it is no row of at least two numbers."""
        values = [self.number(cell) for cell in self.cells(line)]
        if len(values) < 2 or any(value is None for value in values):
            return None
        known = [value for value in values if value is not None]
        # A row begins with a number, and holds another.
        numbers = sum(value == value for value in known)
        return known if numbers >= 2 and known[0] == known[0] else None


def table_in(
    text: str, path: Path, separator: str | None = None, decimal: str | None = None
) -> Table:
    """The table of a text.

    Parameters
    ----------
    separator, decimal
        What is known of the form; found out if left out.

    Raises
    ------
    FileFormatError
        If there is no table of at least two columns and rows, or a line in it is no row.
    """
    lines = text.splitlines()
    for k, line in enumerate(lines, start=1):
        if len(line) > _LONGEST:
            raise FileFormatError(
                f"{path}, line {k}: has {len(line)} characters, more than any row; give a table"
            )
    lines, pairs = _spread(lines)
    form, width = _form(lines, path, separator, decimal)
    first = next(k for k, line in enumerate(lines) if _is_row(form, line, width))
    numbers, rows = [], []
    for k, line in enumerate(lines[first:], start=first):
        plain = line.strip()
        if not plain or plain.startswith(_COMMENT):
            continue
        row = form.row(line)
        if row is None or len(row) != width:
            raise FileFormatError(
                f"{path}, line {k + 1}: is no row of {width} numbers as those above: "
                f"{plain[:50]!r}; mend or take out what stands there"
            )
        numbers.append(k + 1)
        rows.append(row)
    table = np.array(rows)
    if width > 2 and np.all(np.isnan(table[:, -1])):
        # Some programs end each line with a separator.
        width -= 1
    names, used = _header(lines[:first], form, width, pairs)
    preamble = tuple(line for k, line in enumerate(lines[:first]) if k not in used)
    columns = tuple(_column(table[:, k]) for k in range(width))
    return Table(
        columns, names, np.array(numbers), preamble, form.separator, form.decimal,
        _doubt(lines[first:], form),
    )  # fmt: skip


def _column(values: NDArray[Any]) -> NDArray[Any]:
    if values.dtype.kind == "c" and not np.any(np.imag(values) != 0.0):
        return np.asarray(np.real(values))
    return values


def _spread(lines: list[str]) -> tuple[list[str], str]:
    """Lines whose pairs are columns of their own, and which kind of `_PAIRS` there was."""
    if any(_POLAR.search(line) for line in lines[: 2 * _SAMPLE]):
        return [_POLAR.sub(r"\1\t\2", line) for line in lines], "polar"
    if any(_PAIR.search(line) for line in lines[: 2 * _SAMPLE]):
        return [_PAIR.sub(r"\t\1\t\2", line) for line in lines], "cartesian"
    return lines, ""


def _is_row(form: _Form, line: str, width: int) -> bool:
    row = None if line.lstrip().startswith(_COMMENT) else form.row(line)
    return row is not None and len(row) == width


def _form(
    lines: Sequence[str], path: Path, separator: str | None, decimal: str | None
) -> tuple[_Form, int]:
    """The form by which most lines are rows, and how many cells these have."""
    sample = [line for line in lines if line.strip()]
    if len(sample) > 2 * _SAMPLE:
        # A preamble may be long: look at both ends.
        sample = sample[:_SAMPLE] + sample[-_SAMPLE:]
    best: tuple[int, int, _Form] | None = None
    for form in _forms(separator, decimal):
        widths = Counter(
            len(row)
            for line in sample
            if not line.lstrip().startswith(_COMMENT) and (row := form.row(line)) is not None
        )
        if not widths:
            continue
        width, count = max(widths.items(), key=lambda found: (found[1], found[0]))
        if count >= 2 and (best is None or (count, width) > best[:2]):
            best = (count, width, form)
    if best is None:
        raise FileFormatError(
            f"{path}: holds no table of at least two columns and two rows of numbers"
        )
    return best[2], best[1]


def _forms(separator: str | None, decimal: str | None) -> Iterator[_Form]:
    for mark in (".", ","):
        for name in SEPARATORS:
            if separator in (None, name) and decimal in (None, mark):
                yield _Form(name, "." if mark == "." else ",")


def _header(
    lines: Sequence[str], form: _Form, width: int, pairs: str
) -> tuple[tuple[str, ...], frozenset[int]]:
    """Names of the columns, and which of the lines above the table they are."""
    # A circuit simulator names the step of a parameter below the header.
    filled = [k for k, line in enumerate(lines) if line.strip() and not _STEP.match(line)]
    if not filled:
        return ("",) * width, frozenset()
    last = _names(lines[filled[-1]], form, width, pairs)
    if last is None:
        return ("",) * width, frozenset()
    above = _names(lines[filled[-2]], form, width, pairs) if len(filled) > 1 else None
    if above and _are_units(last) and not any(_is_unit(cell) for cell in above if cell):
        units = [cell.strip("()[] ") for cell in last]
        named = tuple(
            f"{name} ({unit})" if unit else name for name, unit in zip(above, units, strict=True)
        )
        return named, frozenset(filled[-2:])
    return tuple(last), frozenset(filled[-1:])


def _are_units(cells: Sequence[str]) -> bool:
    """Whether a line holds units: half of its cells that say something, and nothing long."""
    said = [cell for cell in cells if cell.strip("()[] ")]
    known = sum(_is_unit(cell) for cell in said)
    return bool(said) and 2 * known >= len(said) and all(len(cell) <= 9 for cell in said)


def _is_unit(cell: str) -> bool:
    """Whether a cell can be a unit alone: short, or in brackets."""
    plain = cell.strip()
    return len(plain.strip("()[]")) <= 7 and (
        plain[:1] in ("(", "[") or plain.lower().strip("()[]") in _UNITS or not plain
    )


_UNITS = frozenset(
    ("hz", "khz", "rad/s", "rad/sec", "rpm", "db", "deg", "rad", "degrees", "degree", "°")
    + ("v/v", "vpk", "vrms", "vpp", "v", "lin", "-", "1", "%")
)


def _names(line: str, form: _Form, width: int, pairs: str) -> list[str] | None:
    """The cells of a line that may be names of as many columns; None where it is none."""
    plain = line.strip().lstrip("#%*!;/").strip()
    ways = [
        form.cells(plain),
        re.findall(r'"([^"]*)"', plain),
        [cell.strip() for cell in re.split(r"\t+|\s{2,}", plain)],
    ]
    if not SEPARATORS[form.separator]:
        ways += [
            [cell.strip() for cell in plain.split(",")],
            re.findall(r"[^\s(\[]+(?:\s*[(\[][^)\]]*[)\]])?", plain),
        ]
    for cells in ways:
        if len(cells) == width + 1 and not cells[-1]:
            cells = cells[:-1]
        if pairs and 2 * len(cells) - 1 == width:
            cells = [cells[0]] + [f"{c} {half}" for c in cells[1:] for half in _PAIRS[pairs]]
        if len(cells) == width and any(re.search(r"[^\W\d_]|°", cell) for cell in cells):
            return [" ".join(cell.strip('"').split()) for cell in cells]
    return None


def _doubt(lines: Sequence[str], form: _Form) -> str:
    """Whether a decimal comma may as well set thousands apart."""
    if form.decimal == ".":
        return ""
    seen = [c for line in lines[:_SAMPLE] for c in form.cells(line) if "," in c]
    if seen and all(_THOUSANDS.match(cell) for cell in seen):
        return f"whether the comma in {seen[0]} is a decimal mark"
    return ""
