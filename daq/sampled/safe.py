"""The safe-off recipe of a sampled bench: no recording, no level, no offset, and the proof.

Owns its steps. It depends on nothing that the driver believes, and never raises.
"""

from __future__ import annotations

from collections.abc import Callable

from daq.driving.replies import parse_number
from daq.driving.safe_off import Attempt, SafeOff
from daq.driving.scpi_connection import Dialogue
from daq.errors import LashbenchError
from daq.transports.base import Transport

__all__ = ["make_safe"]

_BUDGET_S = 12.0


def make_safe(transport: Transport, told: Callable[[float], None] | None) -> SafeOff:
    """Give up recordings, ramp to nothing, and prove that the output is at rest."""
    attempt = Attempt(Dialogue(transport), told, _BUDGET_S)

    def cleared() -> str:
        attempt.dialogue.clear()
        return "done"

    def at_rest() -> str:
        for _ in range(100):
            reply = attempt.dialogue.ask("SOUR:NOW?")
            if all(parse_number(part) == 0 for part in reply.split(",")):
                return reply
            attempt.pause(0.1)
        return reply

    attempt.act("device clear", cleared)
    for line in ("ACQ:HALT", "SOUR:VOLT 0", "SOUR:OFFS 0"):
        attempt.send(line)
    attempt.act("wait for the ramp", at_rest, asks=True)
    proven = _is_at_rest(attempt)
    if not proven:
        attempt.send("*RST")
        proven = _is_at_rest(attempt)
    return attempt.result(proven)


def _is_at_rest(attempt: Attempt[Dialogue]) -> bool:
    replies = [attempt.ask(line) for line in ("SOUR:NOW?", "SOUR:VOLT?", "SOUR:OFFS?")]
    try:
        return all(
            reply is not None and all(parse_number(part) == 0 for part in reply.split(","))
            for reply in replies
        )
    except LashbenchError:
        return False
