"""A fake GPIB adapter: Prologix and AR488 as seen from the host's end of the cable.

Owns the adapter's own commands, escaping, time-outs and settings, and the
oddities of both dialects. It speaks to the instrument over its bus and never
knows what is on the other side of the cable: bytes come in by `receive`, go
out by `take_output`.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Literal

from sim.instrument.bus import Instrument, TalkState
from sim.instrument.gpib_arduino import ARDUINO_COMMANDS, READ_FLAG, SEND_FLAG
from sim.instrument.gpib_dialects import PROLOGIX_USB, Dialect

__all__ = ["FakeAdapter"]

_ESCAPE, _PLUS = 27, 43
_ENDS = (10, 13)
_BURST_S = 0.02
"""Time's worth of bytes that a serial line may deliver at once after it was quiet."""


@dataclass(slots=True)
class _Send:
    """Bytes on their way to the instrument."""

    data: bytes
    eoi: bool
    question: bool
    deadline_s: float = math.inf


@dataclass(slots=True)
class _Read:
    """A read under way: until EOI, a character, or the time-out between bytes."""

    until: Literal["eoi", "time-out"] | int
    deadline_s: float = math.inf
    silent: bool = False


@dataclass(slots=True)
class _Poll:
    """A serial poll that nobody answers yet."""

    deadline_s: float = math.inf


