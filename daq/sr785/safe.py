"""The safe-off recipe of the SR785: the source off in every group, and proven off.

Owns the order of the steps and the judgement of the proof. It depends on nothing that a driver
believes, uses short time-outs of its own, tries every step whatever became of the one before, may
be run twice, and never raises. Its order is derived from the manual and is UNVERIFIED on an
oscilloscope.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from daq.analyser import SourceState
from daq.driving.replies import parse_integer, parse_number
from daq.driving.safe_off import Attempt, SafeOff, Step
from daq.errors import LashbenchError
from daq.sr785.dialogue import Dialogue
from daq.sr785.levels import is_zero
from daq.transports.base import Transport

__all__ = ["make_safe", "read_source"]

_BUDGET_S = 14.0
"""Once this is spent every further question gets next to no time; every step is still tried."""
_RESET_S = 14.0
"""``*RST`` keeps the instrument from answering for 12 s."""
_RESET_LOOK_S = 1.0
_HIGHEST_V = 5.0
_RAMP_MARGIN_S = 0.1
_LONGEST_RAMP_S = 10.0
_ZERO = ("SSAL 0", "SSAM 0 mV", "S1AM 0 mV", "S2AM 0 mV", "SOFF 0 mV")


def make_safe(
    transport: Transport, told: Callable[[float], None] | None = None, interface: int | None = None
) -> SafeOff:
    """Switch the source off whatever the instrument is doing, and say what could be proven.

    Parameters
    ----------
    told
        Told before each exchange how long it may take at most, s; must not raise.
    interface
        Where replies are to go; found out from the transport if left out.

    Returns
    -------
    SafeOff
        ``confirmed-off`` only if switch, levels, offset and group read back as they should;
        ``unconfirmed`` if the instrument answers but they do not; ``unknown`` if it cannot be
        asked.
    """
    attempt = Attempt(Dialogue(transport, interface=interface), told, _BUDGET_S)
    attempt.act("device clear", lambda: attempt.dialogue.recover() or "done", asks=True)
    _go_quiet(attempt)
    proven = _proof(attempt)
    if not attempt.answered:
        attempt.send("*RST")  # it cannot be asked, but it may hear
    elif not proven:
        attempt.act("*RST", lambda: _reset(attempt))
        _go_quiet(attempt)
        proven = _proof(attempt)
    if attempt.answered:
        attempt.ask("*ESR?")
    return attempt.result(proven)


def read_source(dialogue: Dialogue) -> SourceState:
    """What a read-back says of the source, nothing being changed."""
    try:
        dialogue.send(f"OUTX {dialogue.interface}")
        if dialogue.ask_integer("SRCO?") != 0:
            return SourceState.ON
        if dialogue.ask_integer("MGRP? 0") == 0:
            # The manual: the output is held at 0 V, whatever the levels of the sines are.
            return SourceState.CONFIRMED_OFF
        quiet = is_zero(dialogue.ask("SSAM?")) and dialogue.ask_number("SOFF?") == 0
    except LashbenchError:
        return SourceState.UNKNOWN
    # Whether the switch alone keeps a swept sine from driving is not known.
    return SourceState.CONFIRMED_OFF if quiet else SourceState.ON


def _go_quiet(attempt: Attempt[Dialogue]) -> None:
    """Off, stopped, levels 0; then to FFT, which must not be entered with the switch on."""
    attempt.send(f"OUTX {attempt.dialogue.interface}")
    attempt.send("SRCO 0")
    attempt.send("PAUS")
    attempt.act("wait for the ramp", lambda: _ramp(attempt), asks=True)
    for line in _ZERO:
        attempt.send(line)
    # Each question also lets the commands before it be worked off: the buffer is short.
    switch = attempt.ask("SRCO?")
    if switch is None or _number(attempt, "SRCO?", switch) != 0:
        return
    for line in ("MGRP 2,0", "STYP 0", *_ZERO[2:]):
        attempt.send(line)
    attempt.ask("SRCO?")
    attempt.send("SRCO 0")


def _ramp(attempt: Attempt[Dialogue]) -> str:
    """Wait until the level has come down; only swept sine ramps."""
    dialogue = attempt.dialogue
    if dialogue.ask_integer("MGRP? 0") == 0:
        return "not in swept sine"
    if dialogue.ask_integer("SRMP?") == 0:
        return "no ramp is set"
    rate = dialogue.ask_number("SRAT?")
    if rate <= 0:
        return "no ramp is set"
    # The level it comes from is not known here, so the highest is taken.
    return attempt.pause(min(_HIGHEST_V / rate + _RAMP_MARGIN_S, _LONGEST_RAMP_S))


def _proof(attempt: Attempt[Dialogue]) -> bool:
    """Every read-back is tried, and each must be right."""
    switch, group, offset = (attempt.ask(line) for line in ("SRCO?", "MGRP? 0", "SOFF?"))
    levels = [attempt.ask(line) for line in ("S1AM?", "S2AM?")]
    try:
        return (
            switch is not None
            and parse_integer(switch) == 0
            and group is not None
            and parse_integer(group) == 0
            and offset is not None
            and parse_number(offset) == 0
            and all(level is not None and is_zero(level) for level in levels)
        )
    except LashbenchError as error:
        attempt.steps.append(Step("proof", str(error), failed=True))
        return False


def _number(attempt: Attempt[Dialogue], what: str, reply: str) -> int | None:
    try:
        return parse_integer(reply)
    except LashbenchError as error:
        attempt.steps.append(Step(what, str(error), failed=True))
        return None


def _reset(attempt: Attempt[Dialogue]) -> str:
    """Fallback; what a reset leaves on is switched off after it."""
    dialogue = attempt.dialogue
    dialogue.send("*RST")
    until_s = time.monotonic() + _RESET_S
    while True:
        try:
            dialogue.send(f"OUTX {dialogue.interface}")
            dialogue.ask("*ESR?", _RESET_LOOK_S)
        except LashbenchError:
            if time.monotonic() > until_s:
                raise
        else:
            return "done"
