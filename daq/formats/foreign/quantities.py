"""Columns of other programs, by what they hold and in which unit, as a response.

Owns the names of quantities, their conversion to hertz, V peak, complex gain and dB, and the checks
that the rows of a foreign file must pass. It reads no file and guesses nothing: whoever calls says
which array is what.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError, InputError
from daq.formats.foreign.column_errors import column_errors
from daq.formats.foreign.columns import Columns
from daq.formats.reading import Reading, remarked, without_dc
from daq.frf import GAIN_STD_IS, FrequencyResponse

__all__ = ["QUANTITIES", "checked_quantity", "response_of"]

_RMS = math.sqrt(2.0)
_FREQUENCY = {
    "frequency_hz": 1.0,
    "frequency_khz": 1e3,
    "frequency_rad_s": 0.5 / math.pi,
    "frequency_rpm": 1.0 / 60.0,
}
_LOGARITHM = "frequency_log10_hz"
_VOLTS = {"vpk": 1.0, "vrms": _RMS, "vpp": 0.5}
_SOURCE = {f"source_{unit}": factor for unit, factor in _VOLTS.items()}
_INPUT = {f"input_{unit}": factor for unit, factor in _VOLTS.items()}
_OUTPUT = {f"output_{unit}": factor for unit, factor in _VOLTS.items()}
_PHASE = {"phase_deg": 1.0, "phase_rad": 180.0 / math.pi}

QUANTITIES: Mapping[str, str] = {
    "frequency_hz": "frequency, Hz",
    "frequency_khz": "frequency, kHz",
    "frequency_rad_s": "frequency, rad/s",
    "frequency_rpm": "frequency, revolutions a minute",
    "frequency_log10_hz": "frequency, decimal logarithm of Hz",
    "gain_db": "magnitude, 20 log10 |V_o/V_i|",
    "gain": "magnitude |V_o/V_i|, linear",
    "gain_real": "real part of V_o/V_i",
    "gain_imag": "imaginary part of V_o/V_i",
    "gain_complex": "V_o/V_i as complex numbers",
    "phase_deg": "phase, degrees",
    "phase_rad": "phase, radians",
    "output_vpk": "amplitude of V_o, V peak; vrms and vpp likewise",
    "output_vrms": "amplitude of V_o, V rms",
    "output_vpp": "amplitude of V_o, V peak to peak",
    "input_vpk": "amplitude of V_i, V peak; vrms and vpp likewise",
    "input_vrms": "amplitude of V_i, V rms",
    "input_vpp": "amplitude of V_i, V peak to peak",
    "source_vpk": "source level, V peak; vrms and vpp likewise",
    "source_vrms": "source level, V rms",
    "source_vpp": "source level, V peak to peak",
    "gain_std_db": "standard error of the magnitude, dB",
    "gain_std": "standard error of the magnitude, of the linear ratio",
    "phase_std_deg": "standard error of the phase, degrees",
    "phase_std_rad": "standard error of the phase, radians",
    "coherence": "coherence (gamma squared), 0 to 1",
}
"""What a column may be said to hold; the unit is part of the name."""

_MOST_LEVELS = 32


def checked_quantity(name: str) -> str:
    """The name of a quantity.

    Raises
    ------
    InputError
        If there is none of that name; lists those that there are.
    """
    if name not in QUANTITIES:
        raise InputError(
            f"--column {name[:40]!r} is no quantity; use one of: {', '.join(QUANTITIES)}"
        )
    return name


def response_of(columns: Columns, reading: Reading) -> FrequencyResponse:
    """A response from named columns; the rows rise in frequency in each level.

    Returns
    -------
    FrequencyResponse
        Rows in the order of the file. Rows that fall in frequency are turned round, which is
        remarked, unless `reading` says that the sweep went down. Rows at 0 Hz are left out,
        which is remarked.

    Raises
    ------
    FileFormatError
        If a quantity is missing or there twice, or a value is none that it can have; names the
        row.
    """
    frequency = _frequency(columns)
    if frequency is None:
        raise FileFormatError(
            f"{columns.path}: no column is the frequency; say which: --column frequency_hz=COLUMN"
        )
    _present(columns, frequency, "frequency")
    for row in np.flatnonzero(frequency < 0.0):
        columns.refuse(row, f"frequency {frequency[row]:g} Hz is negative")
    gain, known = _gain(columns)
    level = _level(columns)
    std_db, phase_std_deg, remarks, words = column_errors(columns, np.abs(gain), reading)
    provenance = {"kind": "measured", "file": columns.path.name, **columns.provenance}
    if words:
        provenance[GAIN_STD_IS] = words
    response = FrequencyResponse.from_arrays(
        frequency,
        level,
        gain,
        unit=columns.unit,
        phase_known=known,
        gain_std_db=std_db,
        phase_std_deg=phase_std_deg,
        provenance=provenance,
    )
    if remarks:
        response = remarked(response, *remarks)
    _believed(columns, response)
    return without_dc(_in_order(columns, response, reading), columns.path)


def _frequency(columns: Columns) -> NDArray[np.float64] | None:
    """The frequency in Hz; None where no column is one."""
    frequency = columns.one_of(_FREQUENCY)
    if _LOGARITHM not in columns.held:
        return frequency
    if frequency is not None:
        raise FileFormatError(f"{columns.path}: two columns are the frequency; give one of them")
    logarithm = columns.real(_LOGARITHM)
    for row in np.flatnonzero(np.abs(logarithm) > 12.0):
        columns.refuse(row, f"a frequency of 10^{logarithm[row]:g} Hz is none")
    return np.asarray(10.0**logarithm)


def _present(columns: Columns, values: NDArray[Any], what: str) -> None:
    for row in np.flatnonzero(np.isnan(values)):
        columns.refuse(row, f"{what} is missing; give a number, or take the row out")


def _gain(columns: Columns) -> tuple[NDArray[np.complex128], NDArray[np.bool_]]:
    """Complex gain, and where its phase is known."""
    held = columns.held
    ways = {
        "gain_complex": "gain_complex" in held,
        "gain_real and gain_imag": "gain_real" in held or "gain_imag" in held,
        "gain_db": "gain_db" in held,
        "gain": "gain" in held,
        "output and input": any(name in held for name in (*_OUTPUT, *_INPUT)),
    }
    given = [way for way, is_so in ways.items() if is_so]
    if len(given) != 1:
        found = f"{' and '.join(given)} say the same" if given else "no column is the response"
        raise FileFormatError(
            f"{columns.path}: {found}; say which is: --column gain_db=COLUMN, gain=COLUMN, "
            "or gain_real=COLUMN with gain_imag=COLUMN"
        )
    phase = columns.one_of(_PHASE)
    if given[0] in ("gain_complex", "gain_real and gain_imag"):
        if phase is not None:
            raise FileFormatError(
                f"{columns.path}: a phase beside {given[0]}; leave one of both out"
            )
        return _complex(columns)
    magnitude = _magnitude(columns, given[0])
    if phase is None:
        return np.asarray(magnitude, dtype=complex), np.zeros(len(magnitude), dtype=bool)
    columns.believe("phase_deg", phase)
    known = np.isfinite(phase)
    turned = np.exp(1j * np.radians(np.where(known, phase, 0.0)))
    return np.asarray(magnitude * turned, dtype=complex), known


def _complex(columns: Columns) -> tuple[NDArray[np.complex128], NDArray[np.bool_]]:
    held = columns.held
    if "gain_complex" in held:
        gain = np.asarray(held["gain_complex"]).astype(complex)
    else:
        missing = [name for name in ("gain_real", "gain_imag") if name not in held]
        if missing:
            raise FileFormatError(
                f"{columns.path}: {missing[0]} is missing; say which: --column {missing[0]}=COLUMN"
            )
        gain = columns.real("gain_real") + 1j * columns.real("gain_imag")
    _present(columns, gain, "gain")
    return gain, np.ones(len(gain), dtype=bool)


def _magnitude(columns: Columns, way: str) -> NDArray[np.float64]:
    if way == "output and input":
        output, drive = columns.one_of(_OUTPUT), columns.one_of(_INPUT)
        if output is None or drive is None:
            what = "output_vpk" if output is None else "input_vpk"
            raise FileFormatError(
                f"{columns.path}: {what} is missing; say which: --column {what}=COLUMN"
            )
        for row in np.flatnonzero(~(drive > 0.0)):
            columns.refuse(row, f"an input amplitude of {drive[row]:g} V divides nothing")
        magnitude = output / drive
    elif way == "gain_db":
        decibels = columns.real("gain_db")
        _present(columns, decibels, "gain_db")
        columns.believe("gain_db", decibels)
        return np.asarray(10.0 ** (decibels / 20.0))
    else:
        magnitude = columns.real("gain")
    _present(columns, magnitude, "gain")
    for row in np.flatnonzero(magnitude < 0.0):
        columns.refuse(
            row,
            f"a magnitude of {magnitude[row]:g} is negative; if these are decibels, say "
            "--column gain_db=COLUMN, if real parts, gain_real=COLUMN and gain_imag=COLUMN",
        )
    return magnitude


def _level(columns: Columns) -> NDArray[np.float64] | float:
    level = columns.one_of(_SOURCE)
    if level is None:
        return math.nan
    for row in np.flatnonzero(level <= 0.0):
        columns.refuse(row, f"source level {level[row]:g} V is not above 0")
    known = np.unique(level[np.isfinite(level)])
    if len(known) > min(_MOST_LEVELS, max(1, len(level) // 3)) and len(level) > 2:
        raise FileFormatError(
            f"{columns.path}: the column of source levels has {len(known)} values in {len(level)} "
            "rows: measured amplitudes are no levels; name it --column input_vpk=COLUMN with "
            "output_vpk=COLUMN, or leave it out, and give --level"
        )
    return level


def _believed(columns: Columns, response: FrequencyResponse) -> None:
    for name in ("frequency_hz", "source_vpk", "gain_db"):
        values = getattr(response, name)
        skip = ~np.isfinite(values) | ((values == 0.0) & (name == "frequency_hz"))
        columns.believe(name, np.where(skip, np.nan, values))


def _in_order(columns: Columns, response: FrequencyResponse, reading: Reading) -> FrequencyResponse:
    """Rising rows in each level, or falling where the sweep is told to go down."""
    parts, turned = [], False
    for rows in _level_rows(response.source_vpk):
        f = response.frequency_hz[rows]
        falls = len(f) > 1 and f[0] > f[-1]
        step = np.diff(f) * (-1.0 if falls else 1.0)
        for bad in np.flatnonzero(step <= 0.0)[:1]:
            what = (
                "comes twice; take one row out"
                if step[bad] == 0.0
                else "is out of order; sort the rows, or give each its source level by --column "
                "source_vpk=COLUMN"
            )
            columns.refuse(int(rows[bad + 1]), f"frequency {f[bad + 1]:g} Hz {what}")
        turn = falls and reading.direction != "down"
        turned |= turn
        parts.append(rows[::-1] if turn else rows)
    if not turned:
        return response
    return remarked(
        response.take(np.concatenate(parts)),
        "the rows fall in frequency and were turned round; if it was swept down, give --sweep down",
    )


def _level_rows(levels: NDArray[np.float64]) -> Sequence[NDArray[np.intp]]:
    """Rows of each level in the order of their first row."""
    keys = np.where(np.isnan(levels), -1.0, levels)
    _, first, place = np.unique(keys, return_index=True, return_inverse=True)
    return [np.flatnonzero(place == one) for one in np.argsort(first)]
