"""From measured values to what a trace shows: coordinate systems, units, number formats.

Owns the transforms of ``CALC:FORM``, the filler that stands where nothing was
measured, and the printing of arrays. It reads no measurement.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.analyser35670a.kinds import show_real

__all__ = [
    "LOG_OF_ZERO",
    "NO_UNIT",
    "Picture",
    "VOLT_FEEDS",
    "encode",
    "in_volts",
    "transform",
    "unit_of",
]

LOG_OF_ZERO = -float(np.finfo(np.float32).max)
"""What a logarithmic trace holds where nothing was measured."""

NO_UNIT = ""

_PAIRS = ("NYQ", "POL")

VOLT_FEEDS = {"XFR:POW": "V2", "XFR:POW:LIN": "V"}
"""Measurement data whose unit can be chosen, and the unit that they have unless it was."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """What stands in a trace box before any coordinates.

    `x` (n,) in Hz or s, `values` (n,), complex or real, with 0 where
    nothing was measured; `feed` names the kind of data; `power` says whether
    decibels are 10 log10 of the values.
    """

    feed: str
    x: NDArray[np.float64]
    values: NDArray[np.complex128] | NDArray[np.float64]
    power: bool = False
    x_unit: str = "HZ"

    @property
    def is_complex(self) -> bool:
        """Whether the raw data are pairs."""
        return bool(np.iscomplexobj(self.values))

    @property
    def raw(self) -> NDArray[np.float64]:
        """The values as transferred by ``TRAC?``: re, im pairs if complex."""
        if not self.is_complex:
            return np.asarray(self.values, dtype=float)
        return _pairs(self.values.real, self.values.imag)


def _pairs(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.column_stack((first, second)).ravel()


def transform(picture: Picture, form: str, radians: bool) -> NDArray[np.float64]:
    """The values of a trace in its coordinates, pairs for NYQ and POL."""
    values = np.asarray(picture.values, dtype=complex)
    scale = 1.0 if radians else 180.0 / math.pi
    magnitude, phase = np.abs(values), np.angle(values)
    match form:
        case "MLIN":
            return magnitude
        case "MLOG":
            return _decibels(magnitude, 10.0 if picture.power else 20.0)
        case "PHAS":
            return phase * scale
        case "UPH":
            return np.unwrap(phase) * scale
        case "REAL":
            return np.real(values).copy()
        case "IMAG":
            return np.imag(values).copy()
        case "NYQ":
            return _pairs(np.real(values), np.imag(values))
        case "POL":
            return _pairs(magnitude, phase * scale)
    return _group_delay(picture.x, phase)


def _decibels(magnitude: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    decibels = np.full(magnitude.shape, LOG_OF_ZERO)
    seen = magnitude > 0
    decibels[seen] = factor * np.log10(magnitude[seen])
    return decibels


def _group_delay(x: NDArray[np.float64], phase: NDArray[np.float64]) -> NDArray[np.float64]:
    """Minus the slope of the phase over angular frequency, s. [S] Without the aperture."""
    delay = np.zeros(phase.shape)
    if len(x) < 2:
        return delay
    steps = np.diff(2.0 * math.pi * x)
    slope = np.divide(-np.diff(np.unwrap(phase)), steps, out=np.zeros(len(steps)), where=steps != 0)
    delay[:-1] = slope
    delay[-1] = slope[-1]
    return delay


def in_volts(picture: Picture, unit: str, bandwidth_hz: float, record_s: float) -> Picture:
    """A spectrum in the unit of ``CALC:UNIT:VOLT``; other data, and their own unit, as they are."""
    head = picture.feed.partition(" ")[0]
    if head not in VOLT_FEEDS or unit == VOLT_FEEDS[head]:
        return picture
    power = np.abs(picture.values) if picture.power else np.abs(picture.values) ** 2
    if unit in ("V2/HZ", "V/RTHZ", "V2S/HZ"):
        power = power / bandwidth_hz
    if unit == "V2S/HZ":
        power = power * record_s
    is_root = unit in ("V", "V/RTHZ")
    return Picture(
        picture.feed, picture.x, np.sqrt(power) if is_root else power, not is_root, picture.x_unit
    )


def unit_of(feed: str, form: str, radians: bool, amplitude: str, volts: str = "") -> str:
    """Unit of a trace's Y axis; empty where there is none. `volts` is that of a spectrum."""
    if form in ("PHAS", "UPH"):
        return "RAD" if radians else "DEG"
    if form == "GDEL":
        return "S"
    base = {"RAT": NO_UNIT, "COH": NO_UNIT, "VAR": NO_UNIT}.get(feed.partition(" ")[0][-3:])
    if base is None:
        suffix = {"PEAK": "PK", "PP": "PP"}.get(amplitude, "RMS")
        squared = feed.startswith("XFR:POW:CROS") or feed.split(" ")[0] == "XFR:POW"
        base = "VPK" if feed.startswith("XTIM") else f"V{suffix}"
        per = volts[volts.index("/") :] if "/" in volts else ""
        squared = volts.startswith("V2") if volts else squared
        base += ("2" if squared and form != "MLOG" else "") + per
    return f"DB{base}" if form == "MLOG" else base


def encode(values: NDArray[np.float64], form: tuple[str, int]) -> bytes:
    """Numbers in the transfer format: ``("ASC", digits)`` or ``("REAL", bits)``.

    A block is of definite length and big-endian.
    """
    kind, size = form
    if kind == "ASC":
        return ",".join(show_real(float(value), size) for value in values).encode("ascii")
    data = values.astype(">f8" if size == 64 else ">f4").tobytes()
    length = str(len(data))
    return f"#{len(length)}{length}".encode("ascii") + data