class FakeAdapter:
    """One adapter on one instrument's bus.

    Parameters
    ----------
    instrument
        What hangs on the bus.
    dialect
        Which make.
    address
        The instrument's own GPIB address, where it was changed from its preset.
    restart_s
        Overrides the dialect's deafness after a start.
    paced
        Whether a serial line's speed is kept.
    """

    name = "gpib"

    def __init__(
        self,
        instrument: Instrument,
        dialect: Dialect = PROLOGIX_USB,
        *,
        address: int | None = None,
        restart_s: float | None = None,
        paced: bool = False,
    ) -> None:
        self.instrument = instrument
        self.dialect = dialect
        self.own_address = instrument.gpib_address if address is None else address
        self._restart_s = dialect.restart_s if restart_s is None else restart_s
        self._rate = dialect.bytes_per_s if paced else 0.0
        self.eeprom_writes = 0
        self.identity = {"name": "", "serial": "0" * 9, "verstr": "", "fwver": dialect.version}
        """What ``++id`` answers; kept in the memory of an AR488."""
        self._output = bytearray()
        self._sent_at_s = -math.inf
        self._deaf_until = -math.inf
        self._settle()

    def _settle(self) -> None:
        """Everything as after a start."""
        dialect = self.dialect
        self.settings = {
            "addr": dialect.address,
            "auto": dialect.auto,
            "eoi": dialect.eoi,
            "eos": dialect.eos,
            "eot_enable": 0,
            "eot_char": 0,
            "mode": 1,
            "read_tmo_ms": dialect.read_ms,
            "savecfg": 1,
            "idn": 0,
            "flags": 0,
        }
        self._secondary: int | None = None
        self.verbose = False
        self._line = bytearray()
        self._literal: list[bool] = []
        self._escaped = False
        self._jobs: deque[_Send | _Read | _Poll] = deque()
        self._waiting_lines: deque[tuple[bytes, bool]] = deque()

    def restart(self, now_s: float, seconds: float | None = None) -> None:
        """Start anew, as on ``++rst``, on a reset by DTR, or by a fault."""
        self._settle()
        self._output.clear()
        self._deaf_until = now_s + (self._restart_s if seconds is None else seconds)
        self._output += self.dialect.greeting

    # The host's end

    def opened(self, now_s: float) -> None:
        """The line DTR is pulled on opening, and an Uno, Nano or Mega starts anew."""
        if self.dialect.name == "ar488":
            self.restart(now_s)

    def receive(self, data: bytes, now_s: float) -> None:
        """Bytes from the host; lost while the adapter starts."""
        if now_s < self._deaf_until:
            return
        for byte in data:
            self._take(byte)
        self.pump(now_s)

    def take_output(self, now_s: float) -> bytes:
        """Bytes for the host, as many as the line has carried by now."""
        if now_s < self._deaf_until:
            return b""
        count = len(self._output)
        if self._rate:
            since = min(now_s - self._sent_at_s, _BURST_S)
            count = min(count, int(since * self._rate))
            if not count:
                return b""
            self._sent_at_s = now_s
        data = bytes(self._output[:count])
        del self._output[:count]
        return data

    @property
    def busy(self) -> bool:
        """Whether something is under way that time alone may end."""
        return bool(self._jobs or self._output or self._waiting_lines)

    def _take(self, byte: int) -> None:
        """Collect a line, undoing the escapes."""
        if self._escaped:
            self._escaped = False
            self._keep(byte, True)
        elif byte == _ESCAPE:
            self._escaped = True
        elif byte in _ENDS:
            self._end_line()
        else:
            self._keep(byte, False)

    def _keep(self, byte: int, literal: bool) -> None:
        self._line.append(byte)
        self._literal.append(literal)
        piece = self.dialect.piece_bytes
        if piece and len(self._line) >= piece and not self._is_command:
            self._end_line()

    @property
    def _is_command(self) -> bool:
        return self._line[:2] == b"++" and not any(self._literal[:2])

    def _end_line(self) -> None:
        line, command = bytes(self._line), self._is_command
        if not command and self.dialect.name == "prologix":
            # An unescaped plus is lost; an AR488 lets a single one pass.
            pairs = zip(self._line, self._literal, strict=True)
            line = bytes(byte for byte, literal in pairs if literal or byte != _PLUS)
        self._line.clear()
        self._literal.clear()
        if line:
            self._waiting_lines.append((line, command))

    # Work

    def pump(self, now_s: float) -> None:
        """Go on with what is under way."""
        if now_s < self._deaf_until:
            return
        if fault := self.instrument.damage.link_fault("adapter-reset"):
            self.restart(now_s, fault.seconds)
            return
        while self._jobs or self._waiting_lines:
            if self._jobs:
                if not self._work(self._jobs[0], now_s):
                    return
                self._jobs.popleft()
                continue
            line, command = self._waiting_lines.popleft()
            if command:
                self._command(line[2:].decode("ascii", "replace"), now_s)
            else:
                self._queue_send(line)
        if self.settings["auto"] == 3 and self._addressed and self.instrument.reply_ready:
            self._jobs.append(_Read("eoi"))
            self.pump(now_s)

    @property
    def _addressed(self) -> bool:
        """Whether the address set is the instrument's; it has no secondary one."""
        return self.settings["addr"] == self.own_address and self._secondary is None

    def _queue_send(self, line: bytes) -> None:
        if not self.settings["mode"]:
            return
        ends = (b"\r\n", b"\r", b"\n", b"")[self.settings["eos"]]
        question = line.rstrip().endswith(b"?")
        self._jobs.append(_Send(line + ends, bool(self.settings["eoi"]), question))

    def _work(self, job: _Send | _Read | _Poll, now_s: float) -> bool:
        """Go on with one job; whether it is done."""
        if math.isinf(job.deadline_s):
            job.deadline_s = now_s + self.settings["read_tmo_ms"] / 1000.0
        match job:
            case _Send():
                return self._work_send(job, now_s)
            case _Read():
                return self._work_read(job, now_s)
        byte = self.instrument.serial_poll() if self._addressed else None
        if byte is not None:
            self.say(str(byte))
            return True
        return now_s >= job.deadline_s

    def _work_send(self, job: _Send, now_s: float) -> bool:
        eoi = job.eoi and not self.dialect.late_eoi
        taken = self.instrument.listen(job.data, eoi) if self._addressed else 0
        job.data = job.data[taken:]
        if taken:
            job.deadline_s = now_s + self.settings["read_tmo_ms"] / 1000.0
        if job.data and now_s < job.deadline_s:
            return False
        self._flag(SEND_FLAG, "Send^OK")
        auto = self.settings["auto"]
        if auto == 1 or (auto == 2 and job.question):
            self._jobs.append(_Read("eoi"))
        return True

    def _work_read(self, job: _Read, now_s: float) -> bool:
        """One talk at a time; a silent end by time-out, the reply staying where it is."""
        while self._addressed and not job.silent:
            talk = self.instrument.talk(1 if isinstance(job.until, int) else None)
            if talk.state is TalkState.NOTHING:
                # The instrument has complained once; the bus stays quiet until the time-out.
                job.silent = True
                break
            if talk.state is TalkState.WAITING:
                break
            self._output += talk.data
            job.deadline_s = now_s + self.settings["read_tmo_ms"] / 1000.0
            if talk.end and self.settings["eot_enable"]:
                self._output.append(self.settings["eot_char"])
            by_eoi = talk.end and (job.until == "eoi" or self._eoi_always_ends)
            if by_eoi or (isinstance(job.until, int) and talk.data[-1:] == bytes([job.until])):
                self._flag(READ_FLAG, "Read^OK")
                return True
        if now_s < job.deadline_s:
            return False
        self._flag(READ_FLAG, "Read^OK")
        return True

    def _flag(self, bit: int, text: str) -> None:
        """Say that something is done, if it was asked for and nothing reads by itself."""
        if self.settings["flags"] & bit and not self.settings["auto"]:
            self.say(text)

    @property
    def _eoi_always_ends(self) -> bool:
        return self.dialect.name == "ar488" and bool(self.settings["eoi"])

    # The adapter's own commands

    def say(self, text: str) -> None:
        """Answer one line."""
        self._output += text.encode("ascii") + b"\r\n"

    def _command(self, text: str, now_s: float) -> None:
        words = text.split()
        name, values = (words[0].lower(), words[1:]) if words else ("", [])
        if self.verbose:
            self.say("++" + text)
        handler = getattr(self, f"_do_{name}", None) if name.isidentifier() else None
        is_arduino = self.dialect.name == "ar488"
        if handler is not None:
            handler(values, now_s)
        elif is_arduino and name in ARDUINO_COMMANDS:
            ARDUINO_COMMANDS[name](self, values)
        elif name in self.settings and (name not in ("idn", "flags") or is_arduino):
            self._set_or_show(name, values)
        else:
            self.say("Unrecognized command")
        if self.verbose:
            self._output += b"> "

    def _set_or_show(self, name: str, values: list[str]) -> None:
        limits = {
            "auto": 3 if self.dialect.name == "ar488" else 1,
            "eos": 3,
            "eot_char": 255,
            "addr": 30,
            "read_tmo_ms": self.dialect.longest_read_ms,
            "idn": 2,
            "flags": 7,
        }
        if not values:
            shown = str(self.settings[name])
            if name == "addr" and self._secondary is not None:
                shown += f" {self._secondary}"
            self.say(shown)
            return
        low = 1 if name == "read_tmo_ms" else 0
        high = limits.get(name, 1)
        if not values[0].isdigit() or not low <= int(values[0]) <= high:
            self.say("Invalid parameter")
            return
        self.settings[name] = int(values[0])
        if name == "addr":
            second = values[1] if len(values) > 1 else ""
            self._secondary = int(second) if second.isdigit() else None
        if self.dialect.saves_on_change and self.settings["savecfg"]:
            self.eeprom_writes += 1

    def _do_savecfg(self, values: list[str], now_s: float) -> None:
        if self.dialect.name == "ar488":
            # No argument is looked at: it writes at once.
            self.eeprom_writes += 1
            return
        self._set_or_show("savecfg", values)

    def _do_read(self, values: list[str], now_s: float) -> None:
        until: Literal["eoi", "time-out"] | int = "time-out"
        if values and values[0].lower() == "eoi":
            until = "eoi"
        elif values and values[0].isdigit():
            until = int(values[0]) % 256
        self._jobs.append(_Read(until))

    def _do_spoll(self, values: list[str], now_s: float) -> None:
        is_arduino = self.dialect.name == "ar488"
        if is_arduino and values and values[0].lower() == "all":
            ARDUINO_COMMANDS["allspoll"](self, values)
            return
        # An AR488 polls each of a list, a Prologix the first.
        if values and str(self.own_address) not in (values if is_arduino else values[:1]):
            return
        self._jobs.append(_Poll())

    def _do_srq(self, values: list[str], now_s: float) -> None:
        self.say("1" if self.instrument.service_request else "0")

    def _do_clr(self, values: list[str], now_s: float) -> None:
        if self._addressed:
            self.instrument.device_clear()

    def _do_trg(self, values: list[str], now_s: float) -> None:
        if self._addressed:
            self.instrument.trigger()

    def _do_ifc(self, values: list[str], now_s: float) -> None:
        """Interface clear: the bus is quiet; queues and settings stay."""

    def _do_loc(self, values: list[str], now_s: float) -> None:
        self.instrument.remote = False

    def _do_llo(self, values: list[str], now_s: float) -> None:
        self.instrument.local_lockout = True

    def _do_rst(self, values: list[str], now_s: float) -> None:
        self.restart(now_s)

    def _do_ver(self, values: list[str], now_s: float) -> None:
        real = bool(values) and values[0].lower() == "real"
        self.say((not real and self.identity["verstr"]) or self.dialect.version)

    def _do_help(self, values: list[str], now_s: float) -> None:
        self.say("The following commands are available:")
        for name in sorted((*self.settings, "clr", "ifc", "read", "rst", "spoll", "srq", "ver")):
            self.say(f"++{name}")
