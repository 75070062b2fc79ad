"""Running a swept-sine measurement: start, pause, continue, abort, one point after the other.

Owns the state of the measurement and the process that lets its time pass and
moves its status bits. What a point reads is `point`'s matter, which points are
measured is `sweep`'s.
"""

from __future__ import annotations

from enum import Enum

from daq.errors import AnalysisError
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.measuring.point import Point, take_point
from sim.analyser35670a.measuring.sweep import Sweep, plan_sweep
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.settings import Mode
from sim.analyser35670a.status import Device, Operation
from sim.analyser35670a.units import volts_peak
from sim.instrument.agenda import HOLD, Process, Steps

__all__ = ["Measurement", "State"]

_BUSY = Operation.MEASURING | Operation.AVERAGING
_PHASES = Operation.SETTLING | Operation.RANGING
_CANNOT_CONTINUE = (
    "Cannot continue measurement. Measurement state has changed or Calibration has run."
)
_LEVEL_ZERO = "SOURCE LEVEL is 0 Volts, measurement paused."


class State(Enum):
    """Where a measurement stands."""

    IDLE = "none since the last reset or change of mode"
    RUNNING = "running"
    PAUSED = "paused"
    DONE = "finished"


class Measurement:
    """The measurement of one instrument."""

    def __init__(self, instrument: InstrumentCore) -> None:
        self._instrument = instrument
        self._process: Process | None = None
        self._operation: object | None = None
        self.started = 0
        self.points_begun = 0
        self.state = State.IDLE
        self.sweep: Sweep | None = None
        self.shown: Sweep | None = None
        """What the traces show; lags behind `sweep` while ``AVER:IRES`` hides points."""
        self.spoilt = False
        """Whether a setting or a calibration forbids going on."""

    @property
    def running(self) -> bool:
        """Whether points are being taken."""
        return self.state is State.RUNNING

    def start(self) -> None:
        """Begin anew; the data of the last measurement go."""
        instrument = self._instrument
        self.stop()
        self.started += 1
        self.spoilt = False
        self._operation = instrument.operations.begin()
        if instrument.settings.mode is not Mode.SINE:
            instrument.spectrum.begin()
            self._run(self._other_mode())
            return
        self.sweep = plan_sweep(instrument)
        if not instrument.settings.get("AVER:IRES"):
            self.shown = self.sweep
        elif self.shown is None:
            self.shown = plan_sweep(instrument)
        self._run(self._sweep())
        self.check_level()

    def _run(self, steps: Steps) -> None:
        self.state = State.RUNNING
        self._instrument.status.operation.put(_BUSY, True)
        instrument = self._instrument
        if instrument.settings.mode is Mode.SINE and self._level_vpk() > 0:
            instrument.source_started = True
        instrument.refresh_source()
        self._process = instrument.agenda.start(steps, self._finished)

    def _level_vpk(self) -> float:
        return volts_peak(self._instrument.settings.get("SOUR:VOLT"))

    def check_level(self) -> None:
        """A level of 0 parks a running sweep; `*OPC` then never completes."""
        instrument = self._instrument
        if self.running and instrument.settings.mode is Mode.SINE and self._level_vpk() == 0:
            self.pause()
            instrument.report(-221, _LEVEL_ZERO)

    def pause(self) -> None:
        """Stop taking points; the operation stays pending."""
        if self.running:
            self.state = State.PAUSED
            self._instrument.status.operation.put(_BUSY | _PHASES, False)

    def go_on(self) -> None:
        """``INIT:CONT ON``: continue a paused measurement, or start.

        Raises
        ------
        ScpiError
            -200 if a setting was changed or a calibration ran since it was begun.
        """
        if self.running:
            return
        if self.state is not State.IDLE and self.spoilt:
            raise ScpiError(-200, _CANNOT_CONTINUE)
        process = self._process
        if self.state is State.DONE and self._may_add:
            self._operation = self._instrument.operations.begin()
            self._run(self._other_mode())
            return
        if self.state is not State.PAUSED or process is None:
            self.start()
            return
        self.state = State.RUNNING
        self._instrument.status.operation.put(_BUSY, True)
        self.check_level()
        if self.running:
            process.resume()

    @property
    def _may_add(self) -> bool:
        """Whether more averages are wanted now than were taken."""
        spectrum = self._instrument.spectrum
        return spectrum.averages and 0 < spectrum.averaged < spectrum.wanted

    def stop(self) -> None:
        """``ABOR``: nothing is pending afterwards."""
        if self._process is not None:
            self._process.stop()
            self._process = None
        if self.state in (State.RUNNING, State.PAUSED):
            self.state = State.DONE
        if not self._instrument.stuck_measuring:
            self._instrument.status.operation.put(_BUSY, False)
        self._instrument.status.operation.put(_PHASES, False)
        self._end_operation()

    def forget(self) -> None:
        """Drop the data as well, on a reset or a change of mode."""
        self.stop()
        self.state = State.IDLE
        self.sweep = self.shown = None
        self.spoilt = False

    def _end_operation(self) -> None:
        operation, self._operation = self._operation, None
        if operation is not None:
            self._instrument.operations.end(operation)

    def _finished(self) -> None:
        instrument = self._instrument
        self._process = None
        if instrument.stuck_measuring:
            return
        self.state = State.DONE
        instrument.status.operation.put(_BUSY, False)
        self._end_operation()
        frozen = instrument.settings.mode is not Mode.SINE and instrument.spectrum.freezes
        if instrument.settings.get("INIT:CONT") and not frozen:
            # [S] A continuous sweep starts over at once.
            self.start()
        elif instrument.settings.mode is Mode.SINE and not instrument.choices.source_stays_on:
            instrument.source_started = False
            instrument.refresh_source()

    # Processes

    def _other_mode(self) -> Steps:
        """A measurement of the other modes: so many records; in continuous mode ever newer ones."""
        spectrum = self._instrument.spectrum
        while not spectrum.complete:
            while self.state is State.PAUSED:
                yield HOLD
            yield spectrum.record_s
            spectrum.take()
            self._instrument.status.device.pulse(Device.DISPLAY_READY)
        self._end_operation()
        if spectrum.freezes:
            return
        while self._instrument.settings.get("INIT:CONT") or self.state is State.PAUSED:
            # Newer records are taken when somebody looks.
            yield HOLD

    def _sweep(self) -> Steps:
        sweep, instrument = self.sweep, self._instrument
        if sweep is None:
            return
        while (frequency_hz := sweep.next_hz()) is not None:
            while self.state is State.PAUSED or self._level_vpk() == 0:
                # The hold ends when the measurement is continued, or is thrown away.
                yield HOLD
            yield from self._wait_for_calibration()
            yield from self._ramp()
            self.points_begun += 1
            instrument.begin_point()
            try:
                point = take_point(instrument, frequency_hz, (self.started, len(sweep.points)))
            except AnalysisError as error:
                instrument.report(-240, str(error))
                return
            yield from self._pass_time(point)
            sweep.points.append(point)
            if not instrument.settings.get("AVER:IRES"):
                self.shown = sweep
                instrument.status.device.pulse(Device.DISPLAY_READY)
        sweep.complete = True
        self.shown = sweep
        if instrument.settings.get("AVER:IRES"):
            instrument.status.device.pulse(Device.DISPLAY_READY)
        instrument.stuck_measuring = instrument.faults.take("stuck-measuring-bit") is not None

    def _wait_for_calibration(self) -> Steps:
        while (left := self._instrument.calibration.remaining_s) > 0:
            yield left

    def _ramp(self) -> Steps:
        source, agenda = self._instrument.source, self._instrument.agenda
        left = source.remaining_s(agenda.now_s)
        if left > 0:
            yield from self._phase(Operation.SETTLING, left)

    def _pass_time(self, point: Point) -> Steps:
        """[S] Settle, then range, then integrate; the overhead comes last."""
        status, timing = self._instrument.status, point.timing
        yield from self._phase(Operation.SETTLING, timing.settle_s)
        if timing.ranging_s > 0:
            yield from self._phase(Operation.RANGING, timing.ranging_s)
        status.voltage.put(0xF00, False)
        status.voltage.put(point.above_half << 8, True)
        status.voltage.put(point.overloaded, True)
        yield timing.integrate_s
        yield self._instrument.choices.point_overhead_s
        status.voltage.put(0xF, False)

    def _phase(self, bit: int, seconds: float) -> Steps:
        status = self._instrument.status.operation
        status.put(bit, True)
        yield min(seconds, 1e9)
        status.put(bit, False)
