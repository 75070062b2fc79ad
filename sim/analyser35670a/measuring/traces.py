"""Trace boxes and data registers: which data they show, and how the data are read.

Owns the measurement data that a mode offers, the four trace boxes with their
delay in changing over, and the registers D1 to D8. Coordinates are
`coordinates`' matter.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.measuring.coordinates import Picture
from sim.analyser35670a.measuring.point import Point
from sim.analyser35670a.measuring.sweep import FEW, Sweep, plan_sweep
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.settings import Mode

__all__ = ["TraceBoxes", "check_feed", "initial_feed", "initial_sine_feed"]

_FEED = re.compile(r"([A-Z]+(?::[A-Z]+)*|[DW][1-8])(?:\s+(\d)(?:\s*,\s*(\d))?)?")
_LONG_WORDS = {
    "XFREQUENCY": "XFR",
    "POWER": "POW",
    "RATIO": "RAT",
    "LINEAR": "LIN",
    "CROSS": "CROS",
    "VARIANCE": "VAR",
    "COHERENCE": "COH",
    "XTIME": "XTIM",
    "VOLTAGE": "VOLT",
    "WINDOW": "WIND",
    "COMPOSITE": "COMP",
}
_SINE = {"XFR:POW:RAT", "XFR:POW:CROS", "XFR:POW:LIN", "XFR:POW:VAR", "XTIM:VOLT"}
_FEEDS = {
    Mode.SINE: _SINE,
    Mode.FFT: (_SINE - {"XFR:POW:VAR"})
    | {"XFR:POW", "XFR:POW:COH", "XTIM:VOLT:WIND", "XVOL:VOLT", "TCAP"},
    Mode.CORRELATION: {"XTIM:VOLT", "XTIM:VOLT:WIND", "XTIM:CORR", "XTIM:CORR:CROS", "TCAP"},
    Mode.HISTOGRAM: {"XTIM:VOLT", "XTIM:VOLT:HIST", "XTIM:VOLT:PDF", "XTIM:VOLT:CDF", "TCAP"},
    Mode.ORDER: {"XFR:POW", "XTIM:VOLT", "XVOL:VOLT", "XORD:TRAC", "XRPM:PROF", "XFR:POW:COMP"},
    Mode.OCTAVE: {"XFR:POW", "TCAP"},
}
_ALL_FEEDS = frozenset().union(*_FEEDS.values())
_PAIRS = {"RAT": ("2,1", "3,1", "4,1", "4,3"), "else": ("1,2", "1,3", "1,4", "3,4")}
_MODE_NAMES = {
    Mode.FFT: "FFT ANALYSIS",
    Mode.OCTAVE: "OCTAVE ANALYSIS",
    Mode.ORDER: "ORDER ANALYSIS",
    Mode.SINE: "SWEPT SINE",
    Mode.HISTOGRAM: "HISTOGRAM",
    Mode.CORRELATION: "CORRELATN ANALYSIS",
}
_TWO_CHANNELS = "MEAS DATA selection only available with two or more active channels."
_FOUR_CHANNELS = "MEAS DATA selection only available with four active channels."


def initial_feed(numbers: tuple[int, ...]) -> str:
    """[S] What trace A, B, C, D show after a reset, in every mode that has it."""
    return ("XFR:POW 1", "XFR:POW 2", "XTIM:VOLT 1", "XTIM:VOLT 2")[numbers[0] - 1]


def initial_sine_feed(numbers: tuple[int, ...]) -> str:
    """[S] And in swept sine."""
    return ("XFR:POW:RAT 2,1", "XFR:POW:RAT 2,1", "XFR:POW:LIN 1", "XFR:POW:LIN 2")[numbers[0] - 1]


def check_feed(instrument: InstrumentCore, _numbers: tuple[int, ...], asked: str) -> str:
    """A feed in its standard spelling.

    Raises
    ------
    ScpiError
        -151 for text that names no data, -200 for data that the mode or the
        active channels cannot give.
    """
    match = _FEED.fullmatch(asked.strip().upper())
    if match is None:
        raise ScpiError(-151)
    head, first, second = match.groups()
    head = ":".join(_LONG_WORDS.get(word, word) for word in head.split(":"))
    if re.fullmatch(r"[DW][1-8]", head) and first is None:
        return head
    if head not in _ALL_FEEDS:
        raise ScpiError(-151)
    mode = instrument.settings.mode
    if head not in _FEEDS[mode]:
        raise ScpiError(
            -200, f"MEAS DATA selection not available with Inst Mode {_MODE_NAMES[mode]}."
        )
    return f"{head} {_channels(instrument, head, first, second)}".strip()


def _channels(instrument: InstrumentCore, head: str, first: str | None, second: str | None) -> str:
    last = head.rsplit(":", 1)[-1]
    if last == "PROF":
        return ""
    if last in ("RAT", "CROS", "COH") or head == "XVOL:VOLT":
        pair = f"{first},{second}" if first else ("2,1" if last == "RAT" else "1,2")
        if pair not in _PAIRS["RAT" if last == "RAT" else "else"]:
            raise ScpiError(-151)
        used, shown = {int(pair[0]), int(pair[2])}, pair
        if used == {3, 4} and instrument.settings.get("REF") != "PAIR":
            raise ScpiError(-200, "MEAS DATA selection not available; REFERENCE must be PAIR.")
    else:
        shown = first or "1"
        if last != "TRAC" and second is not None or shown not in "1234":
            raise ScpiError(-151)
        used = {int(shown)}
        shown += f",{second or 1}" if last == "TRAC" else ""
    for channel in sorted(used - {1}):
        # Channels 3 and 4 come and go together.
        if not instrument.settings.get("INP#", 2 if channel == 2 else 4):
            raise ScpiError(-200, _TWO_CHANNELS if channel == 2 else _FOUR_CHANNELS)
    return shown


def _swept(sweep: Sweep, hold: bool, feed: str) -> Picture:
    """Swept-sine data of one kind on the displayed axis."""
    head, _, channels = feed.partition(" ")
    picked = sweep.shown_points(hold)
    seen = picked >= 0
    real = head == "XFR:POW:VAR"
    values: NDArray = np.zeros(sweep.shown, dtype=float if real else complex)
    read = np.array([_value(point, head, channels) for point in sweep.points])
    if seen.any():
        values[seen] = read[picked[seen]]
    power = head in ("XFR:POW:CROS", "XFR:POW:VAR")
    return Picture(feed, sweep.axis, values, power)


def _value(point: Point, head: str, channels: str) -> complex:
    first = int(channels[0]) - 1
    if head == "XFR:POW:VAR":
        return float(point.variances[first])
    effective = point.amplitudes / math.sqrt(2.0)
    if head == "XFR:POW:LIN":
        return complex(effective[first])
    second = int(channels[2]) - 1
    if head == "XFR:POW:CROS":
        return complex(np.conj(effective[first]) * effective[second])
    below = point.amplitudes[second]
    return complex(point.amplitudes[first] / below) if below else 0j


def _waveform(sweep: Sweep, feed: str) -> Picture:
    """One period of the last point, from its harmonics."""
    channel = int(feed[-1]) - 1
    points = FEW
    if not sweep.points:
        return Picture(feed, np.zeros(points), np.zeros(points), x_unit="S")
    last = sweep.points[-1]
    time_s = np.arange(points) / (points * last.frequency_hz)
    turns = 2j * math.pi * last.frequency_hz * np.outer(np.arange(1, 4), time_s)
    signal = (last.harmonics[channel, 1:, None] * np.exp(turns)).imag.sum(axis=0)
    signal = signal + last.harmonics[channel, 0].real
    return Picture(feed, time_s, signal, x_unit="S")


class TraceBoxes:
    """Traces A to D and the data registers.

    Parameters
    ----------
    instrument
        Whose traces they are.
    shown
        The sweep that swept-sine traces show; None before the first one.
    """

    def __init__(self, instrument: InstrumentCore, shown: Callable[[], Sweep | None]) -> None:
        self._instrument = instrument
        self._shown = shown
        self._old: dict[tuple[int, str], str] = {}
        self.registers: dict[int, Picture] = {}

    def change_over(self, trace: int, key: str, old: str) -> None:
        """Show the old data or coordinates a little longer: the change is overlapped."""
        instrument = self._instrument
        slot = (trace, key.replace("#", "1"))
        self._old.setdefault(slot, old)
        operation = instrument.operations.begin()

        def settle() -> None:
            self._old.pop(slot, None)
            instrument.operations.end(operation)

        instrument.agenda.after(instrument.choices.feed_s, settle)

    def forget(self) -> None:
        """Drop changes under way, on a reset or a change of mode."""
        self._old.clear()

    def effective(self, trace: int, key: str) -> str:
        """The data or coordinates that the trace really shows now."""
        return self._old.get((trace, key.replace("#", "1"))) or str(
            self._instrument.settings.get(key, trace)
        )

    def picture(self, trace: int) -> Picture:
        """What stands in a trace box."""
        feed = self.effective(trace, "CALC#:FEED")
        if re.fullmatch(r"D\d", feed):
            return self.register(int(feed[1]))
        if feed.startswith("W"):
            raise ScpiError(-230)
        if self._instrument.settings.mode is not Mode.SINE:
            return self._instrument.spectrum.picture(feed)
        sweep = self._shown()
        if sweep is None:
            sweep = plan_sweep(self._instrument)
        if feed.startswith("XTIM"):
            return _waveform(sweep, feed)
        return _swept(sweep, self._instrument.choices.hold_between, feed)

    def register(self, number: int) -> Picture:
        """Content of D1 to D8.

        Raises
        ------
        ScpiError
            -230 if it is empty.
        """
        if number not in self.registers:
            raise ScpiError(-230)
        return self.registers[number]

    def replace(self, number: int, values: NDArray[np.float64]) -> None:
        """New numbers for a register that already holds as many of the same kind.

        Raises
        ------
        ScpiError
            -200 if it is empty, -161 if the count does not fit.
        """
        if number not in self.registers:
            raise ScpiError(-200, "Cannot edit an empty data register.")
        old = self.registers[number]
        if len(values) != len(old.raw):
            raise ScpiError(-161)
        new = values[0::2] + 1j * values[1::2] if old.is_complex else values
        self.registers[number] = Picture(old.feed, old.x, new, old.power, old.x_unit)
