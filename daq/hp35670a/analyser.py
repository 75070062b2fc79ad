"""The HP/Agilent 35670A as a swept-sine analyser (Option 1D2).

Owns the state of the driver and the order of things: identify, prepare, level
last, points, quiet again, safe. What settings, bits, traces and the safe-off
recipe are is said in the modules beside this one. Nothing here
was watched on a real instrument; docs/instrument.md lists what to check
there first.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Literal

from daq.analyser import Identity, PointSettings, SourceState, SweepPoint
from daq.driving.replies import parse_string
from daq.driving.scpi_connection import Dialogue
from daq.errors import LashbenchError, LimitError, MeasurementError
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
from daq.hp35670a.sweeps import Guard, check_grid, on_box, point_by_point
from daq.transports.base import Transport

__all__ = ["HP35670A", "Method"]

Method = Literal["point-by-point", "on-box"]

_CALIBRATION_HOLDS_S = 7200.0
_NARROWEST_HZ = 1.0
_LOCK_PATIENCE_S = 6.0
"""How long going safe waits for an exchange of another thread to end before it goes on anyway."""


class HP35670A:
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
        self.safe_off: SafeOff | None = None
        """What the last run of the safe-off recipe did, step by step."""
        self._timing = timing or Timing()
        self._transport = transport
        self._dialogue = Dialogue(transport, self._timing.reply_s, self._timing.block_s)
        self._method = method
        self._calibrates = calibrate
        self._calibrated_s = -math.inf
        self._setup: SetUp | None = None
        self._times_made_safe = 0

    @property
    def on_wait(self) -> Callable[[], None] | None:
        """Called at least five times a second while an operation is waited for; may raise.

        A reply that does not come is not interrupted: it has a bound of its own.
        """
        return self._dialogue.on_wait

    @on_wait.setter
    def on_wait(self, look: Callable[[], None] | None) -> None:
        self._dialogue.on_wait = look

    @property
    def on_exchange(self) -> Callable[[float], None] | None:
        """Told before each exchange how long it may take at most, s; must not raise."""
        return self._dialogue.on_exchange

    @on_exchange.setter
    def on_exchange(self, told: Callable[[float], None] | None) -> None:
        self._dialogue.on_exchange = told

    @property
    def wire_lacks(self) -> tuple[str, ...]:
        """What the way to the instrument turned out not to have, such as a serial poll."""
        return tuple(getattr(self._transport, "lacks", ()))

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

    def make_safe(self) -> SourceState:
        """Run the safe-off recipe and say what could be proven; see `safe_off` for the steps.

        May be called twice and from any thread, and never raises.
        """
        self._times_made_safe += 1
        self._setup = None
        # An exchange of another thread is let finish, so that its reply is not taken for
        # ours; one that hangs longer than its own bound is not waited for.
        held = self._dialogue.lock.acquire(timeout=_LOCK_PATIENCE_S)
        try:
            self._dialogue.trusted = False
            self.safe_off = make_safe(self._transport, self.on_exchange)
        finally:
            if held:
                self._dialogue.lock.release()
        return self.safe_off.state

    def close(self) -> None:
        """Let go of the connection; does not touch the source."""
        self._transport.close()

    def _run(
        self,
        setup: SetUp,
        frequencies: Sequence[float],
        measure: Callable[[Dialogue, SetUp, Timing, Sequence[float], Guard], Iterator[SweepPoint]],
    ) -> Iterator[SweepPoint]:
        dialogue, times = self._dialogue, self._times_made_safe

        def guard() -> None:
            if self._times_made_safe != times:
                raise MeasurementError("the source was made safe while the sweep ran; it ends here")
            if self.on_wait is not None:
                self.on_wait()

        try:
            with dialogue.lock:
                guard()
                self._drive(setup, frequencies, guard)
            yield from measure(dialogue, setup, self._timing, frequencies, guard)
        except BaseException as error:
            # The first fault is the one to report; the session makes safe in any case.
            with contextlib.suppress(LashbenchError):
                if not isinstance(error, LashbenchError):
                    dialogue.clear()  # an interrupt may have come between question and answer
                self._quiet()
            dialogue.trusted = False
            raise
        self._quiet()
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
