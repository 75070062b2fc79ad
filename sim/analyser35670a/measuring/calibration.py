"""Calibration: by command and by itself, in the middle of a sweep if it falls due there.

Owns the schedule of autocalibration and the bits of a calibration under way.
It changes no reading.
"""

from __future__ import annotations

from collections.abc import Callable

from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.status import Device, Operation, Questionable
from sim.instrument.agenda import Entry, Steps

__all__ = ["Calibration"]


class Calibration:
    """The calibration of one instrument."""

    def __init__(self, instrument: InstrumentCore) -> None:
        self._instrument = instrument
        self._ends_s = 0.0
        self._next: Entry | None = None

    @property
    def remaining_s(self) -> float:
        """Time left of a calibration under way."""
        return max(0.0, self._ends_s - self._instrument.agenda.now_s)

    def follow_setting(self) -> None:
        """Show ``CAL:AUTO`` in the Device State register."""
        off = not self._instrument.settings.get("CAL:AUTO")
        self._instrument.status.device.put(Device.AUTOCALIBRATION_OFF, off)

    def power_on(self) -> None:
        """Begin the schedule anew."""
        if self._next is not None:
            self._next.cancelled = True
        self._schedule(list(self._instrument.choices.calibrations_s), 0.0)

    def _schedule(self, moments_s: list[float], last_s: float) -> None:
        """At some moments after power-on, then at equal intervals."""
        interval_s = self._instrument.choices.calibration_interval_s
        moment = moments_s[0] if moments_s else last_s + interval_s

        def due() -> None:
            if self._instrument.settings.get("CAL:AUTO") and not self._instrument.damage.dead:
                self.run()
            self._schedule(moments_s[1:], moment)

        self._next = self._instrument.agenda.after(moment - last_s, due, work=False)

    def run(self, done: Callable[[bool], None] | None = None) -> None:
        """Calibrate now; a paused measurement cannot go on afterwards."""
        instrument = self._instrument
        instrument.measurement.spoilt = True
        operation = instrument.operations.begin()
        self._ends_s = instrument.agenda.now_s + instrument.choices.calibration_s

        def steps() -> Steps:
            instrument.status.operation.put(Operation.CALIBRATING, True)
            yield instrument.choices.calibration_s
            instrument.status.operation.put(Operation.CALIBRATING, False)
            failed = instrument.faults.take("calibration-failure") is not None
            instrument.status.questionable.put(Questionable.CALIBRATION_FAILED, failed)
            if failed:
                instrument.report(-310, "Calibration Failure.")
            instrument.operations.end(operation)
            if done is not None:
                done(not failed)

        instrument.agenda.start(steps())

    def run_and_report(self) -> Callable[[], str | None]:
        """``CAL?``: +0 passed, +1 failed."""
        outcome: list[str] = []
        self.run(lambda passed: outcome.append("+0" if passed else "+1"))
        return lambda: outcome[0] if outcome else None
