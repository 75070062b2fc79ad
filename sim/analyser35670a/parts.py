"""What the parts of the instrument ask of it and of each other.

Owns these interfaces. A part is written against them, so that none imports the instrument, which
has them all (`sim.analyser35670a.instrument`). Nothing here does anything.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sim.analyser35670a.choices import Choices
from sim.analyser35670a.errors import ErrorQueue
from sim.analyser35670a.measuring.coordinates import Picture
from sim.analyser35670a.modes import Mode
from sim.analyser35670a.operations import Operations
from sim.analyser35670a.status import StatusModel
from sim.faults import FaultBoard
from sim.instrument.agenda import Agenda
from sim.instrument.damage import Damage
from sim.instrument.output import Source
from sim.instrument.plant import Plant

__all__ = [
    "CalibrationPart",
    "InstrumentCore",
    "KeptValues",
    "MeasurementPart",
    "SpectrumPart",
    "TracesPart",
]


class KeptValues(Protocol):
    """The values of the settings (`settings.Settings`)."""

    mode: Mode

    def get(self, key: str, *numbers: int, mode: Mode | None = None) -> Any:
        """A value, of the present mode unless another is named."""
        ...

    def put(self, key: str, value: Any, *numbers: int) -> None:
        """Store a value for the present mode."""
        ...

    def dump(self) -> bytes:
        """The whole state, for ``SYST:SET?``."""
        ...


class MeasurementPart(Protocol):
    """The measurement (`measuring.measurement.Measurement`)."""

    spoilt: bool

    @property
    def running(self) -> bool:
        """Whether points are being taken."""
        ...

    def start(self) -> None:
        """Begin anew."""
        ...

    def stop(self) -> None:
        """``ABOR``."""
        ...

    def pause(self) -> None:
        """Stop taking points."""
        ...

    def go_on(self) -> None:
        """Continue a paused measurement, or start."""
        ...

    def check_level(self) -> None:
        """Pause at a level of 0."""
        ...


class SpectrumPart(Protocol):
    """Records of FFT mode (`measuring.spectrum.Spectrum`)."""

    averaged: int

    @property
    def record_s(self) -> float:
        """Length of a time record."""
        ...

    @property
    def bandwidth_hz(self) -> float:
        """Noise bandwidth of a line."""
        ...

    @property
    def averages(self) -> bool:
        """Whether records are averaged."""
        ...

    @property
    def wanted(self) -> int:
        """Records of an average."""
        ...

    @property
    def freezes(self) -> bool:
        """Whether a measurement ends with its last average."""
        ...

    @property
    def complete(self) -> bool:
        """Whether all records were taken."""
        ...

    def begin(self) -> None:
        """Throw the average away."""
        ...

    def take(self) -> None:
        """One more record."""
        ...

    def picture(self, feed: str) -> Picture:
        """Data of one kind."""
        ...

    def shown_axis(self, axis: NDArray[np.float64]) -> NDArray[np.float64]:
        """The X axis as it is read."""
        ...


class TracesPart(Protocol):
    """Trace boxes and registers (`measuring.traces.TraceBoxes`)."""

    registers: dict[int, Picture]

    def change_over(self, trace: int, key: str, old: str) -> None:
        """Show the old data or coordinates a little longer."""
        ...

    def effective(self, trace: int, key: str) -> str:
        """The data or coordinates that the trace really shows now."""
        ...

    def picture(self, trace: int) -> Picture:
        """What is in a trace box."""
        ...

    def register(self, number: int) -> Picture:
        """Content of D1 to D8."""
        ...

    def replace(self, number: int, values: NDArray[np.float64]) -> None:
        """New numbers for a register."""
        ...


class CalibrationPart(Protocol):
    """The calibration (`measuring.calibration.Calibration`)."""

    @property
    def remaining_s(self) -> float:
        """Time left of a calibration under way."""
        ...

    def follow_setting(self) -> None:
        """Show ``CAL:AUTO`` in the Device State register."""
        ...

    def run(self, done: Callable[[bool], None] | None = None) -> None:
        """Calibrate now."""
        ...

    def run_and_report(self) -> Callable[[], str | None]:
        """``CAL?``."""
        ...


class InstrumentCore(Protocol):
    """The whole instrument, as its parts see it (`instrument.Analyser35670A`)."""

    plant: Plant
    choices: Choices
    faults: FaultBoard
    options: str
    installed: set[str]
    agenda: Agenda
    status: StatusModel
    operations: Operations
    errors: ErrorQueue
    source: Source
    source_started: bool
    stuck_measuring: bool
    message: str
    damage: Damage

    @property
    def settings(self) -> KeptValues:
        """What it is set to."""
        ...

    @property
    def measurement(self) -> MeasurementPart:
        """The measurement."""
        ...

    @property
    def traces(self) -> TracesPart:
        """Trace boxes and registers."""
        ...

    @property
    def spectrum(self) -> SpectrumPart:
        """Records of FFT mode."""
        ...

    @property
    def calibration(self) -> CalibrationPart:
        """The calibration."""
        ...

    def report(self, number: int, detail: str = "") -> None:
        """Queue an error and set its bit."""
        ...

    def begin_point(self) -> None:
        """A point is about to be measured."""
        ...

    def begin_read_out(self) -> None:
        """Data are about to be read."""
        ...

    def cancel_completion(self) -> None:
        """Forget ``*OPC`` and ``*OPC?``."""
        ...

    def after_a_while(self, seconds: float, reply: str) -> Callable[[], str | None]:
        """A reply that is ready after some of the instrument's time."""
        ...

    def refresh_source(self) -> None:
        """Let the output follow settings and mode."""
        ...

    def enter_mode(self, mode: Mode) -> None:
        """Change over to another mode."""
        ...

    def shown_unit(self, unit: str) -> str:
        """The answer to ``? UNIT``."""
        ...

    def reset(self, after_reset: bool) -> None:
        """``*RST`` (True) or ``SYST:PRES`` (False)."""
        ...

    def restore(self, state: bytes) -> None:
        """``SYST:SET``."""
        ...

    def switch_off(self) -> None:
        """``SYST:POW:STAT OFF``."""
        ...
