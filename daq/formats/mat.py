"""Frequency responses as MATLAB files (version 5), one variable per array.

Owns that layout: column vectors under the names of the response's arrays, and
the rest of it as a JSON text in the variable `document` (in MATLAB:
``jsondecode(document)``). The text at the head of the file carries a digest of
what follows, which tells damage. scipy's reader can crash on a file that was made
to harm, so `daq.formats` calls `read` in a child process.
"""

from __future__ import annotations

import hashlib
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from daq.errors import FileFormatError
from daq.formats.atomic import replacing
from daq.formats.reading import NOTHING_TOLD, Reading
from daq.formats.record import ARRAYS, checked_file, response_from, taken_apart
from daq.frf import FrequencyResponse

__all__ = ["read", "write"]

_TEXT_BYTES = 116
"""Length of the free text that a file of this kind starts with."""
_MARK = b"lashbench, sha256"
_KIND = "a MATLAB file that lashbench wrote"


def read(path: Path, reading: Reading = NOTHING_TOLD) -> FrequencyResponse:
    """Read a MATLAB file that `write` made, or another program's by the names of variables.

    Raises
    ------
    FileFormatError
        If the file is damaged, or was written or saved again by another program.
    """
    from scipy.io import loadmat

    content = checked_file(path, _KIND).read_bytes()
    if _MARK not in content[:_TEXT_BYTES]:
        from daq.formats.foreign.arrays import response_in_mat

        used = ("averages", "profile", "columns", "as_guessed")
        reading.refuse_unused(path, used, "a MATLAB file of another program")
        return response_in_mat(content, reading, path)
    reading.refuse_unused(path, (), "a file that lashbench wrote")
    if content[:_TEXT_BYTES] != _head(content):
        raise FileFormatError(
            f"{path}: is damaged, or another program saved it again; give {_KIND}, or a CSV"
        )
    try:
        found = loadmat(BytesIO(content), variable_names=[*ARRAYS, "document"])
    except Exception as error:
        # The reader has no error of its own: what it dislikes ends in any built-in one.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FileFormatError(
            f"{path}: cannot be read as a MATLAB file ({reason}); give {_KIND}"
        ) from error
    return response_from(
        {name: _vector(found[name], name, path) for name in ARRAYS if name in found},
        _document(found, path),
        path,
    )


def write(response: FrequencyResponse, path: Path) -> None:
    """Write a MATLAB file, whole or not at all; nothing of the response is lost.

    Raises
    ------
    InputError
        If a value is none that a reading can have, the provenance has no form
        in JSON, or no file can be made at `path`.
    """
    from scipy.io import savemat

    arrays, document = taken_apart(response, path)
    buffer = BytesIO()
    savemat(buffer, {**arrays, "document": document}, oned_as="column")
    content = buffer.getvalue()
    with replacing(path) as stream:
        stream.write(_head(content) + content[_TEXT_BYTES:])


def _head(content: bytes) -> bytes:
    """The text at the start of a file with this content."""
    digest = hashlib.sha256(content[_TEXT_BYTES:]).hexdigest()
    return f"MATLAB 5.0 MAT-file, lashbench, sha256 {digest}".ljust(_TEXT_BYTES).encode("ascii")


def _vector(held: Any, name: str, path: Path) -> Any:
    if not isinstance(held, np.ndarray) or held.ndim != 2 or min(held.shape) != 1:
        raise FileFormatError(f"{path}: {name} is not a vector of numbers; give {_KIND}")
    return held.reshape(-1)


def _document(found: dict[str, Any], path: Path) -> str:
    held = found.get("document")
    if not isinstance(held, np.ndarray) or held.dtype.kind != "U" or held.size != 1:
        raise FileFormatError(f"{path}: its document is missing; give {_KIND}")
    return str(held.reshape(-1)[0])
