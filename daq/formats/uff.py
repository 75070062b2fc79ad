"""Frequency responses as universal files: data sets 58 in ASCII, for modal analysis programs.

Owns what a file holds: one frequency response function for each source level,
one function with its standard error where that is known, and a companion data
set of a private number with everything exactly, since a data set 58 keeps six
digits of a frequency, has no word for "unknown", and no place for the rest.
Other programs skip the companion. A file without one, from another program, is
read by its functions alone.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.atomic import write_text
from daq.formats.foreign.choosing import foreign_response
from daq.formats.foreign.functions import RESPONSE, Function
from daq.formats.foreign.uff_sets import function_of, split_sets
from daq.formats.reading import NOTHING_TOLD, Reading
from daq.formats.record import ARRAYS, checked_file, response_from, taken_apart
from daq.formats.uff_sets import GENERAL, function, private, private_text
from daq.frf import FrequencyResponse
from daq.untrusted.bounded_text import parse_json

__all__ = ["COMPANION", "read", "write"]

COMPANION = 9958
"""Number of the data set that holds the response exactly."""

_KIND = "a universal file with frequency response functions (data set 58)"


def write(response: FrequencyResponse, path: Path) -> None:
    """Write a universal file, whole or not at all; nothing of the response is lost.

    Readings without a value are left out of the functions; the companion
    holds them.

    Raises
    ------
    InputError
        If a value is none that a reading can have, the provenance has no form
        in JSON, or no file can be made at `path`.
    """
    arrays, document = taken_apart(response, path)
    text = "".join(_functions(response)) + private(COMPANION, _companion(arrays, document))
    write_text(path, text)


def read(path: Path, reading: Reading = NOTHING_TOLD) -> FrequencyResponse:
    """Read a universal file, ours or another program's.

    Raises
    ------
    FileFormatError
        If the file is damaged, holds no frequency response function or
        several that nothing tells apart, or was altered beside its companion.
    InputError
        If `reading` says something that this file has no use for.
    """
    content = checked_file(path, _KIND).read_bytes()
    sets = split_sets(content, path)
    companion = private_text(sets, COMPANION, path)
    response = None if companion is None else _exact(companion, path)
    functions = [
        function_of(one, number, path)
        for number, one in enumerate((one for one in sets if one.number == 58), start=1)
    ]
    if response is None:
        reading.refuse_unused(path, ("function", "averages", "columns"), "a universal file")
        return foreign_response(functions, reading, path)
    reading.refuse_unused(path, (), "a file that lashbench wrote")
    _check_same(response, [one for one in functions if one.kind == RESPONSE], path)
    return response


def _functions(response: FrequencyResponse) -> Iterator[str]:
    usable = np.isfinite(response.gain)
    for level in _levels(response):
        rows = np.flatnonzero(usable & _at(response, level))
        if rows.size == 0:
            continue
        part = response.take(rows)
        head = _head(part, level)
        # Without a single phase a complex function would state that it is zero.
        gain = part.gain if np.any(part.phase_known) else np.abs(part.gain)
        yield function(RESPONSE, part.frequency_hz, gain, level, "gain V_o/V_i", "V/V", head)
        known = np.isfinite(part.gain_std_db)
        if np.any(known):
            yield function(
                GENERAL,
                part.frequency_hz[known],
                part.gain_std_db[known],
                level,
                "standard error",
                "dB",
                ("one standard error of the gain, dB", *head[1:]),
            )


def _head(part: FrequencyResponse, level: float) -> tuple[str, ...]:
    cycles = f"{part.settle_cycles} settle, {part.integrate_cycles} integrate cycles"
    sweep = f"sweep {part.direction}" if part.direction else "sweep unknown"
    return (
        f"frequency response V_o/V_i of {part.unit}",
        f"source level {level:g} V peak, {sweep}, {cycles}",
        str(part.provenance.get("started", "NONE")),
        f"lashbench, {part.provenance.get('kind', 'unknown')}",
        f"data set {COMPANION} of this file holds the same exactly",
    )


def _companion(arrays: Mapping[str, NDArray[Any]], document: str) -> str:
    rows: dict[str, Any] = {}
    for name, values in arrays.items():
        if values.dtype.kind == "c":
            rows[name] = [np.real(values).tolist(), np.imag(values).tolist()]
        else:
            rows[name] = values.tolist()
    # Python's JSON writes every digit, and NaN as a word of its own.
    return json.dumps({"document": document, "rows": rows})


def _exact(companion: str, path: Path) -> FrequencyResponse:
    try:
        content = parse_json(companion)
        document, rows = content["document"], content["rows"]
        arrays = {}
        for name, (dtype, _) in ARRAYS.items():
            if dtype is np.complex128:
                real, imaginary = (np.array(part, dtype=float) for part in rows[name])
                # Added as parts: arithmetic would turn an infinite one into NaN.
                arrays[name] = np.empty(real.shape, dtype=complex)
                arrays[name].real, arrays[name].imag = real, imaginary
            else:
                arrays[name] = np.array(rows[name])
        return response_from(arrays, str(document), path)
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise FileFormatError(
            f"{path}: its data set {COMPANION} is damaged ({reason}); give {_KIND}"
        ) from error


def _check_same(response: FrequencyResponse, functions: Sequence[Function], path: Path) -> None:
    """Refuse a file whose functions and companion say different things."""
    usable = np.isfinite(response.gain)
    levels = [level for level in _levels(response) if np.any(usable & _at(response, level))]
    same = len(levels) == len(functions)
    for level, found in zip(levels, functions, strict=False):
        part = response.take(usable & _at(response, level))
        gain = part.gain if np.iscomplexobj(found.values) else np.abs(part.gain)
        same = (
            same
            and len(found.x) == len(part)
            and np.allclose(found.x, part.frequency_hz, rtol=1e-5, atol=0.0)
            and bool(np.all(np.abs(found.values - gain) <= 1e-11 * np.abs(gain) + 1e-300))
        )
    if not same:
        raise FileFormatError(
            f"{path}: its functions differ from data set {COMPANION}, which holds them exactly; "
            "it was altered: take that data set out to read the functions alone"
        )


def _levels(response: FrequencyResponse) -> list[float]:
    """Distinct levels in the order of their first row."""
    _, first = np.unique(response.source_vpk, return_index=True)
    return [float(level) for level in response.source_vpk[np.sort(first)]]


def _at(response: FrequencyResponse, level: float) -> NDArray[np.bool_]:
    if math.isnan(level):
        return np.isnan(response.source_vpk)
    return np.asarray(response.source_vpk == level)
