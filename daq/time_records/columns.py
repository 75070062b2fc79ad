"""Columns of a recording by name or number: CSV and other text, WAV, MATLAB, TDMS.

Owns how a column is found in each kind of file. MATLAB files are read in a child process: their
library can crash. It estimates nothing.
"""

from __future__ import annotations

import logging
import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError, InputError
from daq.formats.record import FILE_LIMIT_BYTES
from daq.time_records.record import TimeRecord, rate_of_times, record_of
from daq.time_records.times import refuse_other_times

__all__ = ["read_record"]

_LISTED = 20


def read_record(
    path: Path,
    input_column: str,
    output_column: str,
    *,
    rate_hz: float | None = None,
    time_column: str | None = None,
) -> TimeRecord:
    """Read input and output of a recording.

    Parameters
    ----------
    input_column, output_column
        Name of a column, channel or variable, or its number from 1.
    rate_hz
        Samples per second; None where the file says, or `time_column` does.
    time_column
        Column of times in s.

    Raises
    ------
    FileFormatError
        If the file cannot be read or holds no such columns; what is there is listed.
    InputError
        If nothing says the rate, two things say different ones, or input and output are one
        column.
    """
    if os.path.isdir(path) or not os.path.exists(path):
        raise FileFormatError(f"{path}: is no file; give a recording")
    if os.path.getsize(path) > FILE_LIMIT_BYTES:
        raise FileFormatError(f"{path}: is larger than {FILE_LIMIT_BYTES >> 20} MiB; cut it")
    suffix = path.suffix.lower()
    said: float | None = None
    if suffix == ".wav":
        columns, said = _wav(path)
    elif suffix == ".tdms":
        columns, said = _tdms(path)
    elif suffix == ".mat":
        columns = _mat(path)
    else:
        columns = _text(path)
    if not columns:
        raise FileFormatError(f"{path}: holds no numbers; give a recording")
    rates = [] if rate_hz is None else [(rate_hz, "--rate")]
    if said is not None:
        rates.append((said, "the file"))
    first, second = (_name(columns, one, path) for one in (input_column, output_column))
    if first == second:
        raise InputError(
            f"{path}: --input {input_column} and --output {output_column} are the same column, "
            f"{first!r}; give two"
        )
    if time_column is not None:
        times = np.asarray(columns[_name(columns, time_column, path)])
        rates.append((rate_of_times(times, path), f"column {time_column}"))
    elif rates:
        others = {name: one for name, one in columns.items() if name not in (first, second)}
        refuse_other_times(others, *rates[0], path)
    if not rates:
        raise InputError(f"{path}: says no sampling rate; give --rate HZ, or --time COLUMN")
    for rate, source in rates[1:]:
        if abs(rate - rates[0][0]) > 0.01 * rate:
            raise InputError(
                f"{path}: {rates[0][1]} says {rates[0][0]:g} Hz, {source} {rate:g} Hz; "
                "give one of them"
            )
    return record_of(np.asarray(columns[first]), np.asarray(columns[second]), rates[0][0], path)


def _name(columns: Mapping[str, NDArray[Any]], name: str, path: Path) -> str:
    """The full name of a column that is given by name or number."""
    wanted = name.strip().lower()
    alike = [key for key in columns if key.strip().lower() == wanted]
    if not alike:
        # A header with its unit, such as "Vi (V)", by the name alone.
        alike = [
            key for key in columns if key.split("(")[0].split("[")[0].strip().lower() == wanted
        ]
    if not alike and wanted.isdecimal() and 1 <= int(wanted) <= len(columns):
        alike = [list(columns)[int(wanted) - 1]]
    if len(alike) != 1:
        listed = ", ".join(f"{k} {key!r}" for k, key in enumerate(list(columns)[:_LISTED], start=1))
        fault = "no column" if not alike else "more than one column"
        raise FileFormatError(f"{path}: has {fault} {name!r}; it has {listed or 'no numbers'}")
    return alike[0]


def _text(path: Path) -> dict[str, NDArray[Any]]:
    from daq.formats.foreign.decoding import text_in
    from daq.formats.foreign.table import table_in

    table = table_in(text_in(path)[0], path)
    return {
        name.strip() or f"column {k}": values
        for k, (name, values) in enumerate(
            zip(table.names or ("",) * len(table.columns), table.columns, strict=True), start=1
        )
    }


def _wav(path: Path) -> tuple[dict[str, NDArray[Any]], float]:
    """Channels as shares of full scale."""
    from scipy.io import wavfile

    try:
        with warnings.catch_warnings():
            # Chunks with remarks are passed over; a file that is cut short is refused.
            warnings.simplefilter("ignore", wavfile.WavFileWarning)
            warnings.filterwarnings("error", message="Reached EOF")
            rate, data = wavfile.read(path)
    except Exception as error:
        # The reader has no error of its own.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FileFormatError(f"{path}: cannot be read as a WAV file ({reason})") from error
    if not data.size:
        raise FileFormatError(f"{path}: holds no samples; give another recording")
    data = data.reshape(len(data), -1)
    if data.dtype.kind == "u":
        values = (data.astype(float) - 128.0) / 128.0
    elif data.dtype.kind == "i":
        values = data / float(-np.iinfo(data.dtype).min)
    else:
        values = data.astype(float)
    return {f"channel {k + 1}": values[:, k] for k in range(values.shape[1])}, float(rate)


def _tdms(path: Path) -> tuple[dict[str, NDArray[Any]], float | None]:
    try:
        from nptdms import TdmsFile  # pyright: ignore[reportMissingImports] # an extra
    except ImportError as error:
        raise InputError(
            f"{path}: TDMS files need nptdms; install it: pip install nptdms"
        ) from error
    heard: list[str] = []
    listener = logging.Handler(logging.WARNING)
    listener.emit = lambda record: heard.append(record.getMessage())  # type: ignore[method-assign]
    speakers = [logging.getLogger(f"nptdms.{name}") for name in ("reader", "tdms_segment")]
    for speaker in speakers:
        speaker.addHandler(listener)
    try:
        file = TdmsFile.read(path)
        channels = [channel for group in file.groups() for channel in group.channels()]
        found = {f"{one.group_name}/{one.name}": np.asarray(one[:]) for one in channels}
        steps = {one.properties.get("wf_increment") for one in channels} - {None, 0.0}
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FileFormatError(f"{path}: cannot be read as a TDMS file ({reason})") from error
    finally:
        for speaker in speakers:
            speaker.removeHandler(listener)
    if heard:
        # It reads what is left of a file that is cut short, and says so there only.
        raise FileFormatError(f"{path}: is damaged ({heard[0]}); give another copy")
    names = [key.split("/", 1)[1] for key in found]
    plain = {
        (name if names.count(name) == 1 else key): values
        for (key, values), name in zip(found.items(), names, strict=True)
        if values.dtype.kind in "fiu"
    }
    return plain, 1.0 / float(steps.pop()) if len(steps) == 1 else None


def _mat(path: Path) -> dict[str, NDArray[Any]]:
    from daq.formats.apart import read_arrays_apart

    return read_arrays_apart("daq.time_records.matlab", path)
