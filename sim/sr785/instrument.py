"""The simulated SR785: one instrument with everything in it, and its two interfaces.

Owns the parts and what joins them: commands in order, time, source, resets, power, faults. A
controller meets it on GPIB through `listen`, `talk`, `serial_poll` and `device_clear`, on RS-232
through `serial_in` and `serial_out`. It opens no port and never waits.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable

from sim.faults import FaultBoard
from sim.instrument.agenda import Agenda
from sim.instrument.bus import Talk, TalkState
from sim.instrument.damage import Damage
from sim.instrument.output import Source
from sim.instrument.plant import Plant
from sim.sr785.choices import Choices
from sim.sr785.execute import Executor, Outcome
from sim.sr785.language import CommandFault, ExecutionFault
from sim.sr785.port import Port
from sim.sr785.settings import SWEPT, Settings
from sim.sr785.status import Error, Event, Input, Status
from sim.sr785.sweep import Sweep
from sim.sr785.traces import Traces

__all__ = ["SR785"]

_GPIB, _RS232 = 0, 1


class SR785:
    """A stateful SR785 with a device under test.

    Parameters
    ----------
    plant
        The device between source and input 2.
    choices
        What the manual leaves open, noise and seed.
    faults
        What shall go wrong.
    clock
        Wall clock, s; faults look at it, and how long a transfer waits for its reader.
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
        self._clock = clock
        self.agenda = Agenda()
        self.damage = Damage(self.faults, clock)
        self.remote = False
        self.local_lockout = False
        self.input_now = 0
        self.levelled_vpk: float | None = None
        """Level that auto level found, V peak."""
        self.status = Status()
        self.settings = Settings(self.choices)
        self.source = Source()
        self.sweep = Sweep(self)
        self.traces = Traces(self, self.sweep)
        self._executor = Executor(self, self.sweep, self.traces)
        self._ports = (Port(b"\n", b"\n"), Port(b"\r\n", b"\r"))
        self._order: deque[int] = deque()
        """Interfaces in the order in which their commands came."""
        self._busy = False
        self._times_busy = 0
        self._transfer_until_s = math.inf
        self.power_on()

    # ------------------------------------------------------------ GPIB

    @property
    def gpib_address(self) -> int:
        """The address that it comes with."""
        return 10

    @property
    def measurements_begun(self) -> int:
        """Measurements started since it was built."""
        return self.sweep.started

    @property
    def points_begun(self) -> int:
        """Points begun since it was built."""
        return self.sweep.points_begun

    @property
    def repeats(self) -> bool:
        """Whether it measures again and again by itself."""
        swept = self.group == SWEPT
        return bool(self.settings.get("SRPT") if swept else self.settings.get("FAVT"))

    def listen(self, data: bytes, end: bool = False) -> int:
        """Take bytes, EOI with the last if `end`; it takes all, whether it has room or not."""
        if self.damage.dead:
            return 0
        self.remote = True
        self._take(_GPIB, data, end)
        return len(data)

    def talk(self, limit: int | None = None) -> Talk:
        """Send up to `limit` bytes of the oldest reply."""
        self._look()
        port = self._ports[_GPIB]
        if self.damage.dead or (self.damage.late and port.has_output):
            return Talk(TalkState.WAITING)
        if not port.has_output:
            waits = self._busy or bool(self._order)
            return Talk(TalkState.WAITING if waits else TalkState.NOTHING)
        sending = port.transfer is not None
        data, end = port.read(limit)
        if sending:
            self._transfer_until_s = self._clock() + self.choices.transfer_patience_s
            if end:
                self._end_transfer()
        if end and self.damage.end_lost():
            end = False
        self._settle()
        return Talk(TalkState.DATA, data, end)

    def serial_poll(self) -> int | None:
        """The status byte with IFC; None if nobody answers the poll."""
        self._look()
        return None if self.damage.dead else self.status.serial_poll()

    @property
    def service_request(self) -> bool:
        """The service-request line."""
        return self.status.requesting and not self.damage.dead

    @property
    def reply_ready(self) -> bool:
        """Whether a reply could be read now."""
        self._look()
        return self._ports[_GPIB].has_output and not self.damage.late and not self.damage.dead

    @property
    def reply_due(self) -> bool:
        """Whether something is under way that may bring a reply."""
        return self._ports[_GPIB].has_output or self._busy or bool(self._order)

    def device_clear(self) -> None:
        """Empty both buffers of the bus and free the parser; a sweep goes on."""
        if self.damage.dead:
            return
        self.damage.free_parser()
        port = self._ports[_GPIB]
        sending = port.transfer is not None
        port.clear()
        self._order = deque(place for place in self._order if place != _GPIB)
        if sending:
            self._end_transfer()
        self._settle()
        self._process()

    def trigger(self) -> None:
        """Group trigger: as ``TMAN``, which matters to triggered modes only."""

    # ------------------------------------------------------------ RS-232

    def serial_in(self, data: bytes) -> None:
        """Bytes that came on RS-232; lost while it is dead."""
        if not self.damage.dead:
            self._take(_RS232, data, False)

    def serial_out(self) -> bytes:
        """Everything that it has to say on RS-232."""
        port = self._ports[_RS232]
        if self.damage.dead or self.damage.late:
            return b""
        data = bytearray()
        while port.has_output:
            data += port.read(None)[0]
        return bytes(data)

    # ------------------------------------------------------------ commands in order

    def _take(self, place: int, data: bytes, end: bool) -> None:
        self._look()
        port = self._ports[place]
        before = len(port.commands)
        overflowed = port.take(data, end)
        if overflowed:
            self._order = deque(other for other in self._order if other != place)
            self.status.put("*ESR", Event.INPUT_OVERFLOW)
        self._order.extend([place] * max(0, len(port.commands) - before))
        self._process()

    def _process(self) -> None:
        while self._order and not self._busy and not self.damage.parser_stuck:
            self._strike()
            if self.damage.dead or self.damage.parser_stuck or not self._order:
                return
            place = self._order.popleft()
            self._run(self._ports[place].commands.popleft())
        self._settle()

    def _run(self, text: bytes) -> None:
        try:
            outcome = self._executor.run(text.decode("latin-1"))
        except CommandFault:
            self.status.put("*ESR", Event.COMMAND)
            outcome = Outcome()
        except ExecutionFault:
            self.status.put("*ESR", Event.EXECUTION)
            outcome = Outcome()
        answering = int(self.settings.get("OUTX"))
        port = self._ports[answering]
        if outcome.binary is not None or outcome.text_transfer is not None:
            if outcome.binary is not None and answering == _RS232:
                self.status.put("*ESR", Event.EXECUTION)
            else:
                self._send_trace(port, outcome)
                if answering == _GPIB:
                    self._begin_busy(None)
                    return
        elif outcome.reply is not None:
            self._reply(port, outcome.reply)
        seconds = self.choices.command_s if outcome.seconds is None else outcome.seconds
        self._begin_busy(seconds)

    def _send_trace(self, port: Port, outcome: Outcome) -> None:
        if outcome.binary is not None:
            data = outcome.binary
            if fault := self.faults.take("truncated-block"):
                data = data[: max(1, len(data) - fault.size)]
            port.transfer = bytearray(self.damage.to_reply(data))
        else:
            port.put_text_transfer(outcome.text_transfer or "")
            port.transfer = bytearray(self.damage.to_reply(bytes(port.transfer or b"")))
        self._transfer_until_s = self._clock() + self.choices.transfer_patience_s

    def _reply(self, port: Port, reply: str) -> None:
        if port.put(reply):
            self.status.put("*ESR", Event.OUTPUT_OVERFLOW)
            self.status.put("ERRS", Error.OUTPUT)
            return
        port.replies[-1] = bytearray(self.damage.to_reply(bytes(port.replies[-1])))

    def _begin_busy(self, seconds: float | None) -> None:
        self._busy = self.status.busy = True
        self._times_busy += 1
        number = self._times_busy
        if seconds is not None:
            self.agenda.after(seconds, lambda: self._end_busy(number))

    def _end_busy(self, number: int) -> None:
        if number == self._times_busy:
            self._busy = self.status.busy = False
            self._process()

    def _end_transfer(self) -> None:
        self._transfer_until_s = math.inf
        self._end_busy(self._times_busy)

    def _look(self) -> None:
        """Give up a transfer whose reader pauses for too long."""
        port = self._ports[_GPIB]
        if port.transfer is not None and self._clock() > self._transfer_until_s:
            port.transfer = None
            self.status.put("ERRS", Error.OUTPUT)
            self._end_transfer()

    def _settle(self) -> None:
        self.status.message_available = self._ports[_GPIB].has_output
        self.status.update()

    # ------------------------------------------------------------ source

    @property
    def group(self) -> str:
        """The measurement group of display A."""
        return self.traces.group_name(0)

    def refresh_source(self) -> None:
        """Let the output follow settings, group and sweep."""
        get, now = self.settings.get, self.agenda.now_s
        switched_on = bool(get("SRCO"))
        if self.group == SWEPT:
            on = self.sweep.running and (switched_on or not self.choices.sweep_obeys_switch)
            level = get("SSAM") if on else 0.0
            rate = get("SRAT") if get("SRMP") else 0.0
        else:
            on, rate = switched_on, 0.0
            level = get("S1AM") + get("S2AM") if on else 0.0
        self.source.aim(now, level, rate)
        self.source.offset_v = get("SOFF") if on else 0.0

    @property
    def driven_v(self) -> float:
        """Largest magnitude of amplitude and offset at the connector now, V; 0 if off."""
        return max(abs(self.source.level(self.agenda.now_s)), abs(self.source.offset_v))

    # ------------------------------------------------------------ faults

    def _strike(self) -> None:
        """An opportunity for faults of the whole instrument."""
        self._set_phase()
        if self.faults.take("outx-elsewhere"):
            self.settings.put("OUTX", 1 - self.settings.get("OUTX"))
        if self.faults.take("psd-stuck"):
            self.settings.put("PSDU", 1)
        if self.faults.take("display-off-line"):
            self.traces.freeze(0, True)
            self.settings.put("DISP", 0, 0)
        if self.faults.take("key-pressed"):
            self.settings.put("SICY", self.settings.get("SICY") + 1)
            self.status.put("*ESR", Event.KEY)
        if self.faults.take("panel-pause"):
            self.status.put("*ESR", Event.KEY)
            self.sweep.pause()
        if self.faults.take("range-moved"):
            self.settings.put("A2RG", 0)
            self.settings.put("I2RG", -50)
            self.status.put("INPS", Input.RANGED << 8)
        self.damage.strike()
        if self.damage.power_failed():
            self.power_on()

    def _set_phase(self) -> None:
        self.faults.points_begun = self.points_begun
        if self.sweep.running and self.group == SWEPT:
            self.faults.phase = "sweep"
        else:
            self.faults.phase = "read-out" if self.points_begun else "prepare"

    def begin_point(self) -> None:
        """A point is about to be measured."""
        self._strike()

    def begin_read_out(self) -> None:
        """A trace is about to be read."""
        self._set_phase()

    # ------------------------------------------------------------ resets and power

    def reset(self) -> None:
        """``*RST``."""
        self.sweep.forget()
        self.settings.reset()
        self.traces.reset()
        self.refresh_source()
        self.source.off(self.agenda.now_s)

    def power_on(self) -> None:
        """Come up with everything at its preset."""
        for port in self._ports:
            port.clear()
        self._order.clear()
        self._transfer_until_s = math.inf
        self._times_busy += 1
        self._busy = self.status.busy = False
        self.settings.put("PSDU", 0)
        self.reset()
        self.input_now = 0
        self.status.power_on()
        self._settle()
