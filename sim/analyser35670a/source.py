"""The source: what level comes out of the connector, and how it gets there.

Owns the grids of level and offset, the rule that amplitude and offset share
10 V, and the ramp between levels. It does not decide when the source is on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sim.analyser35670a.commands.tokens import Argument
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.kinds import Number, show_real
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.units import Quantity, UnitTable, from_volts_peak, volts_peak

__all__ = [
    "HIGHEST_VPK",
    "Amplitude",
    "check_level",
    "check_offset",
    "fit_offset",
    "slew_vpk_per_s",
]

HIGHEST_VPK = 5.0
_HIGHEST_SUM_V = 10.0
_COARSE_FROM_VPK = 0.2 * math.sqrt(2.0)
_COARSE_STEP_VPK = 2.5e-3
_FINE_STEP_VPK = 0.25e-3
_OFFSET_FINE_WITHIN_V = 2.0
_OFFSET_FINE_STEP_V = 1e-3
_OFFSET_COARSE_STEP_V = 5e-3
_OUT_OF_RANGE = "Out of range: value not changed."


def _level_grid(vpk: float) -> float:
    """Nearest step. [S] The manual gives the steps and not the direction of rounding."""
    step = _COARSE_STEP_VPK if vpk >= _COARSE_FROM_VPK else _FINE_STEP_VPK
    return round(round(vpk / step) * step, 6)


def _offset_grid(volts: float) -> float:
    step = _OFFSET_FINE_STEP_V if abs(volts) <= _OFFSET_FINE_WITHIN_V else _OFFSET_COARSE_STEP_V
    return round(round(volts / step) * step, 6)


def check_level(
    _instrument: InstrumentCore, _numbers: tuple[int, ...], asked: Quantity
) -> Quantity:
    """Coerce a level to the source's steps; the unit sent is the unit kept."""
    return from_volts_peak(min(_level_grid(volts_peak(asked)), HIGHEST_VPK), asked.unit)


def check_offset(
    instrument: InstrumentCore, _numbers: tuple[int, ...], asked: Quantity
) -> Quantity:
    """Coerce an offset; moved without a word where the amplitude leaves too little room."""
    room = _HIGHEST_SUM_V - volts_peak(instrument.settings.get("SOUR:VOLT"))
    wanted = _offset_grid(asked.value)
    if abs(wanted) > room:
        step = _OFFSET_COARSE_STEP_V if room > _OFFSET_FINE_WITHIN_V else _OFFSET_FINE_STEP_V
        wanted = math.copysign(round(math.floor(room / step + 1e-9) * step, 6), wanted)
    return Quantity(wanted, "V")


def fit_offset(instrument: InstrumentCore, numbers: tuple[int, ...] = ()) -> None:
    """Move the offset after the level has grown."""
    kept = instrument.settings.get("SOUR:VOLT:OFFS")
    moved = check_offset(instrument, numbers, kept)
    if moved != kept:
        instrument.settings.put("SOUR:VOLT:OFFS", moved)


@dataclass(frozen=True, slots=True)
class Amplitude:
    """A sine's amplitude in any of its units, within a range in V peak."""

    units: UnitTable
    lowest_vpk: float
    highest_vpk: float

    def read(self, arguments: Sequence[Argument], kept: Any) -> Quantity:
        """The amplitude sent, a bound, or the next step, in the unit sent or kept."""
        present = volts_peak(kept)
        in_volts = Number(self.lowest_vpk, self.highest_vpk, self.units, _COARSE_STEP_VPK)
        if len(arguments) == 1 and arguments[0].kind == "word":
            vpk = in_volts.read_free(arguments, Quantity(present, "VPK")).value
            return from_volts_peak(vpk, kept.unit)
        asked = in_volts.read_free(arguments, kept)
        # 13.979 dBVpk is 5 Vpk and a hair; what the manual prints must pass.
        if not self.lowest_vpk * 0.9999 <= volts_peak(asked) <= self.highest_vpk * 1.0001:
            raise ScpiError(-222, _OUT_OF_RANGE)
        return asked

    def show(self, value: Any) -> str:
        """The value in the unit kept."""
        return show_real(value.value)


def slew_vpk_per_s(quantity: Quantity) -> float:
    """Rate in V peak per second."""
    return quantity.value * (math.sqrt(2.0) if quantity.unit == "VRMS/S" else 1.0)
