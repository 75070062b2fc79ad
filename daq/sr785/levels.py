"""Source levels of the SR785 as they are answered: a number and the index of its unit.

Owns the reading of such answers. Clients list different units for the same index, so that a unit
is judged by what two known settings read back as, and never by its index alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from daq.driving.replies import parse_integer, parse_number
from daq.errors import ProtocolError

__all__ = ["LevelScale", "is_zero", "scale_of"]

_LINEAR = (0, 1, 3, 4)
"""Indices that every list known gives to a unit in which no signal is 0."""
_NOTHING_DB = -100.0
"""What is no signal in any unit of dB."""
_PRINTING = 1e-3


def _read(reply: str) -> tuple[float, int | None]:
    number, comma, unit = reply.partition(",")
    return parse_number(number), parse_integer(unit) if comma else None


def is_zero(reply: str) -> bool:
    """Whether an answer means that there is no level, whatever its unit may be."""
    value, unit = _read(reply)
    if unit is None or unit in _LINEAR:
        return value == 0
    # In dB 0 is a volt: another unit proves nothing but by a very small number.
    return value <= _NOTHING_DB


@dataclass(frozen=True, slots=True)
class LevelScale:
    """What an answered number means, as proven on the instrument."""

    unit: int | None
    """Index that comes with it."""
    per_volt: float
    """Number for 1 V peak; nan for decibels above 1 V peak."""

    def volts(self, reply: str) -> float:
        """A level in V peak.

        Raises
        ------
        ProtocolError
            If it is no level, or in another unit than the one proven.
        """
        value, unit = _read(reply)
        if unit != self.unit:
            raise ProtocolError(
                f"a level in unit {self.unit} was due, and {reply!r} came; is somebody changing "
                "the unit at the front panel?"
            )
        if math.isnan(self.per_volt):
            return float(10.0 ** (value / 20.0))
        return value / self.per_volt


def scale_of(first: tuple[float, str], second: tuple[float, str]) -> LevelScale:
    """The scale that explains two levels sent, V peak, and what each read back as.

    Raises
    ------
    ProtocolError
        If none does.
    """
    (low_v, low_reply), (high_v, high_reply) = first, second
    low, unit = _read(low_reply)
    high, other = _read(high_reply)
    if unit == other:
        for per_volt in (1000.0, 1.0):
            if _agrees(low, low_v * per_volt) and _agrees(high, high_v * per_volt):
                return LevelScale(unit, per_volt)
        decibels = 20.0 * math.log10(low_v), 20.0 * math.log10(high_v)
        if abs(low - decibels[0]) < 0.02 and abs(high - decibels[1]) < 0.02:
            return LevelScale(unit, math.nan)
    raise ProtocolError(
        f"levels of {low_v * 1000:g} and {high_v * 1000:g} mV peak read back as {low_reply!r} and "
        f"{high_reply!r}, which is neither mV, V nor dBV peak; set the source's unit to V peak at "
        "the front panel"
    )


def _agrees(value: float, due: float) -> bool:
    return abs(value - due) <= _PRINTING * abs(due)
