"""The input channels: ranges, autorange, overload, coupling.

Owns the 2 dB grid of input ranges and what a converter makes of a signal that
does not fit. It keeps no setting and drives nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sim.analyser35670a.commands.tokens import Argument
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.kinds import Number, show_real
from sim.analyser35670a.units import RANGE, Quantity, from_volts_peak, volts_peak

__all__ = [
    "OVERLOAD_RATIO",
    "RANGES_DBVRMS",
    "InputRange",
    "autorange",
    "clipped_gain",
    "coupling_gain",
    "in_unit",
    "nearest_range",
    "range_vpk",
]

RANGES_DBVRMS = tuple(range(-51, 28, 2))
OVERLOAD_RATIO = 10.0 ** (2.0 / 20.0)
"""Peak over range at which the converter saturates: full scale lies 2 dB below."""
_CORNER_HZ = 0.5
"""[S] Corner of AC coupling; the manual says only that it lies below 1 Hz."""
_SLACK_DB = 0.02
"""31.7 V peak, as printed, is a hair above the highest step."""


def range_vpk(dbvrms: float) -> float:
    """Full scale of a range, V peak."""
    return volts_peak(Quantity(dbvrms, "DBVRMS"))


@dataclass(frozen=True, slots=True)
class InputRange:
    """An input range: any amplitude, rounded up to the next 2 dB step."""

    def read(self, arguments: Sequence[Argument], kept: Any) -> Quantity:
        """The range that the number, bound or step sent stands for, in its own unit."""
        index = RANGES_DBVRMS.index(nearest_range(kept))
        if len(arguments) == 1 and arguments[0].kind == "word":
            last = len(RANGES_DBVRMS) - 1
            place = Number(0.0, last).read_free(arguments, Quantity(index)).value
            return in_unit(RANGES_DBVRMS[int(place)], kept.unit)
        asked = Number(0.0, 0.0, RANGE).read_free(arguments, kept)
        dbvrms = from_volts_peak(volts_peak(asked), "DBVRMS").value
        if not RANGES_DBVRMS[0] - _SLACK_DB <= dbvrms <= RANGES_DBVRMS[-1] + _SLACK_DB:
            raise ScpiError(-222, "Out of range: value not changed.")
        fitting = [step for step in RANGES_DBVRMS if step >= dbvrms - _SLACK_DB]
        return in_unit(fitting[0], asked.unit)

    def show(self, value: Any) -> str:
        """The value in the unit kept."""
        return show_real(value.value)


def in_unit(dbvrms: int, unit: str) -> Quantity:
    """A range in the unit that it is kept in."""
    if unit in ("DBVRMS", "DBVR"):
        return Quantity(float(dbvrms), unit)
    return from_volts_peak(range_vpk(dbvrms), unit)


def nearest_range(quantity: Quantity) -> int:
    """The range in dBVrms behind a stored quantity."""
    dbvrms = from_volts_peak(volts_peak(quantity), "DBVRMS").value
    return min(RANGES_DBVRMS, key=lambda step: abs(step - dbvrms))


def autorange(dbvrms: int, peak_v: float) -> int:
    """The range that autorange settles on: up until no overload, down while below half."""
    index = RANGES_DBVRMS.index(dbvrms)
    while index < len(RANGES_DBVRMS) - 1 and peak_v > OVERLOAD_RATIO * range_vpk(
        RANGES_DBVRMS[index]
    ):
        index += 1
    while index > 0 and peak_v < 0.5 * range_vpk(RANGES_DBVRMS[index]):
        index -= 1
    return RANGES_DBVRMS[index]


def clipped_gain(peak_v: float, full_scale_vpk: float) -> float:
    """Fundamental that is left of a sine whose peak exceeds the converter's limit.

    The describing function of a limiter: 2/pi (asin(q) + q sqrt(1 - q^2)),
    with q the limit over the peak.
    """
    limit = OVERLOAD_RATIO * full_scale_vpk
    if peak_v <= limit:
        return 1.0
    q = limit / peak_v
    return 2.0 / math.pi * (math.asin(q) + q * math.sqrt(1.0 - q * q))


def coupling_gain(frequency_hz: float, coupling: str) -> complex:
    """First-order high-pass of AC coupling."""
    if coupling == "DC":
        return 1.0
    ratio = 1j * frequency_hz / _CORNER_HZ
    return ratio / (1.0 + ratio)
