"""What the other modes show: a noise floor, and a line where the sine source drives.

Owns the rudiments of FFT mode, enough for a script that looks at a spectrum: records, and their
averages. The measurement proper of this simulator is swept sine; correlation, histogram,
octave and order modes show zeros.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.analyser35670a.choices import NOISE_REFERENCE_CYCLES
from sim.analyser35670a.measuring.coordinates import Picture
from sim.analyser35670a.measuring.frequency import band
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.settings import Mode

__all__ = ["Spectrum"]

_CHANNELS = 2
_SETTLE, _INTEGRATE = 20, 10
_LOWEST_HZ = 1.0
"""Below this a sine would take too long to simulate for the look of a spectrum."""
_REAL = ("XFR:POW", "XFR:POW:COH")
_WINDOW_LINES = {"FLAT": 3.8193, "HANN": 1.5, "UNIF": 1.0}
"""Noise bandwidth in lines."""


class Spectrum:
    """Records of FFT mode."""

    def __init__(self, instrument: InstrumentCore) -> None:
        self._instrument = instrument
        self._taken = 0
        self.averaged = 0
        """Records in the average that is shown."""
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

    @property
    def bandwidth_hz(self) -> float:
        """Noise bandwidth of a line."""
        window = str(self._instrument.settings.get("WIND#", 1))
        return _WINDOW_LINES.get(window, 1.0) / self.record_s

    @property
    def averages(self) -> bool:
        """Whether averaging is on, where there is any."""
        settings = self._instrument.settings
        return settings.mode is Mode.FFT and bool(settings.get("AVER"))

    @property
    def wanted(self) -> int:
        """Records of one measurement."""
        return int(self._instrument.settings.get("AVER:COUN")) if self.averages else 1

    @property
    def freezes(self) -> bool:
        """Whether a measurement is over for good once all records are in."""
        return self.averages and self._instrument.settings.get("AVER:TCON") == "FRE"

    @property
    def complete(self) -> bool:
        """Whether all records are in."""
        return self.averaged >= self.wanted

    def begin(self) -> None:
        """The next record begins a new average."""
        self.averaged = 0

    def forget(self) -> None:
        """Drop all records."""
        self._lines = None
        self.averaged = 0

    def take(self) -> None:
        """Add one record to the average."""
        if not self.averages or self._lines is None:
            self.begin()
        lines = self._record()
        if self.averaged == 0 or self._lines is None:
            self._lines = lines
            self._power = np.abs(lines) ** 2
            self._cross = np.conj(lines[0]) * lines[1]
            self.averaged = 1
            return
        kind = self._instrument.settings.get("AVER:TYPE")
        self.averaged += 1
        share = 1.0 / min(self.averaged, self.wanted)
        self._lines = self._lines + share * (lines - self._lines)
        self._cross = self._cross + share * (np.conj(lines[0]) * lines[1] - self._cross)
        power = np.abs(lines) ** 2
        if kind == "MAX":
            self._power = np.maximum(self._power, power)
        elif kind in ("TIME", "VECT"):
            self._power = np.abs(self._lines) ** 2
            self._cross = np.conj(self._lines[0]) * self._lines[1]
        else:
            self._power = self._power + share * (power - self._power)

    def _record(self) -> NDArray[np.complex128]:
        """Complex V r.m.s. of one record, shape (channels, lines)."""
        instrument = self._instrument
        start, stop = band(instrument)
        if self.averaged == 0 or len(self._axis) != self.lines:
            self._axis = np.linspace(start, stop, self.lines)
            self.averaged = 0
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
        return lines

    def _look(self) -> None:
        """A measurement that goes on has newer records whenever somebody looks."""
        if self._lines is None or not self._instrument.measurement.running:
            return
        if self.complete and self._instrument.settings.get("AVER:TCON") == "REP":
            self.begin()
        self.take()

    def shown_axis(self, axis: NDArray[np.float64]) -> NDArray[np.float64]:
        """The X axis as it is read: [S] half of a block and one, the lines beyond included."""
        if self._instrument.settings.mode is not Mode.FFT:
            return axis
        if not self._instrument.choices.long_fft_axis or len(axis) < 2:
            return axis
        count = 512 * (len(axis) - 1) // 400 + 1
        return np.asarray(axis[0] + (axis[1] - axis[0]) * np.arange(count))

    def picture(self, feed: str) -> Picture:
        """Data of one kind; zeros before the first record and in the other modes."""
        start, stop = band(self._instrument)
        head, _, channels = feed.partition(" ")
        if head.startswith(("XTIM", "XVOL", "TCAP")):
            record = self.record_s
            count = 1024 * (self.lines - 1) // 400
            return Picture(feed, np.linspace(0.0, record, count), np.zeros(count), x_unit="S")
        self._look()
        lines = self._lines
        if lines is None or self._instrument.settings.mode is not Mode.FFT:
            blank = np.zeros(self.lines, dtype=float if head in _REAL else complex)
            return Picture(feed, np.linspace(start, stop, self.lines), blank)
        one, other, *_ = (*(int(part) - 1 for part in channels.split(",")), -1)
        return self._picture(feed, head, one, other)

    def _picture(self, feed: str, head: str, one: int, other: int) -> Picture:
        assert self._lines is not None
        zero = np.zeros(self._lines.shape[1])
        power = self._power[one] if one < _CHANNELS else zero
        match head:
            case "XFR:POW":
                return Picture(feed, self._axis, power, power=True)
            case "XFR:POW:RAT":
                # Channel `one` over channel `other`: their cross spectrum over a power.
                known = {one, other} == {0, 1}
                cross = self._cross if one == 1 else np.conj(self._cross)
                below = self._power[other] if 0 <= other < _CHANNELS else zero
                safe = np.where(below == 0, 1.0, below)
                return Picture(feed, self._axis, np.where(below == 0, 0.0, cross / safe) * known)
            case "XFR:POW:CROS":
                cross = self._cross if (one, other) == (0, 1) else zero.astype(complex)
                return Picture(feed, self._axis, cross, power=True)
            case "XFR:POW:COH":
                both = self._power[0] * self._power[1]
                safe = np.where(both == 0, 1.0, both)
                shares = np.where(both == 0, 1.0, np.abs(self._cross) ** 2 / safe)
                return Picture(feed, self._axis, np.minimum(shares, 1.0), power=True)
        whole = self._lines[one] if one < _CHANNELS else zero.astype(complex)
        if self.averages and self._instrument.settings.get("AVER:TYPE") in ("RMS", "MAX"):
            whole = np.sqrt(power) * np.exp(1j * np.angle(whole))
        return Picture(feed, self._axis, whole)
