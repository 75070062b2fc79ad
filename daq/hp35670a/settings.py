"""The settings of the HP 35670A that a swept-sine response needs, one line each.

Ranges are those of swept-sine mode with two channels (programming guide,
chapters 12, 13, 16, 18, 19). Every number goes out with its unit: a bare
number to an input range means dBVrms, and that of a bare level is not stated.
Nothing here talks to a wire.
"""

from __future__ import annotations

from typing import Any

from daq.analyser import PointSettings
from daq.driving.settings import Choice, Number, Setting, Switch, down_to, near, up_to
from daq.errors import LimitError

__all__ = [
    "CALCULATE",
    "CHANNEL_RESPONSE",
    "CONTINUOUS",
    "DC_OFFSET",
    "DIRECTION",
    "GRID_HZ",
    "INPUT_RANGE",
    "LEVEL",
    "MANUAL_FREQUENCY",
    "MODE",
    "RESOLUTION",
    "SETTINGS",
    "SLEW",
    "SPACING",
    "SPAN",
    "START",
    "STEPPING",
    "STOP",
    "check_drive",
    "point_settings",
    "standing_settings",
]

GRID_HZ = 1.0 / 64.0
"""The grid of start, stop, centre and span, 15.625 mHz."""

_LOWEST_HZ, _HIGHEST_HZ = GRID_HZ, 51200.0
_RANGE_STEP = 10.0 ** (2.0 / 20.0)
_LEVEL_STEP_VPK = 2.5e-3
_MOST_CYCLES = 234
"""As printed for the integration; perhaps a lost superscript. UNVERIFIED, so the low reading."""
_SOURCE_SUM_V = 10.0
"""Amplitude and offset share this much; beyond it the offset would be moved without a word."""
_AMPLITUDES = ("VPK", "VRMS", "DBVPK", "DBVRMS")

# Mode and run control

MODE = Choice("instrument mode", "INST:SEL", ("FFT", "SINE"))
CONTINUOUS = Switch("continuous measurement", "INIT:CONT")
AUTOCALIBRATION = Switch("automatic calibration", "CAL:AUTO")

# Inputs


CHANNEL_ON = tuple(Switch(f"channel {n} on", f"INP{n}") for n in (1, 2))
COUPLING = tuple(Choice(f"channel {n} coupling", f"INP{n}:COUP", ("AC", "DC")) for n in (1, 2))
SHIELD = tuple(
    Choice(f"channel {n} shield", f"INP{n}:LOW", ("FLO", "GRO"), ("FLOAT", "GROUND"))
    for n in (1, 2)
)
SENSOR_SUPPLY = tuple(Switch(f"channel {n} sensor supply", f"INP{n}:BIAS") for n in (1, 2))
ANTI_ALIAS = tuple(Switch(f"channel {n} anti-alias filter", f"INP{n}:FILT") for n in (1, 2))
AUTORANGE = tuple(Switch(f"channel {n} autorange", f"VOLT{n}:RANG:AUTO") for n in (1, 2))
INPUT_RANGE = tuple(
    Number(
        f"channel {n} range (V peak)",
        f"VOLT{n}:RANG",
        "VPK",
        low=3.99e-3,
        high=31.7,
        # Rounded up to the next 2 dB step; printed limits have three digits.
        rounding=lambda value: (0.998 * value, 1.002 * _RANGE_STEP * value),
        reply_units=_AMPLITUDES,
        asks_unit=True,
    )
    for n in (1, 2)
)

# Frequency and sweep

ANCHOR = Choice("span anchor", "FREQ:SPAN:LINK", ("STAR", "CENT"), ("START", "CENTER"))
SPAN = Number("span (Hz)", "FREQ:SPAN", "HZ", GRID_HZ, _HIGHEST_HZ, up_to(GRID_HZ))
START = Number("start (Hz)", "FREQ:STAR", "HZ", _LOWEST_HZ, 51199.984375, down_to(GRID_HZ))
STOP = Number("stop (Hz)", "FREQ:STOP", "HZ", 2 * GRID_HZ, _HIGHEST_HZ, up_to(GRID_HZ))
SPACING = Choice("spacing", "SWE:SPAC", ("LIN", "LOG"), ("LINEAR", "LOGARITHMIC"))
AUTO_RESOLUTION = Switch("automatic resolution", "FREQ:RES:AUTO")
RESOLUTION = Number("points of a sweep", "FREQ:RES", "PNT/SWP", 3, 801, asks_unit=True)
DIRECTION = Choice("sweep direction", "SWE:DIR", ("UP", "DOWN"))
STEPPING = Choice("sweep mode", "SWE:MODE", ("AUTO", "MAN"), ("AUTO", "MANUAL"))
MANUAL_FREQUENCY = Number(
    "manual frequency (Hz)", "FREQ:MAN", "HZ", _LOWEST_HZ, _HIGHEST_HZ, near(GRID_HZ)
)
SETTLE = Number("settle cycles", "SWE:STIM", "CYCLE", 0, 9.9e37, asks_unit=True)
INTEGRATE = Number("integrate cycles", "SWE:DWEL", "CYCLE", 1, _MOST_CYCLES, asks_unit=True)
FAST_DISPLAY = Switch("display after the sweep only", "AVER:IRES")

# Source

