"""Executing the SR785's commands: what each does and what each answers.

Owns the table of commands that are more than a kept value, and the rules for the argument that
chooses a display. It moves no bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sim.sr785.language import Command, CommandFault, ExecutionFault, parse_command, whole
from sim.sr785.parts import InstrumentCore
from sim.sr785.settings import GROUPS, SWEPT, TABLE
from sim.sr785.status import ENABLES
from sim.sr785.sweep import Sweep
from sim.sr785.traces import Traces

__all__ = ["Executor", "Outcome"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a command leads to."""

    reply: str | None = None
    text_transfer: str | None = None
    """A whole trace in ASCII."""
    binary: bytes | None = None
    """A trace in binary; GPIB only."""
    seconds: float | None = None
    """How long it takes; None for a command's usual time."""


Handler = Callable[[Command], Outcome | None]
_WORDS = {"INST": "INST", "DSPS": "DSPS", "INPS": "INPS", "ERRS": "ERRS", "*ESR": "*ESR"}
_IGNORED = frozenset(
    {
        "ASCL", "MRKR", "MKMD", "MBIN", "MRLK", "MRWD", "CFRO", "ACTL", "PRNT", "PDST", "POUT",
        "PSCL", "KLOK", "SYVI", "DTIM", "ALRM", "ALTM", "AVNR", "YMAX", "YMIN", "YCEN", "YDIV",
        "XMAX", "XMIN", "XCEN", "XDIV", "GRID", "GSCL", "FSCL",
    }
)  # fmt: skip
"""What clients send that changes nothing measured; taken without a word."""
_RESETS_SWEEP = ("SSTR", "SSTP", "SNPS", "SSTY")


