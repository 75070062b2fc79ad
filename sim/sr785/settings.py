"""The SR785's settings: what each may be, where it may be set, and what it is at first.

Owns the table and the values. What a change leads to is the instrument's matter.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sim.sr785.choices import Choices
from sim.sr785.language import ExecutionFault, number, whole

__all__ = ["FFT", "GROUPS", "MEASUREMENTS", "SWEPT", "Level", "Real", "Settings", "Whole"]

FFT, SWEPT = "FFT", "swept sine"
GROUPS: dict[str, dict[int, str]] = {
    "SR785": {0: FFT, 1: "correlation", 2: "octave", 3: SWEPT, 4: "order", 5: "time/histogram"},
    "SR780": {0: FFT, 1: "octave", 2: SWEPT},
}
MEASUREMENTS: dict[str, dict[str, dict[int, str]]] = {
    "SR785": {
        FFT: {0: "FFT 1", 1: "FFT 2", 2: "power 1", 3: "power 2", 4: "time 1", 5: "time 2",
              9: "coherence", 10: "cross spectrum", 11: "frequency response"},
        SWEPT: {42: "spectrum 1", 43: "spectrum 2", 44: "variance 1", 45: "variance 2",
                46: "cross spectrum", 47: "frequency response",
                **{48 + i: f"user {i + 1}" for i in range(5)}},
    },
    "SR780": {
        FFT: {0: "FFT 1", 1: "FFT 2", 2: "time 1", 3: "time 2", 7: "coherence",
              8: "cross spectrum", 9: "frequency response"},
        SWEPT: {29: "spectrum 1", 30: "spectrum 2", 31: "cross spectrum",
                32: "frequency response", **{33 + i: f"user {i + 1}" for i in range(5)}},
    },
}  # fmt: skip
"""By model, group and number. [S] Those of the SR780 are from a
public program for it (pyHegel), which lists no normalised variance."""

FREQUENCY = (("Hz", 1.0), ("kHz", 1e3), ("mHz", 1e-3))
TIME = (("s", 1.0), ("ms", 1e-3), ("us", 1e-6))
VOLTS = (("V", 1.0), ("mV", 1e-3))
RANGE = ("dBVpk", "dBVpp", "dBVrms", "Vpk", "Vpp", "Vrms")
_RATIO = {"pk": 1.0, "pp": 2.0, "rms": 1.0 / math.sqrt(2.0)}


@dataclass(frozen=True, slots=True)
class Whole:
    """A whole number."""

    low: int
    high: int
    first: int
    group: str | None = None
    per_display: bool = False

    def read(self, text: str, choices: Choices) -> int:
        """The value that was sent."""
        return whole(text, self.low, self.high)

    def show(self, value: float, choices: Choices) -> str:
        """The value as it is answered."""
        return str(int(value))


@dataclass(frozen=True, slots=True)
class Real:
    """A number on a grid, with units."""

    low: float
    high: float
    first: float
    units: tuple[tuple[str, float], ...] = ()
    step: float = 0.0
    group: str | None = None
    per_display: bool = False

    def read(self, text: str, choices: Choices) -> float:
        """The value that was sent, on the grid."""
        value, _ = number(text, self.units)
        if not self.low * (1 - 1e-9) <= value <= self.high * (1 + 1e-9):
            raise ExecutionFault(text)
        if self.step:
            value = round(value / self.step) * self.step
        return min(max(value, self.low), self.high)

    def show(self, value: float, choices: Choices) -> str:
        """The value as it is answered."""
        return f"{value:.{choices.digits}g}"


@dataclass(frozen=True, slots=True)
class Level:
    """A source level: V peak inside, with the index of the unit it was sent in."""

    high_v: float
    first: tuple[float, int]
    group: str | None = None
    per_display: bool = False

    def read(self, text: str, choices: Choices) -> tuple[float, int]:
        """The level that was sent, V peak, and the index of its unit."""
        names = choices.level_units
        value, index = number(text, tuple((name, math.nan) for name in names))
        volts = _from_unit(value, names[index])
        if not 0.0 <= volts <= self.high_v * (1 + 1e-9):
            raise ExecutionFault(text)
        return round(volts / 1e-4) * 1e-4, index

    def show(self, value: tuple[float, int], choices: Choices) -> str:
        """Number and index of the unit."""
        volts, index = value
        if choices.level_reply is not None:
            index = choices.level_units.index(choices.level_reply)
        shown = _in_unit(volts, choices.level_units[index])
        return f"{shown:.{choices.digits}g},{index}"


@dataclass(frozen=True, slots=True)
class InputRange:
    """An input range: dBVpk in steps of 2 dB, rounded up."""

    first: int
    group: str | None = None
    per_display: bool = False

    def read(self, text: str, choices: Choices) -> int:
        """The range that was sent, in dBVpk."""
        value, index = number(text, tuple((name, math.nan) for name in RANGE))
        volts = _from_unit(value, RANGE[index])
        if volts <= 0:
            raise ExecutionFault(text)
        decibels = 20.0 * math.log10(volts)
        if not -50.01 <= decibels <= 34.01:
            raise ExecutionFault(text)
        return 2 * math.ceil(decibels / 2 - 0.005)

    def show(self, value: int, choices: Choices) -> str:
        """Number and index of the unit."""
        return f"{value},0"


def _from_unit(value: float, unit: str) -> float:
    """V peak."""
    if unit.startswith("dBV"):
        return float(10.0 ** (value / 20.0)) / _RATIO[unit[3:]]
    scale = 1e-3 if unit.startswith("m") else 1.0
    return value * scale / _RATIO[unit.removeprefix("m")[1:] or "pk"]


def _in_unit(volts: float, unit: str) -> float:
    if unit.startswith("dBV"):
        return 20.0 * math.log10(max(volts * _RATIO[unit[3:]], 1e-10))
    scale = 1e3 if unit.startswith("m") else 1.0
    return volts * scale * _RATIO[unit.removeprefix("m")[1:] or "pk"]


Kind = Whole | Real | Level | InputRange


def _inputs() -> dict[str, Kind]:
    table: dict[str, Kind] = {}
    for n in ("1", "2"):
        table |= {
            f"I{n}MD": Whole(0, 1, 0), f"I{n}GD": Whole(0, 1, 1), f"I{n}CP": Whole(0, 2, 0),
            f"I{n}RG": InputRange(0), f"A{n}RG": Whole(0, 1, 1), f"I{n}AR": Whole(0, 1, 0),
            f"I{n}AF": Whole(0, 1, 1), f"I{n}AW": Whole(0, 1, 0),
        }  # fmt: skip
    return table


def _display(kind: Kind, group: str | None = None) -> Kind:
    return replace(kind, per_display=True, group=group)


TABLE: dict[str, Kind] = {
    "OUTX": Whole(0, 1, 0),
    "DFMT": Whole(0, 2, 0), "ACTD": Whole(0, 1, 0), "DISP": _display(Whole(0, 1, 1)),
    "UNDB": _display(Whole(0, 3, 1)), "UNPK": _display(Whole(0, 3, 1)),
    "PSDU": _display(Whole(0, 1, 0)), "UNPH": _display(Whole(0, 1, 0)), "RPMF": Whole(0, 1, 0),
    "FBAS": _display(Whole(0, 1, 1)), "LINK": Whole(0, 1, 1), "ISRC": Whole(0, 1, 0),
    "IAOM": Whole(0, 1, 1),
    **_inputs(),
    "SSTR": _display(Real(1e-3, 102400.0, 100.0, FREQUENCY), SWEPT),
    "SSTP": _display(Real(1e-3, 102400.0, 102400.0, FREQUENCY), SWEPT),
    "SRPT": _display(Whole(0, 1, 0), SWEPT), "SSTY": _display(Whole(0, 1, 1), SWEPT),
    "SNPS": _display(Whole(10, 2048, 100), SWEPT), "SARS": _display(Whole(0, 1, 0), SWEPT),
    "SSKP": _display(Whole(2, 256, 10), SWEPT),
    "SFST": _display(Real(0.01, 3.0, 0.05), SWEPT), "SSLO": _display(Real(0.05, 6.0, 0.5), SWEPT),
    "SSTM": _display(Real(0.0078125, 1000.0, 0.0078125, TIME, 0.00390625), SWEPT),
    "SSCY": _display(Whole(1, 32767, 1), SWEPT),
    "SITM": _display(Real(0.015625, 1000.0, 0.015625, TIME, 0.00390625), SWEPT),
    "SICY": _display(Whole(1, 32767, 1), SWEPT),
    "STYP": Whole(0, 3, 0), "SRCO": Whole(0, 1, 0), "SOFF": Real(-5.0, 5.0, 0.0, VOLTS, 1e-4),
    "SSAM": Level(5.0, (0.1, 0), SWEPT), "SSAL": Whole(0, 2, 0, SWEPT),
    "SSRF": Level(5.0, (0.1, 0), SWEPT), "SMAX": Level(5.0, (5.0, 1), SWEPT),
    "SSUL": Real(0.1, 30.0, 1.0, group=SWEPT), "SSLL": Real(-30.0, -0.1, -1.0, group=SWEPT),
    "SRMP": Whole(0, 1, 0, SWEPT), "SRAT": Real(0.001, 500.0, 1.0, group=SWEPT),
    "S1FR": Real(0.0, 102400.0, 1000.0, FREQUENCY), "S1AM": Level(5.0, (0.5, 0)),
    "S2FR": Real(0.0, 102400.0, 2000.0, FREQUENCY), "S2AM": Level(5.0, (0.0, 0)),
    "FSPN": _display(Real(0.09765625, 102400.0, 102400.0, FREQUENCY), FFT),
    "FSTR": _display(Real(0.0, 102400.0, 0.0, FREQUENCY), FFT),
    "FCTR": _display(Real(0.0, 102400.0, 51200.0, FREQUENCY), FFT),
    "FLIN": _display(Whole(0, 3, 2), FFT), "FAVG": _display(Whole(0, 1, 0), FFT),
    "FAVM": _display(Whole(0, 3, 0), FFT), "FAVT": _display(Whole(0, 2, 0), FFT),
    "FAVN": _display(Whole(2, 32767, 2), FFT), "FWIN": _display(Whole(0, 9, 2), FFT),
    "FREJ": _display(Whole(0, 1, 0), FFT), "FOVL": _display(Real(0.0, 100.0, 50.0), FFT),
    "TMOD": Whole(0, 6, 0), "TSRC": Whole(0, 5, 0), "LOCL": Whole(0, 2, 0),
}  # fmt: skip
"""Every setting that is only kept, with its presets [S]; MGRP, MEAS and VIEW are the traces'."""