LEVEL = Number(
    "source level (V peak)",
    "SOUR:VOLT",
    "VPK",
    low=0.0,
    high=5.0,
    # Steps of 2.5 mV, of 0.25 mV below 0.2 V rms; which way it rounds is not stated.
    rounding=lambda value: (value - _level_step(value), value + _level_step(value)),
    reply_units=_AMPLITUDES,
    asks_unit=True,
)
DC_OFFSET = Number(
    "source offset (V)",
    "SOUR:VOLT:OFFS",
    "V",
    low=-10.0,
    high=10.0,
    rounding=lambda value: (value - _offset_step(value), value + _offset_step(value)),
)
SLEW = Number("source slew (V peak/s)", "SOUR:VOLT:SLEW", "VPK/S", 0.0, 10000.0, asks_unit=True)
AUTO_LEVEL = Switch("automatic level", "SOUR:VOLT:AUTO")

# Results

CHANNEL_RESPONSE = "XFR:POW:RAT 2,1"
FORMAT = Choice("number format", "FORM", ("REAL,64",), ("REAL,+64",))
_FEEDS = (CHANNEL_RESPONSE, "XFR:POW:VAR 1", "XFR:POW:VAR 2")
CALCULATE = (
    # Trace A shows the operator the gain in dB; its complex data are read raw.
    (Choice("trace A data", "CALC1:FEED", _FEEDS, quoted=True), CHANNEL_RESPONSE),
    (Choice("trace A coordinates", "CALC1:FORM", ("MLOG",), ("MLOGARITHMIC",)), "MLOG"),
    (Choice("trace B data", "CALC2:FEED", _FEEDS, quoted=True), "XFR:POW:VAR 1"),
    (Choice("trace B coordinates", "CALC2:FORM", ("REAL",)), "REAL"),
    (Choice("trace C data", "CALC3:FEED", _FEEDS, quoted=True), "XFR:POW:VAR 2"),
    (Choice("trace C coordinates", "CALC3:FORM", ("REAL",)), "REAL"),
)
"""What the traces hold, with the value of each; overlapped commands, to be synchronised."""

SETTINGS: tuple[Setting, ...] = (
    MODE, CONTINUOUS, AUTOCALIBRATION,
    *CHANNEL_ON, *COUPLING, *SHIELD, *SENSOR_SUPPLY, *ANTI_ALIAS, *AUTORANGE, *INPUT_RANGE,
    ANCHOR, SPAN, START, STOP, SPACING, AUTO_RESOLUTION, RESOLUTION, DIRECTION, STEPPING,
    MANUAL_FREQUENCY, SETTLE, INTEGRATE, FAST_DISPLAY,
    LEVEL, DC_OFFSET, SLEW, AUTO_LEVEL, FORMAT, *(setting for setting, _ in CALCULATE),
)  # fmt: skip
"""All of them, for the one test that goes over all."""


def standing_settings() -> list[tuple[Setting, Any]]:
    """What every measurement is taken with, in the order of sending.

    The first four are those in which ``*RST`` and a preset differ; none is
    left to either.
    """
    inputs: list[tuple[Setting, Any]] = []
    for channel in (0, 1):
        inputs += [
            (CHANNEL_ON[channel], True),
            (COUPLING[channel], "DC"),  # AC coupling would turn the phase at servo frequencies
            (SHIELD[channel], "FLO"),
            (SENSOR_SUPPLY[channel], False),
            (ANTI_ALIAS[channel], True),  # without it flatness is not corrected
        ]
    return [
        (AUTO_RESOLUTION, False),
        (AUTOCALIBRATION, False),
        (CONTINUOUS, False),
        (ANCHOR, "STAR"),
        *inputs,
        (AUTO_LEVEL, False),
        (FAST_DISPLAY, False),
        (FORMAT, "REAL,64"),
    ]


def point_settings(settings: PointSettings) -> list[tuple[Setting, Any]]:
    """Settle, integrate, slew and ranges of one level."""
    ranges: list[tuple[Setting, Any]] = []
    for channel, range_vpk in enumerate(settings.input_range_vpk):
        if range_vpk is None:
            ranges.append((AUTORANGE[channel], True))
        else:
            ranges.append((INPUT_RANGE[channel], range_vpk))
            ranges.append((AUTORANGE[channel], False))
    return [
        (SETTLE, settings.settle_cycles),
        (INTEGRATE, settings.integrate_cycles),
        (SLEW, settings.slew_vpk_per_s),
        *ranges,
    ]


def check_drive(settings: PointSettings) -> None:
    """Refuse a level and offset that the source cannot give as asked; sends nothing.

    Raises
    ------
    LimitError
        Also for a level of 0, which would park the sweep for ever.
    """
    LEVEL.command(settings.source_vpk)
    DC_OFFSET.command(settings.dc_offset_v)
    if settings.source_vpk < _level_step(settings.source_vpk):
        raise LimitError(
            f"source level {settings.source_vpk:g} V peak is below the smallest step; "
            "a level of 0 parks the sweep, nothing was sent"
        )
    peak_v = settings.source_vpk + abs(settings.dc_offset_v)
    if peak_v > _SOURCE_SUM_V:
        raise LimitError(
            f"level {settings.source_vpk:g} V peak and offset {settings.dc_offset_v:g} V make "
            f"{peak_v:g} V; the source gives {_SOURCE_SUM_V:g} V and would move the offset, "
            "nothing was sent"
        )


def _level_step(value_vpk: float) -> float:
    return _LEVEL_STEP_VPK if value_vpk >= 0.2 * 2**0.5 else _LEVEL_STEP_VPK / 10.0


def _offset_step(value_v: float) -> float:
    return 1e-3 if abs(value_v) <= 2.0 else 5e-3