class Executor:
    """The command table of one instrument."""

    def __init__(self, instrument: InstrumentCore, sweep: Sweep, traces: Traces) -> None:
        self._instrument, self._sweep, self._traces = instrument, sweep, traces
        self._handlers: dict[str, Handler] = {
            "*IDN": self._identity, "*RST": self._reset, "*CLS": self._clear, "*STB": self._byte,
            "*SRE": self._request_enable, "*PSC": self._power_on_clear, "*TST": self._self_test,
            "MGRP": self._group, "MEAS": self._measurement, "VIEW": self._view,
            "DISP": self._live, "STRT": self._start, "PAUS": self._pause, "CONT": self._go_on,
            "TMAN": self._nothing, "DSPN": self._length, "DBIN": self._bin, "DSPY": self._text,
            "DSPB": self._binary, "UNIT": self._unit, "SSFR": self._progress,
            "INPC": self._input_now, "NAVG": self._averages,
        }  # fmt: skip

    def run(self, text: str) -> Outcome:
        """Execute one command; raises `CommandFault` or `ExecutionFault`."""
        command = parse_command(text)
        if (handler := self._handlers.get(command.name)) is not None:
            return handler(command) or Outcome()
        if command.name in _WORDS:
            return self._word(command)
        if command.name in ENABLES:
            return self._enable(command)
        if command.name in TABLE:
            return self._setting(command)
        if command.name in _IGNORED:
            return Outcome("0") if command.asks else Outcome()
        raise CommandFault(text)

    # ------------------------------------------------------------ arguments

    @staticmethod
    def _count(command: Command, *allowed: int) -> None:
        if len(command.arguments) not in allowed:
            raise CommandFault(command.name)

    @staticmethod
    def _display(command: Command) -> int:
        """The display that a query is about; both cannot be asked."""
        if not command.arguments:
            raise CommandFault(command.name)
        return whole(command.arguments[0], 0, 1)

    @staticmethod
    def _displays(command: Command) -> tuple[int, ...]:
        """The displays that are set."""
        place = whole(command.arguments[0], 0, 2)
        return (0, 1) if place == 2 else (place,)

    def _asks(self, command: Command) -> None:
        if not command.asks:
            raise CommandFault(command.name)

    def _must_be_live(self, display: int, group: str | None) -> None:
        instrument = self._instrument
        if group is not None and self._traces.group_name(display) != group:
            raise ExecutionFault("the measurement group")
        if not instrument.settings.get("DISP", display):
            raise ExecutionFault("the display is off-line")

    # ------------------------------------------------------------ kept values

    def _setting(self, command: Command) -> Outcome:
        instrument, kind, name = self._instrument, TABLE[command.name], command.name
        if command.asks:
            self._count(command, 1 if kind.per_display else 0)
            display = self._display(command) if kind.per_display else 0
            return Outcome(instrument.settings.shown(name, display))
        self._count(command, 2 if kind.per_display else 1)
        value = instrument.settings.read(name, command.arguments[-1])
        places = self._displays(command) if kind.per_display else (0,)
        for display in places:
            if kind.group is not None or kind.per_display:
                self._must_be_live(display, kind.group)
        self._check(name, value, places)
        before = [instrument.settings.shown(name, display) for display in places]
        for display in places:
            instrument.settings.put(name, value, display if kind.per_display else None)
        after = [instrument.settings.shown(name, display) for display in places]
        self._changed(name, before != after)
        return Outcome()

    def _check(self, name: str, value: object, places: tuple[int, ...]) -> None:
        get = self._instrument.settings.get
        if name in ("SSAM", "S1AM", "S2AM") and isinstance(value, tuple):
            if value[0] + abs(get("SOFF")) > 5.0 + 1e-9:
                raise ExecutionFault("amplitude and offset exceed 5 V")
            if name == "SSAM" and get("SSAL"):
                raise ExecutionFault("auto level has the amplitude")
        if name == "SOFF" and isinstance(value, float):
            level = max(get("SSAM"), get("S1AM") + get("S2AM"))
            if self._instrument.group == SWEPT:
                level = get("SSAM")
            if level + abs(value) > 5.0 + 1e-9:
                raise ExecutionFault("amplitude and offset exceed 5 V")

    def _changed(self, name: str, differs: bool) -> None:
        instrument = self._instrument
        if name in _RESETS_SWEEP and differs:
            self._sweep.reset()
        elif name == "SSAL" and instrument.settings.get("SSAL"):
            instrument.settings.put("A1RG", 1)
            instrument.settings.put("A2RG", 1)
        instrument.refresh_source()

    # ------------------------------------------------------------ groups, measurements, views

    def _group(self, command: Command) -> Outcome | None:
        traces, groups = self._traces, GROUPS[self._instrument.choices.model]
        if command.asks:
            return Outcome(str(traces.group[self._display(command)]))
        self._count(command, 2)
        group = whole(command.arguments[1], 0, max(groups))
        places = self._displays(command)
        if SWEPT in (groups[group], *map(traces.group_name, (0, 1))):
            places = 0, 1  # swept sine has both displays or none
        if all(traces.group[place] == group for place in places):
            return None
        for place in places:
            traces.enter(place, group)
        self._sweep.forget()
        self._instrument.refresh_source()
        return None

    def _measurement(self, command: Command) -> Outcome | None:
        traces = self._traces
        if command.asks:
            return Outcome(str(traces.measurement[self._display(command)]))
        self._count(command, 2)
        number = whole(command.arguments[1], 0, 99)
        for display in self._displays(command):
            traces.choose(display, number)
        return None

    def _view(self, command: Command) -> Outcome | None:
        traces = self._traces
        if command.asks:
            return Outcome(str(traces.view[self._display(command)]))
        self._count(command, 2)
        view = whole(command.arguments[1], 0, 8)
        for display in self._displays(command):
            traces.view[display] = view
        return None

    def _live(self, command: Command) -> Outcome | None:
        if command.asks:
            self._count(command, 1)
            return Outcome(self._instrument.settings.shown("DISP", self._display(command)))
        self._count(command, 2)
        live = whole(command.arguments[1], 0, 1)
        for display in self._displays(command):
            self._traces.freeze(display, not live)
            self._instrument.settings.put("DISP", live, display)
        return None

    # ------------------------------------------------------------ measuring

    def _start(self, command: Command) -> None:
        self._count(command, 0)
        self._sweep.start()

    def _pause(self, command: Command) -> None:
        self._count(command, 0)
        self._sweep.pause()

    def _go_on(self, command: Command) -> None:
        self._count(command, 0)
        self._sweep.go_on()

    def _nothing(self, command: Command) -> None:
        self._count(command, 0)

    def _progress(self, command: Command) -> Outcome:
        self._asks(command)
        place, hz = self._sweep.present
        shown = f"{hz:.7g}" if self._instrument.choices.progress_is_frequency else str(place)
        return Outcome(shown)

    # ------------------------------------------------------------ data

    def _averages(self, command: Command) -> Outcome:
        """``NAVG? d``: records in the average so far."""
        self._asks(command)
        self._count(command, 1)
        self._display(command)
        return Outcome(str(self._sweep.averaged))

    def _length(self, command: Command) -> Outcome:
        self._asks(command)
        return Outcome(str(self._traces.length(self._display(command))))

    def _row(self, command: Command) -> tuple[int, int]:
        self._count(command, 2)
        display = self._display(command)
        row = whole(command.arguments[1], 0, self._traces.length(display) - 1)
        return display, row

    def _bin(self, command: Command) -> Outcome:
        self._asks(command)
        display, row = self._row(command)
        return Outcome(self._real(float(self._traces.axis(display)[row])))

    def _text(self, command: Command) -> Outcome:
        self._asks(command)
        instrument = self._instrument
        if len(command.arguments) == 2:
            display, row = self._row(command)
            found = np.atleast_1d(self._traces.values(display)[row])
            # The order of the marker position bar: X, then Y.
            return Outcome(",".join(self._real(float(value)) for value in found[::-1]))
        self._count(command, 1)
        instrument.begin_read_out()
        found = self._traces.values(self._display(command))
        if found.ndim == 2:
            found = found[:, ::-1].ravel()
        return Outcome(text_transfer=",".join(self._real(float(value)) for value in found))

    def _binary(self, command: Command) -> Outcome:
        self._asks(command)
        instrument = self._instrument
        if len(command.arguments) == 2:
            display, row = self._row(command)
            found = np.atleast_1d(self._traces.values(display)[row])
        else:
            self._count(command, 1)
            instrument.begin_read_out()
            found = self._traces.values(self._display(command))
        return Outcome(binary=found.astype("<f4").tobytes())

    def _unit(self, command: Command) -> Outcome:
        self._asks(command)
        return Outcome(self._traces.unit(self._display(command)))

    def _real(self, value: float) -> str:
        return f"{np.float32(value):.{self._instrument.choices.digits - 1}e}"

    # ------------------------------------------------------------ status

    def _word(self, command: Command) -> Outcome:
        self._asks(command)
        self._count(command, 0, 1)
        bit = whole(command.arguments[0], 0, 15) if command.arguments else None
        return Outcome(str(self._instrument.status.take(_WORDS[command.name], bit)))

    def _enable(self, command: Command) -> Outcome:
        status, word = self._instrument.status, ENABLES[command.name]
        if command.asks:
            return Outcome(str(status.enables[word]))
        self._count(command, 1)
        status.enables[word] = whole(command.arguments[0], 0, 65535)
        status.update()
        return Outcome()

    def _input_now(self, command: Command) -> Outcome:
        self._asks(command)
        channel = self._display(command)
        return Outcome(str(self._instrument.input_now >> 8 * channel & 15))

    def _byte(self, command: Command) -> Outcome:
        self._asks(command)
        return Outcome(str(self._instrument.status.status_byte()))

    def _request_enable(self, command: Command) -> Outcome:
        status = self._instrument.status
        if command.asks:
            return Outcome(str(status.request_enable))
        self._count(command, 1)
        status.request_enable = whole(command.arguments[0], 0, 255) & ~64
        status.update()
        return Outcome()

    def _power_on_clear(self, command: Command) -> Outcome:
        status = self._instrument.status
        if command.asks:
            return Outcome("0" if status.keeps_enables else "1")
        self._count(command, 1)
        status.keeps_enables = not whole(command.arguments[0], 0, 1)
        return Outcome()

    def _identity(self, command: Command) -> Outcome:
        self._asks(command)
        choices = self._instrument.choices
        fields = "Stanford_Research_Systems", choices.model, choices.serial, choices.version
        return Outcome(",".join(fields))

    def _self_test(self, command: Command) -> Outcome:
        self._asks(command)
        return Outcome("0")

    def _clear(self, command: Command) -> None:
        self._count(command, 0)
        self._instrument.status.clear()

    def _reset(self, command: Command) -> Outcome:
        self._count(command, 0)
        self._instrument.reset()
        return Outcome(seconds=self._instrument.choices.reset_s)