Changed = Callable[[str], None]


class Settings:
    """Values of all settings; of a display where a setting has one for each."""

    def __init__(self, choices: Choices) -> None:
        self._choices = choices
        self._values: dict[tuple[str, int], object] = {}
        self.reset()

    def reset(self) -> None:
        """Everything at its preset but ``PSDU``, which lives on."""
        kept = {key: value for key, value in self._values.items() if key[0] == "PSDU"}
        for name, kind in TABLE.items():
            for display in (0, 1):
                self._values[name, display] = kind.first
        self._values |= kept
        self.put("OUTX", self._choices.outx)

    def get(self, name: str, display: int = 0) -> float:
        """A value as a number; of a level V peak."""
        value = self._values[name, display]
        return value[0] if isinstance(value, tuple) else value  # type: ignore[return-value]

    def axis_hz(self) -> NDArray[np.float64]:
        """Frequency of each bin of a sweep, ascending, shape (SNPS,)."""
        low, high = sorted((self.get("SSTR"), self.get("SSTP")))
        spaced = np.geomspace if self.get("SSTY") else np.linspace
        return spaced(low, high, int(self.get("SNPS")))

    def shown(self, name: str, display: int = 0) -> str:
        """A value as it is answered."""
        return TABLE[name].show(self._values[name, display], self._choices)  # type: ignore[arg-type]

    def read(self, name: str, text: str) -> object:
        """The value that a text means; raises `CommandFault` or `ExecutionFault`."""
        return TABLE[name].read(text, self._choices)

    def put(self, name: str, value: object, display: int | None = None) -> None:
        """Keep a value, for both displays if none is named."""
        for place in (0, 1) if display is None else (display,):
            self._values[name, place] = value
