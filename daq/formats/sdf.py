"""Frequency responses that the analyser itself saved: HP Standard Data Format, read only.

Owns the way from such a file to a response. The headers are decoded by
`sdfascii`; the trace is read here, because that library turns every trace of a
35670A into volts, which a ratio of two channels is not. The format is that of
the Standard Data Format Utilities guide, HP 5963-1715, version 2.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.believable import check_reading
from daq.formats.reading import NOTHING_TOLD, Reading, without_dc
from daq.formats.record import checked_file
from daq.frf import FrequencyResponse, PointFlag

__all__ = ["read"]

_KIND = "a frequency response that an HP or Agilent analyser saved as SDF"
_RECORD_HEAD = struct.Struct(">hl")
_X_DATA, _Y_DATA = 16, 17
_REALS = {"float": ">f4", "double": ">f8"}
_COMPLEX = {"float": ">c8", "double": ">c16"}


def read(path: Path, reading: Reading = NOTHING_TOLD) -> FrequencyResponse:
    """Read one saved frequency response.

    The file holds no source level: `source_vpk` is NaN. Where a channel was
    overloaded the file does not say at which points, so all carry the flag.

    Raises
    ------
    FileFormatError
        If the file is damaged, of another version, or holds anything but one
        frequency response.
    """
    reading.refuse_unused(path, (), "a file of the analyser")
    content = checked_file(path, _KIND).read_bytes()
    header = _header(path)
    trace = _only_trace(header, path)
    points = int(trace["num_points"])
    frequency = _abscissa(header, trace, content, path)
    factor, channels = _correction(header, trace, path)
    gain = factor * _record(
        content,
        header["file_hdr"]["offset_ydata_record"],
        _Y_DATA,
        _COMPLEX.get(trace["y_data_type"]),
        points,
        path,
    )
    first, last = _span(header, trace, points, path)
    frequency, gain = frequency[first : last + 1], gain[first : last + 1]
    wrong = np.flatnonzero(~(np.isfinite(gain) & np.isfinite(frequency) & (frequency >= 0)))
    if wrong.size:
        row = int(wrong[0])
        raise FileFormatError(
            f"{path}, point {first + row + 1}: {frequency[row]:g} Hz with the gain {gain[row]:g} "
            "is no reading; save the trace again without it"
        )
    overloaded = any(channel["overloaded"] for channel in channels)
    response = FrequencyResponse.from_arrays(
        frequency,
        math.nan,
        gain,
        unit=header["meas_hdr"]["meas_title"].strip() or "unknown",
        flags=int(PointFlag.OVERLOAD) if overloaded else 0,
        provenance=_provenance(header, trace, channels, path),
    )
    response = without_dc(response, path)
    check_reading(response, path)
    return response


def _header(path: Path) -> Mapping[str, Any]:
    import sdfascii

    try:
        header, _ = sdfascii.read_sdf_file(str(path))
    except (Exception, SystemExit) as error:
        # The library ends the program where it does not know what it reads.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FileFormatError(f"{path}: cannot be read as SDF ({reason}); give {_KIND}") from error
    revision = header["file_hdr"]["sdf_revision"]
    if revision != 2:
        raise FileFormatError(f"{path}: is SDF version {revision}; only version 2 can be read")
    decoded: Mapping[str, Any] = header
    return decoded


def _only_trace(header: Mapping[str, Any], path: Path) -> Mapping[str, Any]:
    traces = header["data_hdr"]
    if len(traces) != 1:
        raise FileFormatError(f"{path}: holds {len(traces)} traces; save one by itself")
    trace: Mapping[str, Any] = traces[0]
    if trace["data_type"] != "Frequency response" or not trace["y_is_complex"]:
        raise FileFormatError(
            f"{path}: holds {trace['data_type']!r}, not a complex frequency response"
        )
    wrong = {
        "it is marked as not valid": not trace["y_is_valid"],
        "it has several values a point": trace["y_per_point"] != 1,
        "it is a waterfall": trace["total_rows"] * trace["total_cols"] != 1 or trace["scan_data"],
        "it has no points": trace["num_points"] < 1,
        "its abscissa is not in Hz": trace["xunit"]["label"].strip() != "Hz",
    }
    for fault, is_so in wrong.items():
        if is_so:
            raise FileFormatError(f"{path}: its trace cannot be taken: {fault}")
    return trace


def _abscissa(
    header: Mapping[str, Any], trace: Mapping[str, Any], content: bytes, path: Path
) -> NDArray[np.float64]:
    points = int(trace["num_points"])
    first, step = float(trace["abscissa_first_x"]), float(trace["abscissa_delta_x"])
    with np.errstate(over="ignore", invalid="ignore"):
        if trace["x_resolution_type"] == "Linear":
            return np.asarray(first + step * np.arange(points), dtype=float)
        if trace["x_resolution_type"] == "Logarithmic":
            return np.asarray(first * step ** np.arange(points), dtype=float)
    return _record(
        content,
        header["file_hdr"]["offset_xdata_record"],
        _X_DATA,
        _REALS.get(trace["x_data_type"]),
        points,
        path,
    ).astype(float)


def _record(
    content: bytes, offset: int, kind: int, dtype: str | None, count: int, path: Path
) -> NDArray[Any]:
    """The values of a data record, checked to be there whole."""
    if dtype is None:
        raise FileFormatError(f"{path}: its numbers are neither float nor double")
    start = offset + _RECORD_HEAD.size
    size = count * np.dtype(dtype).itemsize
    if offset < 0 or start + size > len(content):
        raise FileFormatError(f"{path}: is cut short: {count} values are due at byte {start}")
    found, length = _RECORD_HEAD.unpack_from(content, offset)
    if found != kind or length < _RECORD_HEAD.size + size:
        raise FileFormatError(
            f"{path}: record {found} of {length} bytes at byte {offset} is not the one due there"
        )
    return np.frombuffer(content, dtype, count, start)


def _correction(
    header: Mapping[str, Any], trace: Mapping[str, Any], path: Path
) -> tuple[float, list[Mapping[str, Any]]]:
    """Factor from stored to true values, and the channels it stems from.

    Each channel enters by (window correction / engineering units) to the
    power of its exponent in the trace, in 48ths.
    """
    try:
        vector = header["vector_hdr"][trace["first_vector_record_num"]]
        factor, channels = 1.0, []
        for number, power in zip(
            vector["channel_record"], vector["channel_power_48x"], strict=True
        ):
            if number == -1:
                continue
            channel = header["channel_hdr"][number]
            window, unit = channel["window"]["narrow_band_corr"], channel["int_2_eng_unit"]
            factor *= (window / unit) ** (power / 48)
            channels.append(channel)
    except (IndexError, ZeroDivisionError, OverflowError) as error:
        raise FileFormatError(f"{path}: its channels cannot be made sense of ({error})") from error
    if isinstance(factor, complex) or not math.isfinite(factor) or factor == 0:
        raise FileFormatError(f"{path}: the correction of its channels is {factor}")
    return factor, channels


def _span(
    header: Mapping[str, Any], trace: Mapping[str, Any], points: int, path: Path
) -> tuple[int, int]:
    first, last = header["meas_hdr"]["start_freq_index"], header["meas_hdr"]["stop_freq_index"]
    last = min(last, trace["last_valid_index"])
    if not 0 <= first <= last < points:
        raise FileFormatError(f"{path}: points {first} to {last} of {points} cannot be")
    return first, last


def _provenance(
    header: Mapping[str, Any],
    trace: Mapping[str, Any],
    channels: list[Mapping[str, Any]],
    path: Path,
) -> dict[str, Any]:
    file = header["file_hdr"]
    return {
        "kind": "measured",
        "file": path.name,
        "instrument": {
            "model": file["application"],
            "revision": file["application_version"],
            "serial": channels[0]["serial_number"] if channels else "",
        },
        "started": file["measurement_start_datetime"].isoformat(),
        "measurement": header["meas_hdr"]["meas_type"],
        "trace": trace["data_title"].strip(),
        "channels": [channel["channel_label"].strip() for channel in channels],
    }
