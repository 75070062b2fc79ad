"""The safe-off recipe of the HP 35670A: quiet the source in both modes, and prove it.

Owns the order of the steps and the judgement of the proof. It depends on
nothing that a driver believes, uses short time-outs of its own, tries every
step whatever became of the one before, may be run twice, and never raises.
The order is derived from the manuals and is UNVERIFIED on an oscilloscope.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from daq.analyser import SourceState
from daq.dialogue import Dialogue
from daq.errors import LashbenchError
from daq.hp35670a_settings import LEVEL
from daq.scpi import parse_integer, parse_number, parse_string
from daq.transports.base import Deadline, Transport

__all__ = ["SafeOff", "Step", "make_safe", "read_source"]

_REPLY_S = 1.0
_RESET_S = 5.0
_BUDGET_S = 12.0
"""Once this is spent every further question gets next to no time; every step is still tried."""
_LEAST_REPLY_S = 0.05
_RAMP_MARGIN_S = 0.1
_LONGEST_RAMP_S = 10.0
_HIGHEST_VPK = LEVEL.high


@dataclass(frozen=True, slots=True)
class Step:
    """One thing that was tried, and what came of it."""

    what: str
    result: str
    """Reply, "done", or the error in full."""
    failed: bool


@dataclass(frozen=True, slots=True)
class SafeOff:
    """What is known of the source after the recipe, and every step that led there."""

    state: SourceState
    steps: tuple[Step, ...]

    def __str__(self) -> str:
        failed = "; ".join(f"{step.what}: {step.result}" for step in self.steps if step.failed)
        return f"source {self.state}" + (f" ({failed})" if failed else "")


class _Attempt:
    """Runs steps, one after the other, and keeps what became of each."""

    def __init__(self, transport: Transport, told: Callable[[float], None] | None) -> None:
        self.dialogue = Dialogue(transport, reply_s=_REPLY_S)
        self.dialogue.on_exchange = told
        self.steps: list[Step] = []
        self.answered = False
        self._budget = Deadline.after(_BUDGET_S)

    def act(self, what: str, action: Callable[[], str]) -> str | None:
        self.dialogue.reply_s = self.bound(_REPLY_S)
        try:
            result = action()
        except LashbenchError as error:
            self.steps.append(Step(what, str(error), failed=True))
            return None
        except Exception as error:  # whatever it is, the next step must still be tried
            fault = f"{type(error).__name__}: {error}"
            self.steps.append(Step(what, fault, failed=True))
            return None
        self.steps.append(Step(what, result, failed=False))
        return result

    def bound(self, seconds: float) -> float:
        return max(_LEAST_REPLY_S, min(seconds, self._budget.remaining_s))

    def send(self, line: str) -> None:
        def action() -> str:
            self.dialogue.send(line)
            return "done"

        self.act(line, action)

    def ask(self, line: str) -> str | None:
        reply = self.act(line, lambda: self.dialogue.ask(line))
        self.answered = self.answered or reply is not None
        return reply


def make_safe(transport: Transport, told: Callable[[float], None] | None = None) -> SafeOff:
    """Switch the source off whatever the instrument is doing, and say what could be proven.

    Parameters
    ----------
    told
        Told before each exchange how long it may take at most, s; must not raise.

    Returns
    -------
    SafeOff
        ``confirmed-off`` only if output, level, offset and mode read back as
        they should; ``unconfirmed`` if the instrument answers but they do not;
        ``unknown`` if it cannot be asked.
    """
    attempt = _Attempt(transport, told)
    _go_quiet(attempt)
    proven = _proof(attempt)
    if not attempt.answered:
        attempt.send("*RST")  # it cannot be asked, but it may hear
    elif not proven:
        attempt.act("*RST", lambda: _reset(attempt))
        proven = _proof(attempt)
    if attempt.answered:
        attempt.act("SYST:ERR?", lambda: _drained(attempt))
    if proven:
        state = SourceState.CONFIRMED_OFF
    else:
        state = SourceState.UNCONFIRMED if attempt.answered else SourceState.UNKNOWN
    return SafeOff(state, tuple(attempt.steps))


def read_source(dialogue: Dialogue) -> SourceState:
    """What a read-back says of the source, nothing being changed."""
    try:
        mode = parse_string(dialogue.ask("INST:SEL?")).upper()
        reply, unit = dialogue.read_back(LEVEL)
        level_vpk = LEVEL.value_of(reply, unit)
        quiet = level_vpk == 0 and dialogue.ask_number("SOUR:VOLT:OFFS?") == 0
        if mode == "FFT":
            quiet_output = dialogue.ask_integer("OUTP?") == 0
            return SourceState.CONFIRMED_OFF if quiet and quiet_output else SourceState.ON
    except LashbenchError:
        return SourceState.UNKNOWN
    # In swept sine the output has no switch to be read; level 0 is all that can be had.
    return SourceState.UNCONFIRMED if quiet else SourceState.ON


def _go_quiet(attempt: _Attempt) -> None:
    """Steps 1 to 8: stop, lower what drives in this mode, fall back to FFT mode, switch off."""
    attempt.act("device clear", lambda: _cleared(attempt))
    attempt.send("ABOR")
    attempt.send("INIT:CONT OFF")
    attempt.send("SOUR:VOLT 0 VPK")
    attempt.send("SOUR:VOLT:OFFS 0 V")
    attempt.act("wait for the ramp", lambda: _ramp(attempt))
    attempt.send("INST:SEL FFT")
    attempt.send("SOUR:VOLT 0 VPK")
    attempt.send("SOUR:VOLT:OFFS 0 V")
    attempt.send("OUTP OFF")


def _cleared(attempt: _Attempt) -> str:
    attempt.dialogue.clear()
    return "done"


def _ramp(attempt: _Attempt) -> str:
    """Wait until the level has come down; only swept sine ramps."""
    dialogue = attempt.dialogue
    if parse_string(dialogue.ask("INST:SEL?")).upper() != "SINE":
        return "not in swept sine"
    unit = parse_string(dialogue.ask("SOUR:VOLT:SLEW? UNIT")).upper()
    rate = parse_number(dialogue.ask("SOUR:VOLT:SLEW?")) * (2**0.5 if unit == "VRMS/S" else 1.0)
    if rate <= 0:
        return "no ramp is set"
    # The level it comes from is not known here, so the highest is taken.
    wait_s = min(_HIGHEST_VPK / rate + _RAMP_MARGIN_S, _LONGEST_RAMP_S)
    if dialogue.on_exchange is not None:
        dialogue.on_exchange(wait_s)
    dialogue.transport.pause(wait_s)
    return f"{wait_s:.2f} s"


def _proof(attempt: _Attempt) -> bool:
    """Step 9; every read-back is tried, and each must be right."""
    output = attempt.ask("OUTP?")
    unit = attempt.ask("SOUR:VOLT? UNIT")
    level = attempt.ask("SOUR:VOLT?")
    offset = attempt.ask("SOUR:VOLT:OFFS?")
    mode = attempt.ask("INST:SEL?")
    try:
        return (
            output is not None
            and parse_integer(output) == 0
            and level is not None
            and unit is not None
            and LEVEL.value_of(level, parse_string(unit)) == 0
            and offset is not None
            and parse_number(offset) == 0
            and mode is not None
            and parse_string(mode).upper() == "FFT"
        )
    except LashbenchError as error:
        attempt.steps.append(Step("proof", str(error), failed=True))
        return False


def _reset(attempt: _Attempt) -> str:
    """Fallback: the presets are FFT mode, output off, level and offset 0."""
    dialogue = attempt.dialogue
    dialogue.send("*RST")
    # A query that waits is the synchronisation here: `*OPC` would need polling, and this
    # path must stay short.
    dialogue.ask("INST:SEL?", attempt.bound(_RESET_S))
    dialogue.send("OUTP OFF")
    return "done"


def _drained(attempt: _Attempt) -> str:
    return ", ".join(str(entry) for entry in attempt.dialogue.drain()) or "empty"
