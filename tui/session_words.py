"""What is told of a session before, while it runs and at its end, for every verb that measures.

Owns these words, the question before hardware is driven and the exit code. It runs no session.
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

from daq.errors import InputError, Interrupted, LashbenchError, MeasurementError
from daq.servers.place import HistoryPlace
from tui.text.output import Console

if TYPE_CHECKING:
    from daq.session_events import Finished, SessionEvent
    from daq.session_request import SessionRequest

__all__ = ["complete_error", "confirm_driving", "contract_state", "exit_code", "tell_event"]


def confirm_driving(instrument: str, request: SessionRequest, db: HistoryPlace, yes: bool) -> None:
    """Insist on a word before hardware is driven.

    Raises
    ------
    InputError
        If it is not given.
    """
    from tui.bench import drives_hardware
    from tui.measure_options import plan_of

    if not drives_hardware(instrument) or yes:
        return
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise InputError(
            f"{instrument}: measuring would drive the source, and there is no terminal to ask at; "
            "give --yes; nothing was sent"
        )
    plan = plan_of(request, db)
    question = f"drive {instrument} with up to {max(plan.levels_vpk):g} V peak? [y/N] "
    print(question, end="", file=sys.stderr, flush=True)  # noqa: T201
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise InputError("not confirmed; nothing was sent")


def tell_event(event: SessionEvent, console: Console) -> None:
    """Narrate one record; points only where a terminal is watched."""
    from daq import session_events as kinds

    match event:
        case kinds.Opened():
            begun = f", {event.done} of them stored" if event.done else ""
            console.note(
                f"measurement {event.measurement}: {event.total} points{begun}, "
                f"{event.duration_s:.0f} s of driving to come"
            )
        case kinds.CheckLine():
            console.note(f"  {event.verdict:4}  {event.name}: {event.text}")
        case kinds.LevelStarted():
            console.note(f"sweeping {event.points} points at {event.source_vpk:g} V peak")
        case kinds.PointStored():
            point = event.stored.point
            console.progress(
                event.done / event.total,
                f"{event.done}/{event.total}  {point.frequency_hz:.2f} Hz  {_decibels(point.gain)}",
                event.remaining_s,
            )
        case kinds.Paused():
            console.note(f"paused; source {event.source_state.value}")
        case kinds.GoingOn():
            console.note("going on")
        case kinds.Warned():
            console.note(f"warning: {event.text}")
        case kinds.Finished() if event.state != "complete":
            console.note(f"{event.state}: {event.reason}")


def _decibels(gain: complex) -> str:
    return f"{20 * math.log10(abs(gain)):.2f} dB" if abs(gain) > 0 else "no reading"


def contract_state(finished: Finished) -> str:
    """The state of the source in a document: confirmed-off, unconfirmed or unknown."""
    # A source that reads back as driving after the recipe is not off, whatever was sent.
    state = finished.source_state.value
    return "unconfirmed" if state == "on" else state


def complete_error(error: Exception, finished: Finished) -> LashbenchError:
    """The error, with the loud words where the source was not proven off."""
    if not isinstance(error, LashbenchError):
        error = MeasurementError(f"internal error: {type(error).__name__}: {error}")
    state = contract_state(finished)
    kept = f"{finished.points} point{'' if finished.points == 1 else 's'} kept"
    if state == "confirmed-off":
        return type(error)(f"{error}; {kept}, source confirmed off")
    return type(error)(f"{error}; {kept}; SOURCE OFF {state.upper()}: switch it off by hand")


def exit_code(finished: Finished) -> int:
    """0 for a complete measurement, 130 for one that was ended on request.

    Raises
    ------
    MeasurementError
        If the source is not proven off.
    """
    state = contract_state(finished)
    if state != "confirmed-off":
        raise MeasurementError(f"SOURCE OFF {state.upper()}: switch it off by hand")
    return 0 if finished.state == "complete" else Interrupted.exit_code
