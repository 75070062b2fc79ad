"""Exchange formats of a frequency response, chosen by the suffix of the file.

Each format is one module with ``read(path, reading)`` and, where it can be written,
``write(response, path)``; it is imported when a file of its kind is met, so
that a heavy library is loaded by those who need it. Binary formats are read in
a child process (`daq.formats.apart`). No format interprets what it reads, and none
takes half of a file.
"""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from daq.errors import FileFormatError, InputError
from daq.formats.believable import disbelief
from daq.formats.reading import NOTHING_TOLD, Reading
from daq.frf import FrequencyResponse

if TYPE_CHECKING:
    from daq.formats.foreign.text import Layout

__all__ = [
    "READABLE",
    "WRITABLE",
    "NOTHING_TOLD",
    "Reading",
    "check_writable",
    "foreign_layout",
    "read_response",
    "write_response",
]

READABLE = {
    ".csv": "daq.formats.csv",
    ".h5": "daq.formats.hdf5",
    ".hdf5": "daq.formats.hdf5",
    ".uff": "daq.formats.uff",
    ".unv": "daq.formats.uff",
    ".mat": "daq.formats.mat",
    ".sdf": "daq.formats.sdf",
    ".dat": "daq.formats.sdf",
    ".txt": "daq.formats.foreign.text",
    ".tsv": "daq.formats.foreign.text",
    ".asc": "daq.formats.foreign.text",
    ".prn": "daq.formats.foreign.text",
    ".frd": "daq.formats.foreign.text",
    ".xml": "daq.formats.foreign.dtt",
}
"""Module that reads files of each suffix."""

_BINARY = frozenset(
    {"daq.formats.hdf5", "daq.formats.mat", "daq.formats.sdf", "daq.formats.foreign.dtt"}
)
"""Modules whose files are read in a child process: a damaged one can end the process."""

WRITABLE = {suffix: READABLE[suffix] for suffix in (".csv", ".h5", ".hdf5", ".uff", ".unv", ".mat")}
"""Module that writes files of each suffix; the others belong to other programs."""
_TEXT = "daq.formats.foreign.text"
_SDF_MARK = b"B\x00"


def read_response(path: str | Path, reading: Reading = NOTHING_TOLD) -> FrequencyResponse:
    """Read a frequency response from a file; its suffix names the format.

    Parameters
    ----------
    reading
        What the file does not say itself.

    Returns
    -------
    FrequencyResponse
        `daq.formats.reading.remarks_of` tells what was left out or taken for granted.

    Raises
    ------
    FileFormatError
        If the file is missing or any part of it is wrong; nothing of it is taken.
    InputError
        If the suffix is not that of a format that can be read, or `reading` says something that
        the file states otherwise or has no use for.
    """
    path = Path(path)
    response = reading.completed(_read(_reader(path, reading), path, reading), path)
    try:
        found = disbelief("dc_offset_v", [response.dc_offset_v])
    except InputError as error:
        raise FileFormatError(f"{path}: {error}") from error
    if found is not None:
        raise FileFormatError(f"{path}: {found[1]}")
    return response


def foreign_layout(path: str | Path, reading: Reading = NOTHING_TOLD) -> Layout | None:
    """How a text of another program is laid out, guesses included; None for any other file.

    Raises
    ------
    FileFormatError, InputError
        As `read_response`, but for a layout that could only be guessed.
    """
    path = Path(path)
    if _reader(path, reading) != _TEXT:
        return None
    from daq.formats.foreign.text import layout_of

    return layout_of(path, reading)


def _reader(path: Path, reading: Reading) -> str:
    """The module that reads a file: by its suffix, and by what it holds where that leaves two."""
    module = _module(path, READABLE, "read")
    if module == "daq.formats.csv":
        from daq.formats.csv_text import has_our_header, is_ours

        told = reading.profile or reading.columns or reading.as_guessed
        foreign = not is_ours(path) or (told and not has_our_header(path))
        return _TEXT if foreign else module
    if path.suffix.lower() == ".dat" and _is_text(path):
        return _TEXT
    return module


def _read(module: str, path: Path, reading: Reading) -> FrequencyResponse:
    if module in _BINARY:
        from daq.formats.apart import read_apart

        return read_apart(module, path, reading)
    response: FrequencyResponse = import_module(module).read(path, reading)
    return response


def _is_text(path: Path) -> bool:
    """Whether a file whose suffix may mean either is a table as text, not the analyser's own."""
    try:
        with path.open("rb") as file:
            head = file.read(512)
    except OSError:
        return False
    return not head.startswith(_SDF_MARK) and b"\x00" not in head.strip(b"\x00") and bool(head)


def write_response(response: FrequencyResponse, path: str | Path) -> None:
    """Write a frequency response to a file; its suffix names the format.

    The file appears whole or not at all, and replaces one of the same name.

    Raises
    ------
    InputError
        If the suffix is not that of a format that can be written, or the file
        cannot be made where it is wanted.
    """
    import_module(_module(path, WRITABLE, "write")).write(response, Path(path))


def check_writable(path: str | Path, *reads: str | Path) -> None:
    """Find out before long work whether a response could be written to a path.

    Parameters
    ----------
    reads
        What the same work reads; none of these files is written over.

    Raises
    ------
    InputError
        If the suffix is not that of a format that can be written, or the place
        is not one where a file can be made, or one of `reads`.
    """
    from daq.formats.atomic import checked_target

    _module(path, WRITABLE, "write")
    checked_target(Path(path), *reads)


def _module(path: str | Path, known: dict[str, str], verb: str) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in known and os.path.isdir(path):
        raise InputError(f"{path}: is a directory; give a file")
    if suffix not in known:
        raise InputError(
            f"{path}: cannot {verb} files that end in {suffix or 'nothing'!r}; "
            f"use one of: {', '.join(known)}"
        )
    return known[suffix]
