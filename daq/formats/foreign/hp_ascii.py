"""Traces that an HP or Agilent analyser saved as ASCII: three or four files of one name.

Owns their names and what the header says: NAME.TXT holds the ordinate as it was displayed, NAME.X
the abscissa, NAME.HDR the headers of the Standard Data Format as text.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.foreign.decoding import text_in
from daq.formats.foreign.table import Table

__all__ = ["is_hp_ascii", "table_of_hp_ascii"]

_ENTRY = re.compile(r"^(\S+)[ \t]+(.*?)[ \t\r]*$", re.MULTILINE)
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\Z")


def is_hp_ascii(path: Path) -> bool:
    """Whether a file is the ordinate of such a trace: its abscissa and header lie beside it."""
    return path.suffix.lower() == ".txt" and None not in (
        _beside(path, ".x"),
        _beside(path, ".hdr"),
    )


def table_of_hp_ascii(text: str, path: Path) -> Table:
    """Abscissa and ordinate as a table.

    Raises
    ------
    FileFormatError
        If the header says that it is no frequency response, or the files do not fit each other.
    """
    abscissa, described = _beside(path, ".x"), _beside(path, ".hdr")
    if abscissa is None or described is None:
        raise FileFormatError(f"{path}: the .X and .HDR of its trace do not lie beside it")
    header = dict(_ENTRY.findall(text_in(described)[0]))
    kind = header.get("dataType", "")
    if kind and "RESP" not in kind.upper():
        title = header.get("dataTitle", "").strip('" ')
        raise FileFormatError(
            f"{path}: holds {kind} ({title}), no frequency response; save that trace"
        )
    if header.get("xUnit.label", '"Hz"').strip('" ') != "Hz":
        raise FileFormatError(f"{path}: its abscissa is not in Hz but {header['xUnit.label']}")
    x, y = _numbers(text_in(abscissa)[0], abscissa), _numbers(text, path)
    if len(x) != len(y) or x.shape[1] != 1 or y.shape[1] > 2:
        raise FileFormatError(
            f"{path}: has {len(y)} rows of {y.shape[1]} and {abscissa.name} {len(x)} of "
            f"{x.shape[1]}; give the files of one trace"
        )
    columns = (x[:, 0], *(y[:, k] for k in range(y.shape[1])))
    names = ("frequency (Hz)", *(("gain",) if y.shape[1] == 1 else ("real", "imag")))
    known = ("applic", "dataTitle", "measType", "averageNum", "yearStamp", "monthDayStamp")
    preamble = tuple(f"{key} {header[key]}" for key in known if key in header)
    return Table(columns, names, 1 + np.arange(len(x)), preamble, "blanks", ".")


def _numbers(text: str, path: Path) -> NDArray[np.float64]:
    rows = [line.replace(",", " ").split() for line in text.splitlines() if line.strip()]
    for k, row in enumerate(rows, start=1):
        if len(row) != len(rows[0]) or not all(_NUMBER.match(word) for word in row):
            raise FileFormatError(f"{path}, line {k}: {' '.join(row)[:40]!r} is no row of numbers")
    if not rows:
        raise FileFormatError(f"{path}: holds no numbers")
    return np.array(rows, dtype=float)


def _beside(path: Path, suffix: str) -> Path | None:
    """The file of the same name with another suffix, in capitals or not."""
    for other in (suffix, suffix.upper()):
        if os.path.isfile(beside := path.with_suffix(other)):
            return beside
    return None
