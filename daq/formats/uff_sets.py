"""The data sets of a universal file: data set 58 in ASCII out, `pyuff` in, and a private one.

Owns the columns and the delimiters. Written here rather than by `pyuff`, which
turns an unknown value into zero, cannot write a function of one point and
hides the cause of a failure; read by it, and checked. What the functions mean
is none of its business.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError

__all__ = ["GENERAL", "RESPONSE", "data_sets", "function", "private"]

GENERAL, RESPONSE = 0, 4
"""Function types: anything, and frequency response."""

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
        `GENERAL` or `RESPONSE`.
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


def data_sets(
    path: Path, content: bytes, private_number: int
) -> tuple[list[Mapping[str, Any]], str | None]:
    """The functions of a file, and the text of its private data set, None if there is none.

    Raises
    ------
    FileFormatError
        If a delimiter is missing or a function is damaged or of a form that
        cannot be read.
    """
    import pyuff

    if content.count(b"\n") < 2 or not content.lstrip(b"\r\n").startswith(b"    -1"):
        raise FileFormatError(f"{path}: is not a universal file; its first line should hold -1")
    try:
        file = pyuff.UFF(str(path))
        kinds = [int(kind) for kind in file.get_set_types()]
    except Exception as error:
        raise FileFormatError(f"{path}: cannot be read ({_reason(error)})") from error
    if not kinds or sum(_is_delimiter(line) for line in content.splitlines()) % 2:
        raise FileFormatError(f"{path}: a data set has no end; the file is cut short")
    functions = [_function(file, place, path) for place, kind in enumerate(kinds) if kind == 58]
    texts = _private_texts(content, private_number, path) if private_number in kinds else []
    if len(texts) > 1:
        raise FileFormatError(f"{path}: holds data set {private_number} {len(texts)} times")
    return functions, texts[0] if texts else None


def _function(file: Any, place: int, path: Path) -> Mapping[str, Any]:
    try:
        found: Mapping[str, Any] = file.read_sets(place)
        points = len(found["data"])
        whole = points == found["num_pts"] == len(found["x"]) and points > 0
    except Exception as error:
        # pyuff replaces every cause by a sentence of its own.
        raise FileFormatError(
            f"{path}: function {place + 1} is damaged or of a form that cannot be read "
            f"({_reason(error)}); save it as ASCII data set 58"
        ) from error
    if not whole:
        raise FileFormatError(
            f"{path}: function {place + 1} should have {found['num_pts']} points, found {points}"
        )
    return found


def _private_texts(content: bytes, number: int, path: Path) -> list[str]:
    try:
        lines = content.decode("ascii").splitlines()
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{path}: is not ASCII (byte {error.start})") from error
    texts: list[str] = []
    for start, line in enumerate(lines):
        if line.strip() != str(number) or not start or lines[start - 1].strip() != "-1":
            continue
        pieces = []
        for piece in lines[start + 1 :]:
            if piece.strip() == "-1":
                break
            if len(piece) < 3 or piece[0] != "|" or piece[-1] != "|":
                raise FileFormatError(f"{path}: a line of data set {number} is damaged: {piece!r}")
            pieces.append(piece[1:-1])
        texts.append("".join(pieces))
    return texts


def _is_delimiter(line: bytes) -> bool:
    return line.startswith(b"    -1") and not line[6:].strip()


def _axis(kind: int, label: str, units: str) -> str:
    return f"{kind:10d}{0:5d}{0:5d}{0:5d} {label or 'NONE':<20.20} {units or 'NONE':<20.20}"


def _line(text: str) -> str:
    # A line of description may be neither blank nor anything but printable
    # ASCII, and must not end like a delimiter.
    plain = "".join(sign if " " <= sign <= "~" else "?" for sign in text)
    return f"{' '.join(plain.split()) or 'NONE':<80.80}"


def _reason(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
