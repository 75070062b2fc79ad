"""What the values of a response can be at all, and what to look at where one is not.

Owns the limits of what is read from files that people and other programs make. They are far
wider than any bench: a number beyond them is a slip, of units or of some noughts, and would be
calculated with all the same. Nothing is changed, clipped or left out here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from daq.errors import FileFormatError
from daq.frf import FrequencyResponse

__all__ = ["BOUNDS", "check_reading", "disbelief"]


@dataclass(frozen=True, slots=True)
class Bounds:
    """Least and greatest value that is believed, in `unit`, and what to look at beyond."""

    least: float
    most: float
    unit: str
    remedy: str


BOUNDS: Mapping[str, Bounds] = {
    # Slow servos take hours a cycle; analysers of this kind end at 0.1 MHz, the fastest at some.
    "frequency_hz": Bounds(1e-6, 1e7, "Hz", "see whether frequencies are in Hz"),
    # The 35670A gives 5 V in steps of 0.25 mV; with an amplifier behind it, a drive some hundred.
    "source_vpk": Bounds(1e-9, 1e3, "V", "see whether levels are in V peak"),
    # A kilovolt from 100 nV is 200 dB. What nothing drives reads as noise, 150 dB below full
    # scale, and in a simulation as its rounding.
    "gain_db": Bounds(-400.0, 200.0, "dB", "see whether gains are 20 log10 |V_o/V_i|"),
    # Unwrapped over a thousand turns.
    "phase_deg": Bounds(-3.6e5, 3.6e5, "deg", "see whether phases are in degrees"),
    # Of a point that is lost in noise the error is some times its reading, or by rare chance
    # some thousand times: ten thousand are 87 000 dB, and in phase 570 000 degrees.
    "gain_std_db": Bounds(0.0, 1e5, "dB", "see whether errors are in dB, or leave this one out"),
    "point_phase_std_deg": Bounds(0.0, 1e6, "deg", "see whether errors are in degrees"),
    "point_dc_v": Bounds(-1e3, 1e3, "V", "see whether it is in V"),
    "point_harmonic2": Bounds(0.0, 1e10, "of V_i", "see whether it is a ratio to the source"),
    "point_harmonic3": Bounds(0.0, 1e10, "of V_i", "see whether it is a ratio to the source"),
    "dc_offset_v": Bounds(-1e3, 1e3, "V", "see whether it is in V"),
}
"""Every value that has limits, by the name that it has in a CSV file."""


def disbelief(name: str, values: Any) -> tuple[int, str] | None:
    """The first of some values that cannot be, and what to say of it; None where all can.

    Parameters
    ----------
    name
        A key of `BOUNDS`.
    values
        Numbers, shape (rows,); of complex ones the magnitude counts. NaN is unknown, and can be.
    """
    bounds, values = BOUNDS[name], np.asarray(values)
    if values.dtype.kind == "c":
        with np.errstate(over="ignore"):
            values = np.abs(values)
    wrong = np.flatnonzero((values < bounds.least) | (values > bounds.most))
    if not wrong.size:
        return None
    value = values[wrong[0]]
    beyond, limit = ("above", bounds.most) if value > bounds.most else ("below", bounds.least)
    return int(wrong[0]), (
        f"{name} {value:g} is {beyond} the {limit:g} {bounds.unit} that can be believed; "
        f"{bounds.remedy}"
    )


def check_reading(response: FrequencyResponse, path: Path) -> None:
    """Refuse a response of another program that holds a value which cannot be.

    A gain of zero is none to other programs, and stays.

    Raises
    ------
    FileFormatError
        Names file, row, value and limit.
    """
    for name in ("frequency_hz", "source_vpk", "gain_db"):
        values = getattr(response, name)
        found = disbelief(name, np.where(np.isinf(values), np.nan, values))
        if found is not None:
            row, fault = found
            hz = response.frequency_hz[row]
            raise FileFormatError(f"{path}, row {row + 1}, at {hz:g} Hz: {fault}")
