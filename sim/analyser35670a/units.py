"""Suffixes of numbers, and what they mean.

Owns the tables of units that a command accepts and the conversion of sine
amplitudes between peak, effective and decibel units. It checks no range.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from sim.analyser35670a.errors import ScpiError

__all__ = [
    "CYCLES_OR_SECONDS",
    "DECIBEL",
    "FREQUENCY",
    "LEVEL",
    "NONE",
    "PERCENT",
    "RANGE",
    "RESOLUTION",
    "RPM",
    "SECONDS",
    "SLEW",
    "SPAN",
    "VOLT",
    "Quantity",
    "UnitTable",
    "from_volts_peak",
    "volts_peak",
]

_MINUS_INFINITY = -9.9e37


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number and the unit that it is kept and reported in."""

    value: float
    unit: str = ""


@dataclass(frozen=True, slots=True)
class UnitTable:
    """Suffixes that one command accepts.

    Parameters
    ----------
    suffixes
        By suffix: the unit that is kept, and the factor to it.
    bare
        Unit of a number without suffix; None keeps the unit that was set last.
    """

    suffixes: Mapping[str, tuple[str, float]]
    bare: str | None

    def read(self, number: float, suffix: str, kept: str) -> Quantity:
        """A number as sent.

        Raises
        ------
        ScpiError
            -131 if the suffix is not one of the table's.
        """
        if not suffix:
            return Quantity(number, self.bare if self.bare is not None else kept)
        if suffix not in self.suffixes:
            raise ScpiError(-131)
        unit, factor = self.suffixes[suffix]
        return Quantity(number * factor, unit)


def _table(bare: str | None, **units: tuple[str, ...]) -> UnitTable:
    """Units with the prefixes that the bus standard gives them."""
    factors = {"": 1.0, "K": 1e3, "MA": 1e6, "M": 1e-3, "U": 1e-6, "N": 1e-9}
    suffixes = {}
    for unit, prefixes in units.items():
        name = unit.replace("_", "/")
        for prefix in ("", *prefixes):
            suffixes[prefix + name] = (name, factors[prefix])
    return UnitTable(suffixes, bare)


_SMALL = ("M", "U")
_AMPLITUDES: dict[str, tuple[str, ...]] = {
    "VPK": _SMALL,
    "VRMS": _SMALL,
    "V": _SMALL,
    "DBVRMS": (),
    "DBVPK": (),
    "DBV": (),
    "DBVR": (),
}

NONE = UnitTable({}, "")
FREQUENCY = UnitTable(
    {
        "HZ": ("HZ", 1.0),
        "KHZ": ("HZ", 1e3),
        # The standard reads MHZ as mega, the one exception to M for milli.
        "MHZ": ("HZ", 1e6),
        "MAHZ": ("HZ", 1e6),
        "CPM": ("HZ", 1.0 / 60.0),
    },
    "HZ",
)
SPAN = UnitTable({**FREQUENCY.suffixes, "DEC": ("DEC", 1.0), "OCT": ("OCT", 1.0)}, "HZ")
SECONDS = _table("S", S=("K", "M", "U", "N"))
CYCLES_OR_SECONDS = _table(None, S=("M", "U", "N"), CYCLE=())
RESOLUTION = UnitTable(
    {
        **FREQUENCY.suffixes,
        "PCT": ("PCT", 1.0),
        "PNT/SWP": ("PNT/SWP", 1.0),
        "PNT/DEC": ("PNT/DEC", 1.0),
        "PNT/OCT": ("PNT/OCT", 1.0),
    },
    None,
)
RANGE = _table("DBVRMS", **_AMPLITUDES)
"""Of an input range: the manual gives dBVrms to a bare number."""
LEVEL = _table(None, **_AMPLITUDES)
"""Of a source level. [S] A bare number has the unit that was set last, VPK after preset."""
VOLT = _table("V", V=("K", *_SMALL))
SLEW = _table(None, V_S=("M",), VPK_S=("M",), VRMS_S=("M",))
PERCENT = _table("PCT", PCT=())
DECIBEL = _table("DB", DB=())
RPM = _table("RPM", RPM=())


def volts_peak(quantity: Quantity) -> float:
    """Amplitude of a sine in V peak. [S] A bare V or DBV counts as peak."""
    match quantity.unit:
        case "VRMS":
            return quantity.value * math.sqrt(2.0)
        case "DBVRMS" | "DBVR":
            return _power(quantity.value) * math.sqrt(2.0)
        case "DBVPK" | "DBV":
            return _power(quantity.value)
    return quantity.value


def _power(decibel: float) -> float:
    try:
        return float(10.0 ** (decibel / 20.0))
    except OverflowError:
        return math.inf


def from_volts_peak(volts: float, unit: str) -> Quantity:
    """Amplitude in the unit asked for; 0 V is -9.9e37 in decibel units."""
    if unit in ("DBVRMS", "DBVR", "DBVPK", "DBV"):
        if volts <= 0:
            return Quantity(_MINUS_INFINITY, unit)
        scale = math.sqrt(0.5) if unit.startswith("DBVR") else 1.0
        return Quantity(20.0 * math.log10(volts * scale), unit)
    return Quantity(volts * math.sqrt(0.5) if unit == "VRMS" else volts, unit)
