"""Frequency responses as MATLAB files (version 5), one variable per array.

Owns that layout: column vectors under the names of the response's arrays, and
the rest of it as a JSON text in the variable `document` (in MATLAB:
``jsondecode(document)``).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from daq.errors import FileFormatError
from daq.formats.atomic import replacing
from daq.formats.record import ARRAYS, arrays_of, checked_file, document_of, response_from
from daq.frf import FrequencyResponse

__all__ = ["read", "write"]

_KIND = "a MATLAB file that lashbench wrote"


def read(path: Path) -> FrequencyResponse:
    """Read a MATLAB file that `write` made.

    Raises
    ------
    FileFormatError
        If the file is damaged, of version 7.3, or not one of ours.
    """
    from scipy.io import loadmat

    checked_file(path, _KIND)
    try:
        with path.open("rb") as file:
            found = loadmat(file, variable_names=[*ARRAYS, "document"])
    except Exception as error:
        # The reader has no error of its own: damage ends in any built-in one.
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

    content: dict[str, Any] = dict(arrays_of(response, path))
    content["document"] = document_of(response, path)
    with replacing(path) as partial, partial.open("wb") as file:
        savemat(file, content, oned_as="column")


def _vector(held: Any, name: str, path: Path) -> Any:
    if not isinstance(held, np.ndarray) or held.ndim != 2 or min(held.shape) != 1:
        raise FileFormatError(f"{path}: {name} is not a vector of numbers; give {_KIND}")
    return held.reshape(-1)


def _document(found: dict[str, Any], path: Path) -> str:
    held = found.get("document")
    if not isinstance(held, np.ndarray) or held.dtype.kind != "U" or held.size != 1:
        raise FileFormatError(f"{path}: its document is missing; give {_KIND}")
    return str(held.reshape(-1)[0])
