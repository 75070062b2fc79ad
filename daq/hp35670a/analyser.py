"""The HP/Agilent 35670A as a swept-sine analyser (Option 1D2).

Owns the state of the driver and the order of things: identify, prepare, level
last, points, quiet again, safe. What settings, bits, traces and the safe-off
recipe are is said in the modules beside this one. Nothing here
was watched on a real instrument; docs/instrument.md lists what to check
there first.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Literal

from daq.analyser import Identity, PointSettings, SourceState, SweepPoint
from daq.driving.driven import DrivenAnalyser, Guard
from daq.driving.replies import parse_string
from daq.driving.scpi_connection import Dialogue
from daq.errors import LimitError, MeasurementError
from daq.hp35670a.identity import identify
from daq.hp35670a.safe import SafeOff, make_safe, read_source
from daq.hp35670a.settings import DC_OFFSET, LEVEL, MANUAL_FREQUENCY, MODE
from daq.hp35670a.setup import (
    SetUp,
    Timing,
    apply_all,
    calibrate,
    enter_swept_sine,
    parks_at_zero,
    planned_settings,
    prove_axis,
    select_traces,
)
from daq.hp35670a.status import arm_events
from daq.hp35670a.sweeps import check_grid, on_box, point_by_point
from daq.transports.base import Transport

__all__ = ["HP35670A", "Method"]

Method = Literal["point-by-point", "on-box"]

_CALIBRATION_HOLDS_S = 7200.0
_NARROWEST_HZ = 1.0


class HP35670A(DrivenAnalyser[Dialogue, SetUp]):
    """The `Analyser` protocol over any `Transport`.

    Parameters
    ----------
    transport
        Open wire to the instrument; closed with the driver.
    method
        ``"point-by-point"``: each frequency is set from here, any frequencies
        in any order. ``"on-box"``: the analyser sweeps by itself; 401 or 801
        evenly spaced frequencies.
    timing
        Bounds of waits.
    calibrate
        Whether to calibrate before the first sweep and then every two hours.
    """

    def __init__(
        self,
        transport: Transport,
        *,
        method: Method = "point-by-point",
        timing: Timing | None = None,
        calibrate: bool = True,
    ) -> None:
        self._timing = timing or Timing()
        dialogue = Dialogue(transport, self._timing.reply_s, self._timing.block_s)
        super().__init__(transport, dialogue)
        self._method = method
        self._calibrates = calibrate
        self._calibrated_s = -math.inf

    def identify(self) -> Identity:
        """Ask who is there, and refuse anything but a 35670A with swept sine."""
        with self._dialogue.lock:
            return identify(self._dialogue)

    def prepare(
        self, start_hz: float, stop_hz: float, settings: PointSettings
    ) -> Mapping[str, str]:
        """Set everything but level and offset, read it back, and return what was read.

        Raises
        ------
        LimitError
            If any value is outside the instrument's range; nothing was sent.
        InstrumentError
            If the instrument complains or reads back something else.
        """
        # A plan of one frequency has no band, and the instrument knows none so narrow.
        table = planned_settings(start_hz, max(stop_hz, start_hz + _NARROWEST_HZ), settings)
        self._setup = None
        dialogue = self._dialogue
        with dialogue.lock:
            if not dialogue.trusted or parse_string(dialogue.ask(f"{MODE.header}?")) != "SINE":
                enter_swept_sine(dialogue)
            else:
                arm_events(dialogue)
            if self._calibrates and time.monotonic() - self._calibrated_s > _CALIBRATION_HOLDS_S:
                calibrate(dialogue)
                self._calibrated_s = time.monotonic()
            read_back = apply_all(dialogue, "set-up", table) | select_traces(dialogue)
            axis_hz = prove_axis(dialogue)
            dialogue.check("set-up", harmless=parks_at_zero)
            dialogue.trusted = True
        self._setup = SetUp(settings, start_hz, stop_hz, tuple(table), axis_hz)
        return read_back

    def sweep(self, frequencies_hz: Sequence[float]) -> Iterator[SweepPoint]:
        """Drive the source and yield each point as it is finished, in the order given.

        Closing the generator early aborts the measurement and takes level and
        offset to 0.

        Raises
        ------
        MeasurementError
            At once if `prepare` has not been called since the last trouble; in
            the run if the source was made safe from elsewhere.
        LimitError
            At once if a frequency is outside the band that was prepared.
        InputError
            At once if the analyser cannot sweep these by itself (``"on-box"``).
        """
        frequencies = [float(frequency_hz) for frequency_hz in frequencies_hz]
        setup = self._setup
        if setup is None or not self._dialogue.trusted:
            raise MeasurementError("the analyser is not set up; prepare it before the sweep")
        for frequency_hz in frequencies:
            MANUAL_FREQUENCY.command(frequency_hz)
            if not setup.start_hz <= frequency_hz <= setup.stop_hz:
                raise LimitError(
                    f"frequency {frequency_hz:g} Hz is outside the prepared band of "
                    f"{setup.start_hz:g} to {setup.stop_hz:g} Hz; nothing was sent"
                )
        if self._method == "on-box":
            check_grid(frequencies)
            return self._run(setup, frequencies, on_box)
        return self._run(setup, frequencies, point_by_point)

    def source_state(self) -> SourceState:
        """What a read-back says of the source now."""
        with self._dialogue.lock:
            return read_source(self._dialogue)

    def _switch_off(self) -> SafeOff:
        return make_safe(self._transport, self.on_exchange)

    def _resynchronise(self) -> None:
        self._dialogue.clear()

    def _run(
        self,
        setup: SetUp,
        frequencies: Sequence[float],
        measure: Callable[[Dialogue, SetUp, Timing, Sequence[float], Guard], Iterator[SweepPoint]],
    ) -> Iterator[SweepPoint]:
        dialogue = self._dialogue
        with self._driving() as guard:
            with dialogue.lock:
                guard()
                self._drive(setup, frequencies, guard)
            yield from measure(dialogue, setup, self._timing, frequencies, guard)
        dialogue.check("end of the sweep", harmless=parks_at_zero)

    def _drive(self, setup: SetUp, frequencies: Sequence[float], guard: Callable[[], None]) -> None:
        """Clear the events of earlier, then set offset and, last of all, the level."""
        dialogue = self._dialogue
        for register in ("STAT:QUES:VOLT?", "STAT:DEV?", "*ESR?"):
            dialogue.ask_integer(register)
        if self._method == "point-by-point" and frequencies:
            dialogue.apply(MANUAL_FREQUENCY, frequencies[0])
        # The last moment to learn that somebody else has the bench by now.
        guard()
        dialogue.apply(DC_OFFSET, setup.settings.dc_offset_v)
        guard()
        dialogue.apply(LEVEL, setup.settings.source_vpk)
        # A level moves the offset without a word where both do not fit.
        dialogue.confirm(DC_OFFSET, setup.settings.dc_offset_v)
        dialogue.check("source level", harmless=parks_at_zero)

    def _quiet(self) -> None:
        for line in ("ABOR", LEVEL.command(0.0), DC_OFFSET.command(0.0)):
            self._dialogue.send(line)
