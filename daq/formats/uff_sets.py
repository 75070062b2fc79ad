"""The data sets of a universal file that we write: data set 58 in ASCII, and a private one.

Owns their columns and delimiters. Written here rather than by `pyuff`, which
turns an unknown value into zero and cannot write a function of one point. What
the functions mean is none of its business.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.foreign.uff_sets import DataSet

__all__ = ["GENERAL", "function", "private", "private_text"]

GENERAL = 0
"""Function type: anything."""

_DELIMITER = "    -1\n"
_REAL, _COMPLEX = 4, 6
_UNEVEN = 0
_FREQUENCY, _GENERAL_AXIS = 18, 1
_PIECE = 76


def function(
    kind: int,
    frequency_hz: NDArray[np.float64],
    values: NDArray[Any],
    level_vpk: float,
    label: str,
    units: str,
    head: Sequence[str],
) -> str:
    """A function as data set 58, double precision, uneven abscissa.

    Parameters
    ----------
    kind
        Function type: `GENERAL`, or that of a frequency response.
    frequency_hz, values
        Shape (points,); values real or complex, all finite.
    level_vpk
        Source level, on the third axis; NaN leaves it out.
    label, units
        Of the ordinate, up to 20 characters.
    head
        Five lines of description.
    """
    known = np.isfinite(level_vpk)
    is_complex = np.iscomplexobj(values)
    lines = [_line(text) for text in head]
    lines += [
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {'NONE':<10}{1:10d}{0:4d} {'NONE':<10}{1:10d}{0:4d}",
        f"{_COMPLEX if is_complex else _REAL:10d}{len(values):10d}{_UNEVEN:10d}"
        f"{0:13.5e}{0:13.5e}{level_vpk if known else 0:13.5e}",
        _axis(_FREQUENCY, "frequency", "Hz"),
        _axis(0, label, units),
        _axis(0, "", ""),
        _axis(_GENERAL_AXIS, "source level", "V peak") if known else _axis(0, "", ""),
    ]
    if is_complex:
        lines += [
            f"{x:13.5e}{y.real:20.12e}{y.imag:20.12e}"
            for x, y in zip(frequency_hz, values, strict=True)
        ]
    else:
        pairs = [f"{x:13.5e}{y:20.12e}" for x, y in zip(frequency_hz, values, strict=True)]
        lines += ["".join(pairs[start : start + 2]) for start in range(0, len(pairs), 2)]
    return f"{_DELIMITER}{58:6d}\n" + "\n".join(lines) + "\n" + _DELIMITER


def private(number: int, text: str) -> str:
    """ASCII text of any length as a data set of a private number.

    Each line stands between bars, so that none can look like a delimiter.
    """
    pieces = [text[start : start + _PIECE] for start in range(0, len(text), _PIECE)]
    body = "".join(f"|{piece}|\n" for piece in pieces)
    return f"{_DELIMITER}{number:6d}\n{body}{_DELIMITER}"


def private_text(sets: Sequence[DataSet], number: int, path: Path) -> str | None:
    """The text of a private data set, None where there is none.

    Raises
    ------
    FileFormatError
        If a line of it is damaged, or there are several.
    """
    found = [one for one in sets if one.number == number]
    if not found:
        return None
    if len(found) > 1:
        raise FileFormatError(f"{path}: holds data set {number} {len(found)} times")
    pieces = []
    for line in found[0].lines:
        try:
            piece = line.decode("ascii").rstrip("\r\n")
        except UnicodeDecodeError as error:
            raise FileFormatError(f"{path}: data set {number} is not ASCII") from error
        if len(piece) < 3 or piece[0] != "|" or piece[-1] != "|":
            raise FileFormatError(f"{path}: a line of data set {number} is damaged: {piece!r}")
        pieces.append(piece[1:-1])
    return "".join(pieces)


def _axis(kind: int, label: str, units: str) -> str:
    return f"{kind:10d}{0:5d}{0:5d}{0:5d} {label or 'NONE':<20.20} {units or 'NONE':<20.20}"


def _line(text: str) -> str:
    # A line of description may be neither blank nor anything but printable
    # ASCII, and must not end like a delimiter.
    plain = "".join(sign if " " <= sign <= "~" else "?" for sign in text)
    return f"{' '.join(plain.split()) or 'NONE':<80.80}"
