"""The simulated analyser: one instrument with everything in it, and the bus it hangs on.

Owns the parts and what joins them: modes, resets, power, faults. A controller
meets it through `listen`, `talk`, `serial_poll`, `device_clear` and `trigger`;
whoever paces it moves `agenda`. It opens no port and never waits.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from sim.analyser35670a.choices import Choices
from sim.analyser35670a.commands.dispatch import Dispatcher, all_settings, is_query
from sim.analyser35670a.commands.registry import Answer, Hold
from sim.analyser35670a.errors import ErrorQueue, ScpiError
from sim.analyser35670a.exchange import Exchange
from sim.analyser35670a.measuring.calibration import Calibration
from sim.analyser35670a.measuring.measurement import Measurement
from sim.analyser35670a.measuring.spectrum import Spectrum
from sim.analyser35670a.measuring.traces import TraceBoxes
from sim.analyser35670a.operations import Operations
from sim.analyser35670a.settings import Mode, Settings
from sim.analyser35670a.source import slew_vpk_per_s
from sim.analyser35670a.status import Device, Event, StatusModel
from sim.analyser35670a.units import volts_peak
from sim.faults import FaultBoard
from sim.instrument.agenda import Agenda
from sim.instrument.bus import Talk, TalkState
from sim.instrument.damage import Damage
from sim.instrument.output import Source
from sim.instrument.plant import Plant

__all__ = ["Analyser35670A"]

_EVENT_OF_CLASS = {1: Event.COMMAND, 2: Event.EXECUTION, 3: Event.DEVICE, 4: Event.QUERY}


class Analyser35670A:
    """A stateful 35670A with a device under test.

    Parameters
    ----------
    plant
        The device between source and input 2.
    choices
        What the manuals leave open, noise and seed.
    faults
        What shall go wrong.
    clock
        Wall clock, s; only faults look at it.
    """

    def __init__(
        self,
        plant: Plant,
        choices: Choices | None = None,
        faults: FaultBoard | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.plant = plant
        self.choices = choices or Choices()
        self.faults = faults or FaultBoard()
        self.options = self.choices.options
        if self.faults.take("missing-option"):
            kept = [name for name in self.options.split(",") if name.strip() != "1D2"]
            self.options = ",".join(kept)
        self.installed = {name.strip() for name in self.options.split(",")}
        self.agenda = Agenda()
        self.status = StatusModel()
        self.operations = Operations(self.status)
        self.errors = ErrorQueue()
        self.settings = Settings(all_settings())
        self.source = Source()
        self.source_started = False
        self.stuck_measuring = False
        self.message = ""
        """Last text sent to the screen."""
        self.remote = False
        self.local_lockout = False
        self.damage = Damage(self.faults, clock)
        self.measurement = Measurement(self)
        self.traces = TraceBoxes(self, lambda: self.measurement.shown)
        self.spectrum = Spectrum(self)
        self.calibration = Calibration(self)
        dispatcher = Dispatcher(self)
        self._execute = dispatcher.run
        self._exchange = Exchange(self._run, self.report, is_query, self._begin_message)
        self._exchange.on_reply = self.damage.to_reply
        self._new_message = dispatcher.new_message
        self.power_on()

    # The bus

    @property
    def gpib_address(self) -> int:
        """The address that it comes with."""
        return 11

    @property
    def measurements_begun(self) -> int:
        """Measurements started since it was built."""
        return self.measurement.started

    @property
    def points_begun(self) -> int:
        """Points begun since it was built."""
        return self.measurement.points_begun

    @property
    def repeats(self) -> bool:
        """Whether it measures again and again by itself."""
        return bool(self.settings.get("INIT:CONT"))

    @property
    def driven_v(self) -> float:
        """Largest magnitude of amplitude and offset at the connector now, V; 0 if off."""
        return max(abs(self.output_vpk), abs(self.source.offset_v))

    def listen(self, data: bytes, end: bool = False) -> int:
        """Take bytes, EOI with the last if `end`; how many were taken before the bus stalled."""
        if self.damage.dead:
            return 0
        self.remote = True
        taken = self._exchange.listen(data, end)
        self._settle_bus()
        return taken

    def talk(self, limit: int | None = None) -> Talk:
        """Send up to `limit` bytes of a reply."""
        if self.damage.dead or (self.damage.late and self._exchange.has_reply):
            return Talk(TalkState.WAITING)
        talk = self._exchange.talk(limit)
        if talk.end and self.damage.end_lost():
            talk = Talk(talk.state, talk.data, False)
        self._settle_bus()
        return talk

    def serial_poll(self) -> int | None:
        """The status byte with RQS; None if nobody answers the poll."""
        if self.damage.dead:
            return None
        self._settle_bus()
        return self.status.serial_poll()

    @property
    def service_request(self) -> bool:
        """The service-request line."""
        return self.status.requesting and not self.damage.dead

    @property
    def reply_ready(self) -> bool:
        """Whether a reply could be read now."""
        self._exchange.pump()
        ready = self._exchange.has_reply and not self.damage.late and not self.damage.dead
        self._settle_bus()
        return ready

    @property
    def reply_due(self) -> bool:
        """Whether a reply is there or under way."""
        return not self._exchange.idle

    def device_clear(self) -> None:
        """Empty both queues, free the parser, cancel the wait; nothing else changes."""
        if self.damage.dead:
            return
        self.damage.free_parser()
        self._exchange.clear()
        self.cancel_completion()
        self._settle_bus()

    def trigger(self) -> None:
        """Group trigger: refused as ``*TRG`` is."""
        if not self.damage.dead:
            self._run_reporting(b"*TRG")

    def _settle_bus(self) -> None:
        self.status.set_message_available(self._exchange.has_reply)

    def _begin_message(self) -> None:
        self._new_message()
        self._strike()

    def _run(self, unit: bytes) -> Answer:
        if self.damage.parser_stuck:
            return Hold(lambda: not self.damage.parser_stuck)
        return self._execute(unit)

    def _run_reporting(self, unit: bytes) -> None:
        try:
            self._execute(unit)
        except ScpiError as error:
            self.report(error.number, error.detail)

    def report(self, number: int, detail: str = "") -> None:
        """Queue an error and set its bit in the Standard Event register."""
        self.errors.push(number, detail)
        self.status.raise_event(_EVENT_OF_CLASS[abs(number) // 100])

    # Faults

    def _strike(self) -> None:
        """An opportunity for faults of the whole instrument."""
        self._set_phase()
        if self.faults.take("error-queue-overflow"):
            for _ in range(8):
                self.report(-113)
        if self.faults.take("hardware-error"):
            self.status.device.put(Device.HARDWARE_FAILED, True)
            self.report(-240, "Hardware error (see Fault Log).")
        self.damage.strike()
        if self.damage.power_failed():
            self.power_on()

    def _set_phase(self) -> None:
        self.faults.points_begun = self.measurement.points_begun
        if self.measurement.running and self.settings.mode is Mode.SINE:
            self.faults.phase = "sweep"
        else:
            self.faults.phase = "read-out" if self.measurement.points_begun else "prepare"

    def begin_point(self) -> None:
        """A point is about to be measured."""
        self._strike()

    def begin_read_out(self) -> None:
        """Data are about to be read."""
        self._set_phase()

    # Waiting

    def cancel_completion(self) -> None:
        """Forget ``*OPC`` and ``*OPC?``."""
        if self.operations.cancel():
            self._exchange.cancel_query()

    def after_a_while(self, seconds: float, reply: str) -> Callable[[], str | None]:
        """A reply that is ready after some of the instrument's time."""
        due: list[str] = []
        self.agenda.after(seconds, lambda: due.append(reply))
        return lambda: due[0] if due else None

    # Source and modes

    def refresh_source(self) -> None:
        """Let the output follow settings and mode."""
        settings, now = self.settings, self.agenda.now_s
        swept = settings.mode is Mode.SINE
        on = self.source_started if swept else bool(settings.get("OUTP"))
        if swept and self.choices.output_in_sine:
            on = on and bool(settings.get("OUTP"))
        level = volts_peak(settings.get("SOUR:VOLT")) if on else 0.0
        if not on and not swept:
            self.source.off(now)
            return
        rate = slew_vpk_per_s(settings.get("SOUR:VOLT:SLEW")) if swept else 0.0
        self.source.aim(now, level, rate)
        self.source.offset_v = settings.get("SOUR:VOLT:OFFS").value if on else 0.0

    @property
    def output_vpk(self) -> float:
        """Amplitude at the connector now, V peak."""
        return self.source.level(self.agenda.now_s)

    def enter_mode(self, mode: Mode) -> None:
        """Change over to another mode and its own settings."""
        self.measurement.forget()
        self.traces.forget()
        self.spectrum.forget()
        self.source_started = False
        self.settings.mode = mode
        self.refresh_source()
        if self.settings.get("INIT:CONT"):
            self.measurement.start()

    def shown_unit(self, unit: str) -> str:
        """The answer to ``? UNIT``."""
        return unit if unit and not self.choices.unit_quoted else f'"{unit}"'

    # Resets and power

    def reset(self, after_reset: bool) -> None:
        """``*RST`` (True) or ``SYST:PRES`` (False)."""
        self.cancel_completion()
        self.stuck_measuring = False
        self.measurement.forget()
        self.traces.forget()
        self.spectrum.forget()
        self.operations.forget()
        self.settings.reset(after_reset)
        self._follow_settings()
        operation = self.operations.begin()
        self.agenda.after(self.choices.reset_s, lambda: self.operations.end(operation))

    def restore(self, state: bytes) -> None:
        """``SYST:SET``: take over a whole state.

        Raises
        ------
        ScpiError
            -161 if it is none.
        """
        self.settings.load(state)
        self.measurement.forget()
        self.traces.forget()
        self.spectrum.forget()
        self._follow_settings()

    def _follow_settings(self) -> None:
        self.source_started = False
        self.source.off(self.agenda.now_s)
        self.refresh_source()
        self.calibration.follow_setting()
        if self.settings.get("INIT:CONT"):
            self.measurement.start()

    def power_on(self) -> None:
        """Come up with everything at its preset."""
        self._exchange.clear()
        self.cancel_completion()
        self.measurement.forget()
        self.traces.forget()
        self.traces.registers.clear()
        self.spectrum.forget()
        self.settings.forget()
        self.errors.clear()
        self.stuck_measuring = False
        self.operations.forget()
        self.status.power_on()
        self._follow_settings()
        self.calibration.power_on()

    def switch_off(self) -> None:
        """``SYST:POW:STAT OFF``: it needs a hand to come back."""
        self.measurement.forget()
        self.source_started = False
        self.source.off(self.agenda.now_s)
        self.damage.fall_silent()
