"""The settings of the SR785 that a swept-sine response needs, one line each.

Owns names, ranges and what a read-back may be. What exists once per display is set for both and
read from each. Nothing here talks to a wire.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from daq.analyser import PointSettings
from daq.driving.replies import parse_number
from daq.errors import LimitError

__all__ = [
    "HIGHEST_HZ", "INTEGRATE", "LEAST_INTEGRATE_S", "LEAST_POINTS", "LEAST_SETTLE_S", "LOWEST_HZ",
    "MODELS", "MOST_POINTS", "POINTS", "SETTLE", "SPACING", "START", "STOP", "SWEEP_SETTINGS",
    "Numbers", "Setting", "check_drive", "display_settings", "level_command", "offset_command",
    "point_settings", "shown_settings", "standing_settings", "variance_settings",
]  # fmt: skip

LOWEST_HZ, HIGHEST_HZ = 1e-3, 102400.0
LEAST_POINTS, MOST_POINTS = 10, 2047
"""Of a sweep; the manual gives 2048, clients stop at 2047."""
LEAST_SETTLE_S, LEAST_INTEGRATE_S = 0.0078125, 0.015625
"""What a point settles and integrates at least, however short its cycles are."""
_HIGHEST_V = 5.0
"""Amplitude and offset share it."""
_LEVEL_STEP_V = 1e-4
_LEAST_SLEW, _MOST_SLEW = 0.001, 500.0
_LOWEST_DB, _HIGHEST_DB, _STEP_DB = -50, 34, 2


@dataclass(frozen=True, slots=True)
class Numbers:
    """What one model calls its groups and measurements."""

    swept_sine: int
    response: int
    variances: tuple[int, int] | None
    """Normalised variances of both channels; None where there are none."""


MODELS = {"SR785": Numbers(3, 47, (44, 45)), "SR780": Numbers(2, 32, None)}
"""Those of the SR780 are the ones of a public program for it (pyHegel), UNVERIFIED."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One thing that can be set and read back.

    Parameters
    ----------
    low, high
        What the instrument accepts; anything else is refused here.
    unit
        For people; sent with the value where `sends_unit`.
    slack
        How far a read-back may be off: absolute, or relative, whichever is more.
    per_display
        Whether there is one for each display.
    is_whole
        Whether it is a whole number.
    only
        The one display that is meant; None for both.
    """

    name: str
    mnemonic: str
    low: float
    high: float
    unit: str = ""
    slack: tuple[float, float] = (0.0, 1e-6)
    per_display: bool = False
    is_whole: bool = True
    sends_unit: bool = False
    only: int | None = None

    def command(self, value: Any) -> str:
        """The line that sets it.

        Raises
        ------
        LimitError
            If the value is not one that the instrument takes; nothing was sent.
        """
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise LimitError(f"{self.name} {value!r} is not a number; nothing was sent")
        if not self.low <= value <= self.high or (self.is_whole and value != int(value)):
            kind = "whole numbers from " if self.is_whole else ""
            raise LimitError(
                f"{self.name} {value:g} is outside the instrument's {kind}{self.low:g} to "
                f"{self.high:g}; nothing was sent"
            )
        shown = f"{int(value)}" if self.is_whole else f"{value:.9g}"
        unit = f" {self.unit}" if self.sends_unit else ""
        place = "" if not self.per_display else f"{2 if self.only is None else self.only},"
        return f"{self.mnemonic} {place}{shown}{unit}"

    @property
    def questions(self) -> tuple[str, ...]:
        """The lines that read it back."""
        if not self.per_display:
            return (f"{self.mnemonic}?",)
        places = (0, 1) if self.only is None else (self.only,)
        return tuple(f"{self.mnemonic}? {place}" for place in places)

    def value_of(self, reply: str) -> float:
        """The number in a read-back; some come with the index of a unit."""
        return parse_number(reply.partition(",")[0])

    def accepts(self, asked: float, found: float) -> bool:
        """Whether a number read back means the value asked for."""
        absolute, relative = self.slack
        return abs(found - asked) <= max(absolute, relative * abs(asked))

    def shown(self, found: float) -> str:
        """A number read back as it is recorded."""
        return f"{found:.9g} {self.unit}".rstrip()


def _choice(name: str, mnemonic: str, most: int, only: int | None = None) -> Setting:
    return Setting(name, mnemonic, 0, most, only=only, per_display=only is not None)


def _both(name: str, mnemonic: str, most: int) -> Setting:
    return Setting(name, mnemonic, 0, most, per_display=True)


def _frequency(name: str, mnemonic: str) -> Setting:
    return Setting(
        name, mnemonic, LOWEST_HZ, HIGHEST_HZ, "Hz", (1e-3, 1e-5), True, False, sends_unit=True
    )


def _time(name: str, mnemonic: str, low: float) -> Setting:
    # Steps of 3.906 ms.
    return Setting(name, mnemonic, low, 1000.0, "s", (2e-3, 1e-4), True, False)


START, STOP = _frequency("start (Hz)", "SSTR"), _frequency("stop (Hz)", "SSTP")
POINTS = Setting("points of a sweep", "SNPS", LEAST_POINTS, MOST_POINTS, per_display=True)
SPACING = _both("spacing (0 linear, 1 logarithmic)", "SSTY", 1)
SETTLE = Setting("settle cycles", "SSCY", 1, 32767, per_display=True)
INTEGRATE = Setting("integrate cycles", "SICY", 1, 32767, per_display=True)
_SETTLE_TIME = _time("settle time (s)", "SSTM", LEAST_SETTLE_S)
_INTEGRATE_TIME = _time("integrate time (s)", "SITM", LEAST_INTEGRATE_S)
_RAMP = _choice("source ramp", "SRMP", 1)
_RATE = Setting("source slew (V peak/s)", "SRAT", _LEAST_SLEW, _MOST_SLEW, is_whole=False,
                slack=(0.0, 1e-3))  # fmt: skip
_MEASUREMENT = tuple(_choice(f"measurement of display {d}", "MEAS", 99, i)
                     for i, d in enumerate("AB"))  # fmt: skip
_VIEW = tuple(_choice(f"view of display {d}", "VIEW", 8, i) for i, d in enumerate("AB"))


def _input(channel: int, what: str, mnemonic: str, most: int) -> Setting:
    return _choice(f"channel {channel} {what}", mnemonic.replace("#", str(channel)), most)


def _range(channel: int) -> Setting:
    return Setting(
        f"channel {channel} range (dBV peak)", f"I{channel}RG", _LOWEST_DB, _HIGHEST_DB, "dBVpk",
        (0.01, 0.0), sends_unit=True,
    )  # fmt: skip


REAL, IMAGINARY = 3, 4
"""Views."""


def display_settings(numbers: Numbers) -> list[tuple[Setting, float]]:
    """Display A holds the real part of the response, display B the imaginary part."""
    table: list[tuple[Setting, float]] = []
    for display, view in ((0, REAL), (1, IMAGINARY)):
        table += [(_MEASUREMENT[display], numbers.response), (_VIEW[display], view)]
    return table


def variance_settings(numbers: Numbers) -> list[tuple[Setting, float]]:
    """Display A holds the normalised variance of channel 1, display B that of channel 2."""
    table: list[tuple[Setting, float]] = []
    for display, measurement in enumerate(numbers.variances or ()):
        table += [(_MEASUREMENT[display], measurement), (_VIEW[display], REAL)]
    return table


_AUTO_LEVEL = _choice("automatic level", "SSAL", 2)
_AUTO_RESOLUTION = _both("automatic resolution", "SARS", 1)
SWEEP_SETTINGS = (START, STOP, SPACING, POINTS, _AUTO_LEVEL, _AUTO_RESOLUTION)
"""What bins mean depends on these."""
_LIVE, _DENSITY = _both("display live", "DISP", 1), _both("PSD units", "PSDU", 1)


def shown_settings(numbers: Numbers) -> list[tuple[Setting, float]]:
    """Whatever the values on the displays depend on while they show the response."""
    return [(_LIVE, 1), (_DENSITY, 0), *display_settings(numbers)]


def standing_settings(numbers: Numbers) -> list[tuple[Setting, float]]:
    """What every measurement is taken with, in the order of sending."""
    table: list[tuple[Setting, float]] = [
        (_choice("display format", "DFMT", 2), 1),
        (_LIVE, 1),
        *display_settings(numbers),
        (_both("dB units", "UNDB", 3), 0),
        (_both("peak units", "UNPK", 3), 0),
        (_DENSITY, 0),  # they spoil a swept sine
        (_both("phase units", "UNPH", 1), 0),
        (_choice("frequency axis in rpm", "RPMF", 1), 0),
        (_choice("offset correction", "IAOM", 1), 0),  # it would interrupt a sweep
    ]
    for channel in (1, 2):
        table += [
            (_input(channel, "differential", "I#MD", 1), 0),
            (_input(channel, "shield grounded", "I#GD", 1), 0),
            (_input(channel, "coupling (0 DC)", "I#CP", 2), 0),
            (_input(channel, "anti-alias filter", "I#AF", 1), 1),
            (_input(channel, "A-weighting", "I#AW", 1), 0),
        ]
    return [
        *table,
        (_AUTO_LEVEL, 0),
        (_AUTO_RESOLUTION, 0),  # it skips points and hides it
        (_both("repeat sweep", "SRPT", 1), 0),  # the source goes off after a single sweep only
        (_SETTLE_TIME, LEAST_SETTLE_S),
        (_INTEGRATE_TIME, LEAST_INTEGRATE_S),
    ]


def point_settings(settings: PointSettings) -> list[tuple[Setting, float]]:
    """Settle, integrate, slew and ranges of one level."""
    table: list[tuple[Setting, float]] = [
        (SETTLE, settings.settle_cycles),
        (INTEGRATE, settings.integrate_cycles),
    ]
    if settings.slew_vpk_per_s:
        table += [(_RAMP, 1), (_RATE, settings.slew_vpk_per_s)]
    else:
        table.append((_RAMP, 0))
    for channel, range_vpk in enumerate(settings.input_range_vpk, start=1):
        automatic = _input(channel, "autorange", "A#RG", 1)
        if range_vpk is None:
            # Tracking, as a servo's response spans more than one range holds.
            table += [(automatic, 0), (_input(channel, "autorange tracks", "I#AR", 1), 1)]
            table.append((automatic, 1))
        else:
            table += [(automatic, 0), (_range(channel), range_db(range_vpk))]
    # What is set twice is read back once, as it is in the end.
    return table


def range_db(range_vpk: float) -> int:
    """The range that holds so many V peak: up to the next even dBV peak.

    Raises
    ------
    LimitError
        If there is none.
    """
    decibels = 20.0 * math.log10(range_vpk) if range_vpk > 0 else -math.inf
    even = _STEP_DB * math.ceil(decibels / _STEP_DB - 1e-9) if math.isfinite(decibels) else -99
    if not _LOWEST_DB <= even <= _HIGHEST_DB:
        raise LimitError(
            f"input range {range_vpk:g} V peak is outside the instrument's 3.2 mV to 50.1 V; "
            "nothing was sent"
        )
    return even


def level_command(mnemonic: str, level_v: float) -> str:
    """The line that sets a source level; the unit goes with it always."""
    return f"{mnemonic} {1000.0 * level_v:.7g} mV"


def offset_command(offset_v: float) -> str:
    """The line that sets the source's offset."""
    return f"SOFF {1000.0 * offset_v:.7g} mV"


def check_drive(settings: PointSettings) -> None:
    """Refuse a level and offset that the source cannot give as asked; sends nothing.

    Raises
    ------
    LimitError
        Also for a level too small to be set.
    """
    level_v, offset_v = settings.source_vpk, settings.dc_offset_v
    if not (math.isfinite(level_v) and math.isfinite(offset_v)):
        raise LimitError(
            f"source level {level_v!r} and offset {offset_v!r} must be finite; nothing was sent"
        )
    if level_v < _LEVEL_STEP_V:
        raise LimitError(
            f"source level {level_v:g} V peak is below the smallest step of "
            f"{_LEVEL_STEP_V:g} V; nothing was sent"
        )
    if level_v + abs(offset_v) > _HIGHEST_V:
        raise LimitError(
            f"source level {level_v:g} V peak and offset {offset_v:g} V make "
            f"{level_v + abs(offset_v):g} V; the source gives {_HIGHEST_V:g} V, nothing was sent"
        )
