"""What the SR785's two displays show, and what a marker would read there.

Owns measurement, view and units of each display, and which data each still has. It measures
nothing.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.sr785.language import ExecutionFault
from sim.sr785.parts import InstrumentCore
from sim.sr785.point import Point
from sim.sr785.settings import FFT, GROUPS, MEASUREMENTS, SWEPT
from sim.sr785.sweep import Sweep

__all__ = ["NICHOLS", "NYQUIST", "Traces"]

LOG, LINEAR, SQUARE, REAL, IMAGINARY, PHASE, UNWRAPPED, NYQUIST, NICHOLS = range(9)
_FFT_LINES = (100, 200, 400, 800)
_DB_OFFSET = {1: 0.0, 2: 10.0 * math.log10(1000.0 / 2.0 / 50.0), 3: 20.0 * math.log10(1 / 2e-5)}
_PEAK = {0: 1.0, 1: 1.0, 2: 1.0 / math.sqrt(2.0), 3: 2.0}
_DOUBLE_BYTE = {"root": "\xfb", "square": "\xfd"}


class Traces:
    """Both displays."""

    def __init__(self, instrument: InstrumentCore, sweep: Sweep) -> None:
        self._instrument, self._sweep = instrument, sweep
        self.group = [0, 0]
        self.measurement = [0, 0]
        self.view = [LOG, LOG]
        self._lost_until = [0, 0]
        """Running number of the last point that a display has lost."""
        self.frozen: list[NDArray[np.float64] | None] = [None, None]

    def reset(self) -> None:
        """As after ``*RST``."""
        for display in (0, 1):
            self.enter(display, 0)
            self.frozen[display] = None

    def keep_all(self) -> None:
        """There are no data any more that a display could have lost."""
        self._lost_until = [0, 0]
        self.frozen = [None, None]

    @property
    def _numbers(self) -> dict[str, dict[int, str]]:
        return MEASUREMENTS[self._instrument.choices.model]

    def group_name(self, display: int) -> str:
        """The measurement group of a display."""
        return GROUPS[self._instrument.choices.model][self.group[display]]

    def enter(self, display: int, group: int) -> None:
        """``MGRP``: another group begins with its first measurement."""
        self.group[display] = group
        numbers = self._numbers.get(self.group_name(display), {0: "time 1"})
        self.measurement[display] = min(numbers)
        self.view[display] = LOG

    def choose(self, display: int, measurement: int) -> None:
        """``MEAS``; raises `ExecutionFault` for one that the group has not."""
        if measurement not in self._numbers.get(self.group_name(display), {}):
            raise ExecutionFault(f"measurement {measurement}")
        choices = self._instrument.choices
        if measurement == self.measurement[display]:
            return
        self.measurement[display] = measurement
        if choices.change_resets_view:
            self.view[display] = LOG
        if not choices.data_survive_change:
            self._lost_until[display] = self._sweep.points_begun

    def freeze(self, display: int, off_line: bool) -> None:
        """``DISP``: an off-line display keeps what it shows."""
        self.frozen[display] = self._values(display) if off_line else None

    # ------------------------------------------------------------ data

    def length(self, display: int) -> int:
        """``DSPN?``: in swept sine one more than was measured."""
        get = self._instrument.settings.get
        if self.group_name(display) == SWEPT:
            return int(get("SNPS", display)) + 1
        return _FFT_LINES[int(get("FLIN", display))] + 1

    def axis(self, display: int) -> NDArray[np.float64]:
        """X of every bin, Hz, shape (length,)."""
        get = self._instrument.settings.get
        if self.group_name(display) == SWEPT:
            found = self._instrument.settings.axis_hz()
            return np.append(found, found[-1])
        start_hz = get("FSTR", display)
        return np.linspace(start_hz, start_hz + get("FSPN", display), self.length(display))

    def values(self, display: int) -> NDArray[np.float64]:
        """What a marker would read at every bin, shape (length,), or (length, 2) as Y and X."""
        frozen = self.frozen[display]
        return self._values(display) if frozen is None else frozen

    def _values(self, display: int) -> NDArray[np.float64]:
        if self.group_name(display) != SWEPT:
            return self._spectrum(display)
        view = self.view[display]
        shape = (self.length(display), 2) if view in (NYQUIST, NICHOLS) else self.length(display)
        shown = np.full(shape, self._instrument.choices.unmeasured)
        # Displays with different sweeps cannot both show this one.
        if display == 1 and not self._same_sweep():
            return shown
        name = self._numbers[SWEPT][self.measurement[display]]
        sweep = self._sweep
        rows = sorted({*sweep.bins, *sweep.interpolated})
        points = [(row, *self._point(row)) for row in rows]
        kept = [
            (row, self._quantity(name, display, point))
            for row, number, point in points
            if number > self._lost_until[display] and row < len(shown) - 1
        ]
        if kept and not name.startswith("user"):
            where = [row for row, _ in kept]
            shown[where] = self._viewed(np.array([value for _, value in kept]), view, display)
        return shown

    def _same_sweep(self) -> bool:
        shown = self._instrument.settings.shown
        return all(shown(name, 0) == shown(name, 1) for name in ("SSTR", "SSTP", "SNPS", "SSTY"))

    def _point(self, row: int) -> tuple[int, Point]:
        sweep = self._sweep
        found = sweep.bins.get(row)
        if found is not None:
            return found
        return sweep.points_begun, sweep.interpolated[row]

    def _quantity(self, name: str, display: int, point: Point) -> complex:
        one, two = (complex(value) for value in point.amplitudes)
        get = self._instrument.settings.get
        if name.startswith("variance"):
            return complex(point.variances[int(name[-1]) - 1])
        # PSD units have no meaning here and spoil what is shown.
        density = math.sqrt(point.integrated_s) if get("PSDU", display) else 1.0
        if name.startswith("spectrum"):
            peak = _PEAK[int(get("UNPK", display))]
            return (one if name.endswith("1") else two) * peak * density
        if name == "cross spectrum":
            return one.conjugate() * two * density
        return two / one * density if one else complex(0.0)

    def _viewed(
        self, values: NDArray[np.complex128], view: int, display: int
    ) -> NDArray[np.float64]:
        get = self._instrument.settings.get
        size = np.abs(values)
        decibels = 20.0 * np.log10(np.maximum(size, 1e-30))
        turn = 1.0 if get("UNPH", display) else 180.0 / math.pi
        angle = np.angle(values)
        scale = int(get("UNDB", display))
        match view:
            case 0:
                found = decibels + _DB_OFFSET[scale] if scale else size
            case 1:
                found = size
            case 2:
                found = size**2
            case 3:
                found = values.real
            case 4:
                found = values.imag
            case 5:
                found = angle * turn
            case 6:
                found = np.unwrap(angle) * turn
            case 7:
                found = np.column_stack((values.imag, values.real))
            case _:
                found = np.column_stack((decibels, angle * turn))
        return np.asarray(found, dtype=float)

    def _spectrum(self, display: int) -> NDArray[np.float64]:
        """[S] In other groups: noise, and the fixed sine where it stands."""
        instrument, count = self._instrument, self.length(display)
        if self._sweep.started == 0:
            return np.full(count, instrument.choices.unmeasured)
        generator = np.random.default_rng((instrument.choices.seed, self._sweep.started))
        values = np.abs(generator.standard_normal(count)) * instrument.choices.noise_v
        if instrument.driven_v and self.group_name(display) == FFT:
            axis = self.axis(display)
            values[int(np.argmin(np.abs(axis - instrument.settings.get("S1FR"))))] += (
                instrument.driven_v
            )
        return self._viewed(values.astype(complex), self.view[display], display)

    def unit(self, display: int) -> str:
        """``UNIT?``, with the two characters of code page 437 that it may hold."""
        view, get = self.view[display], self._instrument.settings.get
        name = self._numbers.get(self.group_name(display), {}).get(self.measurement[display], "")
        if view in (PHASE, UNWRAPPED):
            return "rad" if get("UNPH", display) else "deg"
        if view == LOG and get("UNDB", display):
            return "dB"
        if name.startswith(("frequency", "variance", "coherence")):
            return ""
        base = "V" + ("", "pk", "rms", "pp")[int(get("UNPK", display))]
        if view == SQUARE:
            base += _DOUBLE_BYTE["square"]
        return base + ("/" + _DOUBLE_BYTE["root"] + "Hz" if get("PSDU", display) else "")
