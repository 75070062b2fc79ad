"""What the other modes show: a noise floor, and a line where the sine source drives.

Owns the rudiments of FFT mode, enough for a script that looks at a spectrum.
The measurement proper of this simulator is swept sine; correlation, histogram,
octave and order modes show zeros.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.analyser35670a.choices import NOISE_REFERENCE_CYCLES
from sim.analyser35670a.coordinates import Picture
from sim.analyser35670a.frequency import band
from sim.analyser35670a.settings import Mode

if TYPE_CHECKING:
    from sim.analyser35670a.instrument import Analyser35670A

__all__ = ["Spectrum"]

_CHANNELS = 2
_SETTLE, _INTEGRATE = 20, 10
_LOWEST_HZ = 1.0
"""Below this a sine would take too long to simulate for the look of a spectrum."""
_REAL = ("XFR:POW", "XFR:POW:COH")


class Spectrum:
    """One record of FFT mode."""

    def __init__(self, instrument: Analyser35670A) -> None:
        self._instrument = instrument
        self._taken = 0
        self._lines: NDArray[np.complex128] | None = None
        self._axis = np.zeros(0)

    @property
    def lines(self) -> int:
        """Frequency points of the present resolution."""
        if self._instrument.settings.mode is Mode.FFT:
            return int(self._instrument.settings.get("FREQ:RES").value) + 1
        return 401

    @property
    def record_s(self) -> float:
        """Length of a time record."""
        start, stop = band(self._instrument)
        return (self.lines - 1) / (stop - start)

    def forget(self) -> None:
        """Drop the record."""
        self._lines = None

    def take(self) -> None:
        """Fill the lines (channels, n) with complex V r.m.s."""
        instrument = self._instrument
        start, stop = band(instrument)
        self._axis = np.linspace(start, stop, self.lines)
        self._taken += 1
        rng = np.random.default_rng((instrument.choices.seed, 1 << 32, self._taken))
        parts = rng.standard_normal((2, _CHANNELS, self.lines))
        floor = instrument.choices.noise_v * math.sqrt(NOISE_REFERENCE_CYCLES / 2.0)
        scale = np.array([[floor * instrument.choices.converter_noise], [floor]])
        lines: NDArray[np.complex128] = (parts[0] + 1j * parts[1]) * scale
        hz = instrument.settings.get("SOUR:FREQ").value
        level = instrument.source.level(instrument.agenda.now_s)
        sine = instrument.settings.get("SOUR:FUNC") == "SIN"
        inside = max(start, _LOWEST_HZ) <= hz <= stop
        if instrument.settings.mode is Mode.FFT and sine and level > 0 and inside:
            offset = instrument.source.offset_v
            dwell = instrument.plant.dwell(hz, level, offset, _SETTLE, _INTEGRATE)
            at = int(np.abs(self._axis - hz).argmin())
            lines[0, at] += dwell.source_cycles.mean() / math.sqrt(2.0)
            lines[1, at] += dwell.output_cycles[:, 1].mean() / math.sqrt(2.0)
        self._lines = lines

    def picture(self, feed: str) -> Picture:
        """Data of one kind; zeros before the first record and in the other modes."""
        start, stop = band(self._instrument)
        head, _, channels = feed.partition(" ")
        if head.startswith(("XTIM", "XVOL", "TCAP")):
            record = self.record_s
            count = 1024 * (self.lines - 1) // 400
            return Picture(feed, np.linspace(0.0, record, count), np.zeros(count), x_unit="S")
        if self._lines is not None and self._instrument.measurement.running:
            self.take()
        lines = self._lines
        if lines is None or self._instrument.settings.mode is not Mode.FFT:
            blank = np.zeros(self.lines, dtype=float if head in _REAL else complex)
            return Picture(feed, np.linspace(start, stop, self.lines), blank)
        numbers = [int(part) - 1 for part in channels.split(",")]
        first = lines[numbers[0]] if numbers[0] < _CHANNELS else np.zeros_like(lines[0])
        second = lines[numbers[-1]] if numbers[-1] < _CHANNELS else np.zeros_like(lines[0])
        match head:
            case "XFR:POW":
                return Picture(feed, self._axis, np.abs(first) ** 2, power=True)
            case "XFR:POW:RAT":
                safe = np.where(second == 0, 1.0, second)
                return Picture(feed, self._axis, np.where(second == 0, 0.0, first / safe))
            case "XFR:POW:CROS":
                return Picture(feed, self._axis, np.conj(first) * second, power=True)
            case "XFR:POW:COH":
                # One record alone is always coherent with itself.
                return Picture(feed, self._axis, np.ones(len(self._axis)), power=True)
        return Picture(feed, self._axis, first)
