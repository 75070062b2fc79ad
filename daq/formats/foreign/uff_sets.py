"""Functions of a universal file as others write them: data sets 58 and 58b, taken apart.

Owns the delimiters and columns of the format, in text and binary. `pyuff` is not used to read: it
finds no end of a binary set that stands right behind the data, takes padding for values and hides
the cause of a failure. Nothing is judged here but whether a set is whole.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.foreign.functions import Axis, Function

__all__ = ["DataSet", "function_of", "split_sets"]

_HEAD_LINES = 11
_MOST_POINTS = 4_000_000
_DIRECTIONS = ("", "+X", "+Y", "+Z", "+RX", "+RY", "+RZ")
_DELIMITER = re.compile(rb"[ \t]*-1[ \t]*\r?\n?\Z")
_DELIMITER_BEHIND_DATA = re.compile(rb"[\r\n]*    -1[ \t]*(\r?\n|\r|\Z)")
_NUMBERED = re.compile(r"\s{0,6}([0-9]{1,6})([bB]?)(.*)\Z")
_NUMBERS = re.compile(r"[0-9+\-.E\s]*\Z")
_BARE_EXPONENT = re.compile(r"(?<=[0-9.])([+-][0-9]{3})(?=\s|\Z)")
_REAL_SINGLE, _REAL_DOUBLE, _COMPLEX_SINGLE, _COMPLEX_DOUBLE = 2, 4, 5, 6
_LAYOUT = {
    # Ordinate type, even spacing: widths of the numbers of one line.
    (_REAL_SINGLE, True): (13,) * 6,
    (_REAL_SINGLE, False): (13,) * 6,
    (_COMPLEX_SINGLE, True): (13,) * 6,
    (_COMPLEX_SINGLE, False): (13,) * 6,
    (_REAL_DOUBLE, True): (20,) * 4,
    (_REAL_DOUBLE, False): (13, 20, 13, 20),
    (_COMPLEX_DOUBLE, True): (20,) * 4,
    (_COMPLEX_DOUBLE, False): (13, 20, 20),
}


@dataclass(frozen=True, slots=True)
class DataSet:
    """A data set: its number, the rest of its first line, and what follows up to its end."""

    number: int
    head: str
    lines: tuple[bytes, ...]
    binary: bytes | None = None


def split_sets(content: bytes, path: Path) -> list[DataSet]:
    """The data sets of a file.

    Raises
    ------
    FileFormatError
        If a delimiter or a number is missing, or a binary set is not as long as it says.
    """
    if b"-1" not in content[:4096]:
        raise FileFormatError(f"{path}: is not a universal file; its first line should hold -1")
    sets: list[DataSet] = []
    at = 0
    while True:
        line, after = _line(content, at)
        if not line and after >= len(content):
            break
        if _DELIMITER.match(line):
            found, at = _one_set(content, after, path, len(sets) + 1)
            sets.append(found)
        elif line.strip(b"\r\n\t \x1a\x00"):
            where = "data set 1" if not sets else f"data set {len(sets)}"
            side = "before" if not sets else "behind"
            raise FileFormatError(
                f"{path}: is not a universal file; {side} {where} stands "
                f"{line[:40].decode('latin-1').strip()!r} where a line with -1 should be"
            )
        else:
            at = after
    if not sets:
        raise FileFormatError(f"{path}: is not a universal file; its first line should hold -1")
    return sets


def function_of(data: DataSet, number: int, path: Path) -> Function:
    """A data set 58 as a function.

    Raises
    ------
    FileFormatError
        If anything of it is damaged or missing.
    """
    if len(data.lines) < _HEAD_LINES:
        raise FileFormatError(f"{path}: function {number} is cut short: its description has an end")
    head = [line.decode("latin-1").rstrip("\r\n") for line in data.lines[:_HEAD_LINES]]
    kind = _whole(head[5], 0, 5, f"{path}: function {number}, line 6: the function type")
    form, points, spacing = (
        _whole(head[6], start, start + 10, f"{path}: function {number}, line 7")
        for start in (0, 10, 20)
    )
    first, step, third = (
        _number(head[6][start : start + 13], f"{path}: function {number}, line 7")
        for start in (30, 43, 56)
    )
    if form not in (_REAL_SINGLE, _REAL_DOUBLE, _COMPLEX_SINGLE, _COMPLEX_DOUBLE):
        raise FileFormatError(
            f"{path}: function {number} holds ordinates of the unknown type {form}"
        )
    if spacing not in (0, 1) or not 0 < points <= _MOST_POINTS:
        raise FileFormatError(
            f"{path}: function {number} states {points} points with spacing {spacing}"
        )
    layout = _Layout(form, bool(spacing), points, f"{path}: function {number}")
    numbers = (
        layout.from_text(b"".join(data.lines[_HEAD_LINES:]))
        if data.binary is None
        else layout.from_binary(data.binary, data.head)
    )
    x, values = layout.parted(numbers, first, step)
    axes = [_axis(head[k], f"{path}: function {number}, line {k + 1}") for k in (7, 8, 9, 10)]
    return Function(
        number=number,
        kind=kind,
        titles=tuple(text.strip() for text in head[:5]),
        response=_point(head[5][41:51], head[5][51:55]),
        reference=_point(head[5][66:76], head[5][76:80]),
        names=(_named(head[5][31:41]), _named(head[5][56:66])),
        abscissa=axes[0],
        ordinate=axes[1],
        denominator=axes[2],
        third=axes[3],
        third_value=third,
        x=x,
        values=values,
    )


@dataclass(frozen=True, slots=True)
class _Layout:
    """How the numbers of a function lie, and the check that all are there."""

    form: int
    even: bool
    points: int
    place: str

    @property
    def complex(self) -> bool:
        return self.form in (_COMPLEX_SINGLE, _COMPLEX_DOUBLE)

    @property
    def a_point(self) -> int:
        """Numbers that a point takes."""
        return (2 if self.complex else 1) + (not self.even)

    def from_text(self, block: bytes) -> NDArray[np.float64]:
        text = _BARE_EXPONENT.sub(r"E\1", block.decode("latin-1").upper().replace("D", "E"))
        if not _NUMBERS.match(text):
            raise FileFormatError(f"{self.place} holds something that is no number")
        widths = _LAYOUT[self.form, self.even]
        try:
            numbers = np.array([float(word) for word in text.split()])
        except ValueError:
            # Numbers that fill their columns stand without a blank between.
            numbers = np.array(list(self._by_columns(text, widths)))
        if not np.all(np.isfinite(numbers)):
            raise FileFormatError(f"{self.place} holds a number beyond any that can be")
        needed, found = self.points * self.a_point, len(numbers)
        padding = numbers[needed:]
        # The last line may be filled up.
        if found < needed or len(padding) >= len(widths) or np.any(padding != 0.0):
            raise FileFormatError(
                f"{self.place} should have {self.points} points, found {found / self.a_point:g}"
            )
        return numbers[:needed]

    def _by_columns(self, text: str, widths: tuple[int, ...]) -> Iterator[float]:
        for line in text.splitlines():
            at = 0
            for width in widths:
                cell, at = line[at : at + width].strip(), at + width
                if cell:
                    yield _number(cell, self.place)

    def from_binary(self, block: bytes, head: str) -> NDArray[np.float64]:
        words = head.split()
        order = {"1": "<", "2": ">"}.get(words[0]) if words else None
        if order is None or words[1:2] != ["2"]:
            raise FileFormatError(
                f"{self.place} is binary in a form of DEC or IBM machines, or of none; "
                "save it as ASCII data set 58"
            )
        wide = self.form in (_REAL_DOUBLE, _COMPLEX_DOUBLE)
        x, value = ("", "d" if wide else "f")
        if not self.even:
            x = "f"
        kinds = [(f"v{k}", f"{order}{letter}4" if letter == "f" else f"{order}f8")
                 for k, letter in enumerate(x + value * (2 if self.complex else 1))]  # fmt: skip
        dtype = np.dtype(kinds)
        if len(block) < self.points * dtype.itemsize:
            # Some programs widen the abscissa with the rest.
            raise FileFormatError(
                f"{self.place} should have {self.points} points of {dtype.itemsize} bytes, "
                f"found {len(block)} bytes"
            )
        if not self.even and wide and len(block) >= self.points * 8 * self.a_point:
            dtype = np.dtype([(name, f"{order}f8") for name, _ in kinds])
        table = np.frombuffer(block, dtype, self.points)
        numbers = np.column_stack([table[name].astype(float) for name in dtype.names or ()])
        if not np.all(np.isfinite(numbers)):
            raise FileFormatError(f"{self.place} holds a number that is none")
        return numbers.reshape(-1)

    def parted(
        self, numbers: NDArray[np.float64], first: float, step: float
    ) -> tuple[NDArray[np.float64], NDArray[Any]]:
        """Abscissae and ordinates."""
        table = numbers.reshape(self.points, self.a_point)
        if self.even:
            if self.points > 1 and not step > 0.0:
                raise FileFormatError(f"{self.place} states an abscissa in steps of {step:g}")
            x, rest = np.asarray(first + step * np.arange(self.points), dtype=float), table
        else:
            x, rest = table[:, 0], table[:, 1:]
        values: NDArray[Any] = rest[:, 0] + 1j * rest[:, 1] if self.complex else rest[:, 0].copy()
        return x, values


def _line(content: bytes, at: int) -> tuple[bytes, int]:
    """The line that begins at a byte, with its end, and where the next begins."""
    end = content.find(b"\n", at)
    end = len(content) if end < 0 else end + 1
    return content[at:end], end


def _one_set(content: bytes, at: int, path: Path, number: int) -> tuple[DataSet, int]:
    """The data set whose number stands at a byte, and where the next line begins."""
    line, at = _line(content, at)
    numbered = _NUMBERED.match(line.decode("latin-1").rstrip("\r\n"))
    if numbered is None:
        raise FileFormatError(
            f"{path}: data set {number} has no number, or an end is missing before it"
        )
    kind, rest = int(numbered[1]), numbered[3]
    lines: list[bytes] = []
    if numbered[2] and kind == 58:
        for _ in range(_HEAD_LINES):
            line, at = _line(content, at)
            lines.append(line)
        binary, at = _binary(content, at, rest, lines, f"{path}: data set {number}")
        return DataSet(kind, rest, tuple(lines), binary), at
    while at < len(content):
        line, at = _line(content, at)
        if _DELIMITER.match(line) and line[:6].strip() == b"-1":
            return DataSet(kind, rest, tuple(lines)), at
        lines.append(line)
    raise FileFormatError(f"{path}: data set {number} has no end; the file is cut short")


def _binary(
    content: bytes, at: int, head: str, lines: list[bytes], place: str
) -> tuple[bytes, int]:
    """The bytes of a binary set, and where the line behind its end begins."""
    words = head.split()
    stated = _whole(words[3], 0, 12, f"{place}: number of bytes") if len(words) > 3 else 0
    end = at + stated
    if stated > 0 and (found := _DELIMITER_BEHIND_DATA.match(content, end)):
        return content[at:end], found.end()
    # Some programs state no length or a wrong one: the points tell it.
    form = lines[6].decode("latin-1")
    points = _whole(form, 10, 20, f"{place}: number of points")
    kind, even = _whole(form, 0, 10, place), _whole(form, 20, 30, place) == 1
    if (kind, even) in _LAYOUT and 0 < points <= _MOST_POINTS:
        size = 4 if kind in (_REAL_SINGLE, _COMPLEX_SINGLE) else 8
        count = 2 if kind in (_COMPLEX_SINGLE, _COMPLEX_DOUBLE) else 1
        for abscissa in (0,) if even else (4, size):
            end = at + points * (size * count + abscissa)
            if found := _DELIMITER_BEHIND_DATA.match(content, end):
                return content[at:end], found.end()
    raise FileFormatError(
        f"{place} has no end behind its {stated} bytes; it is cut short, or went through a "
        "program that changes line ends: save it as ASCII data set 58"
    )


def _whole(line: str, start: int, end: int, place: str) -> int:
    text = line[start:end].strip()
    if not re.fullmatch(r"[+-]?[0-9]{1,10}", text):
        raise FileFormatError(f"{place}: {text[:20]!r} is not a whole number")
    return int(text)


def _number(text: str, place: str) -> float:
    text = text.strip().upper().replace("D", "E") or "0"
    if not re.fullmatch(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)(E[+-]?[0-9]+)?", text):
        raise FileFormatError(f"{place}: {text[:20]!r} is not a number")
    return float(text)


def _point(node: str, direction: str) -> str:
    """A degree of freedom, such as ``12:-Z``; a scalar has no direction."""
    code = direction.strip()
    turn = int(code) if re.fullmatch(r"[+-]?[0-6]", code) else 0
    named = _DIRECTIONS[abs(turn)]
    if turn < 0:
        named = "-" + named[1:]
    return f"{node.strip() or '0'}{':' if named else ''}{named}"


def _named(text: str) -> str:
    name = text.strip()
    return "" if name == "NONE" else name


def _axis(line: str, place: str) -> Axis:
    kind = line[:10].strip()
    label, unit = _named(line[26:46]), _named(line[46:67])
    return Axis(_whole(kind, 0, 10, place) if kind else 0, label, unit)
