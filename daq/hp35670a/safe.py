"""The safe-off recipe of the HP 35670A: quiet the source in both modes, and prove it.

Owns the order of the steps and the judgement of the proof. It depends on
nothing that a driver believes, uses short time-outs of its own, tries every
step whatever became of the one before, may be run twice, and never raises.
The order is derived from the manuals and is UNVERIFIED on an oscilloscope.
"""

from __future__ import annotations

from collections.abc import Callable

from daq.analyser import SourceState
from daq.driving.replies import parse_integer, parse_number, parse_string
from daq.driving.safe_off import Attempt, SafeOff, Step
from daq.driving.scpi_connection import Dialogue
from daq.errors import LashbenchError
from daq.hp35670a.settings import LEVEL
from daq.transports.base import Transport

__all__ = ["SafeOff", "Step", "make_safe", "read_source"]

_RESET_S = 5.0
_BUDGET_S = 12.0
"""Once this is spent every further question gets next to no time; every step is still tried."""
_RAMP_MARGIN_S = 0.1
_LONGEST_RAMP_S = 10.0
_HIGHEST_VPK = LEVEL.high


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
    attempt = Attempt(Dialogue(transport), told, _BUDGET_S)
    _go_quiet(attempt)
    proven = _proof(attempt)
    if not attempt.answered:
        attempt.send("*RST")  # it cannot be asked, but it may hear
    elif not proven:
        attempt.act("*RST", lambda: _reset(attempt))
        proven = _proof(attempt)
    if attempt.answered:
        attempt.act("SYST:ERR?", lambda: _drained(attempt))
    return attempt.result(proven)


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


def _go_quiet(attempt: Attempt[Dialogue]) -> None:
    """Steps 1 to 8: stop, lower what drives in this mode, fall back to FFT mode, switch off."""
    attempt.act("device clear", lambda: _cleared(attempt))
    attempt.send("ABOR")
    attempt.send("INIT:CONT OFF")
    attempt.send("SOUR:VOLT 0 VPK")
    attempt.send("SOUR:VOLT:OFFS 0 V")
    attempt.act("wait for the ramp", lambda: _ramp(attempt), asks=True)
    attempt.send("INST:SEL FFT")
    attempt.send("SOUR:VOLT 0 VPK")
    attempt.send("SOUR:VOLT:OFFS 0 V")
    attempt.send("OUTP OFF")


def _cleared(attempt: Attempt[Dialogue]) -> str:
    attempt.dialogue.clear()
    return "done"


def _ramp(attempt: Attempt[Dialogue]) -> str:
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
    return attempt.pause(wait_s)


def _proof(attempt: Attempt[Dialogue]) -> bool:
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


def _reset(attempt: Attempt[Dialogue]) -> str:
    """Fallback: the presets are FFT mode, output off, level and offset 0."""
    dialogue = attempt.dialogue
    dialogue.send("*RST")
    # A query that waits is the synchronisation here: `*OPC` would need polling, and this
    # path must stay short.
    dialogue.ask("INST:SEL?", attempt.bound(_RESET_S))
    dialogue.send("OUTP OFF")
    return "done"


def _drained(attempt: Attempt[Dialogue]) -> str:
    return ", ".join(str(entry) for entry in attempt.dialogue.drain()) or "empty"
