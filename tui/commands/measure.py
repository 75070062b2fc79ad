"""``lashbench measure``: a bench session without a screen.

Owns the options of the verb, what a person is told while it runs, and its
exit code. The session itself, and that it ends safe, is the engine's.
"""

from __future__ import annotations

import math
import sys
from contextlib import closing, suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from daq.errors import InputError, LashbenchError, MeasurementError
from tui.entry import INTERRUPTED
from tui.measure_options import PlanOptions, read_band, session_request
from tui.options import Json, Real, UnitName, Whole
from tui.places import history_path
from tui.text.output import Console, Injected, readers_may_leave
from tui.text.shell_quote import pasted
from tui.unit_under_test import read_unit

if TYPE_CHECKING:
    from daq.session_events import Finished, SessionEvent
    from daq.session_request import SessionRequest
    from sim.unit import Unit

__all__ = ["measure"]


def measure(
    *,
    unit: UnitName,
    instrument: Annotated[str, Parameter(help="URL: sim:, prologix:DEVICE, TCPIP::..., ...")],
    level: list[Real] | None = None,
    start: Real | None = None,
    stop: Real | None = None,
    points: Whole | None = None,
    spacing: Literal["lin", "log"] | None = None,
    direction: Literal["up", "down"] | None = None,
    settle_cycles: Whole | None = None,
    integrate_cycles: Whole | None = None,
    offset: Real | None = None,
    recipe: str | None = None,
    bench: str = "default",
    adaptive: bool = False,
    db: Path | None = None,
    resume: Whole | None = None,
    remeasure: str | None = None,
    run_in: Whole | None = None,
    serial: str = "",
    operator: str = "",
    notes: str = "",
    transcript: Path | None = None,
    dry_run: bool = False,
    yes: bool = False,
    json: Json = False,
    console: Injected,
) -> int:
    """Measure a unit's frequency response and keep it in the bench's history.

    Checks first (limits, identity, source off, a gentle trial point), then
    sweeps; each point is on disk before it is shown. Ctrl-C ends it with the
    source off, and --resume goes on later.

    Parameters
    ----------
    level
        Source level in V peak; repeat it for several.
    start
        Lowest frequency in Hz.
    stop
        Highest frequency in Hz.
    points
        Number of frequencies at each level.
    spacing
        Linear or logarithmic grid; linear if left out.
    direction
        Order in which the frequencies are visited; up if left out.
    settle_cycles
        Drive cycles waited at each point; 20 if left out.
    integrate_cycles
        Drive cycles averaged at each point; 30 if left out.
    offset
        Constant voltage added to the source, in V.
    recipe
        Sweep recipe, by name or path: values for what is left out above, and limits.
    bench
        Bench file, by name or path: limits, slew, input ranges.
    adaptive
        Go on around anti-resonance and resonance until they are known well.
    db
        File of the bench's history, made if it is not there; yours, if left out.
    resume
        Measurement to go on with, by its identifier.
    remeasure
        Band LOW:HIGH in Hz to measure again, with --resume; the old points are kept.
    run_in
        Points driven again, unrecorded, before a level goes on in its middle;
        all of that level if left out, since a servo with play has branches
        that only an unbroken sweep stays on.
    serial
        Serial number of the unit under test.
    operator
        Who measures.
    notes
        Anything to be remembered.
    transcript
        New file that records the dialogue; --instrument replay:FILE runs it again.
    dry_run
        Say what would be measured and how long it would take; send nothing.
    yes
        Drive hardware without asking; needed where there is no terminal.
    """
    options = PlanOptions(
        tuple(level or ()), start, stop, points, spacing, direction,
        settle_cycles, integrate_cycles, offset, adaptive,
    )  # fmt: skip
    subject = read_unit(unit, console)
    is_given, db = db is not None, history_path(db, create=not dry_run)
    request = session_request(
        options, unit, subject, instrument, db,
        recipe=recipe, bench=bench, resume=resume, remeasure=read_band(remeasure), run_in=run_in,
        remarks={"serial": serial, "operator": operator, "notes": notes},
    )  # fmt: skip
    if dry_run:
        _show_plan(request, db, json, console)
        return 0
    _confirm(instrument, request, db, yes)
    again = ["lashbench", "measure", "--unit", unit, "--instrument", instrument]
    again += ["--db", str(db)] if is_given else []
    # Their limits, slew and ranges hold for what is left, too.
    again += [] if bench == "default" else ["--bench", bench]
    again += [] if recipe is None else ["--recipe", recipe]
    return _run(instrument, subject, db, request, transcript, json, console, pasted(again))


def _show_plan(request: SessionRequest, db: Path, json: bool, console: Console) -> None:
    from daq.limits import tightest
    from tui.measure_options import plan_of

    plan, bounds = plan_of(request, db), tightest(request.limits)
    if json:
        content = {"plan": asdict(plan), "points": plan.points, "duration_s": plan.duration_s}
        console.document(content | {"limits": asdict(bounds)})
        return
    lowest, highest = min(plan.frequencies_hz), max(plan.frequencies_hz)
    console.data(
        f"{plan.points} points: {len(plan.frequencies_hz)} from {lowest:g} to {highest:g} Hz, "
        f"{plan.direction}, at {', '.join(f'{v:g}' for v in plan.levels_vpk)} V peak\n"
        f"{plan.settle_cycles} settle and {plan.integrate_cycles} integrate cycles a point: "
        f"{plan.duration_s:.0f} s of driving, and what the instrument takes besides\n"
        f"limits of {bounds.set_by}: {bounds.source_vpk:g} V peak, "
        f"{bounds.start_hz:g} to {bounds.stop_hz:g} Hz, {bounds.duration_s:g} s"
    )


def _confirm(instrument: str, request: SessionRequest, db: Path, yes: bool) -> None:
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


def _run(
    instrument: str,
    unit: Unit,
    db: Path,
    request: SessionRequest,
    transcript: Path | None,
    json: bool,
    console: Console,
    again: str,
) -> int:
    from daq.control import SessionControl
    from daq.session_events import Finished
    from tui.bench import bench_session
    from tui.signals import listening

    control, finished = SessionControl(), None
    with (
        listening(control, console.note),
        closing(bench_session(instrument, unit, db, request, control, transcript)) as events,
    ):
        try:
            with console.unhurried():
                for event in events:
                    # Whoever listened may have left; the measurement goes on without.
                    with suppress(BrokenPipeError):
                        _tell(event, console)
                    if isinstance(event, Finished):
                        finished = event
        except Exception as error:
            if finished is None:
                raise
            _report(finished, json, console, again)
            raise _complete(error, finished) from error
    if finished is None:
        raise MeasurementError("the session ended without a word; this is a fault of lashbench")
    _report(finished, json, console, again)
    return _exit_code(finished)


def _tell(event: SessionEvent, console: Console) -> None:
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


def _report(finished: Finished, json: bool, console: Console, again: str) -> None:
    """Say how it ended; who reads no more must not keep the error and the exit code back."""
    with readers_may_leave():
        _say_how_it_ended(finished, json, console, again)


def _say_how_it_ended(finished: Finished, json: bool, console: Console, again: str) -> None:
    if json:
        console.document(
            {
                "id": finished.measurement,
                "points": finished.points,
                "flagged": finished.flagged,
                "source_state": _contract_state(finished),
                "elapsed_s": finished.elapsed_s,
                "state": finished.state,
                "reason": finished.reason,
            }
        )
        return
    console.data(
        f"measurement {finished.measurement}: {finished.state}, {finished.points} points, "
        f"{finished.flagged} flagged; source {finished.source_state.value}; "
        f"{finished.elapsed_s:.1f} s"
    )
    if finished.state == "interrupted":
        console.note(f"go on with: {again} --resume {finished.measurement}")


def _contract_state(finished: Finished) -> str:
    # A source that reads back as driving after the recipe is not off, whatever was sent.
    state = finished.source_state.value
    return "unconfirmed" if state == "on" else state


def _complete(error: Exception, finished: Finished) -> LashbenchError:
    """The error, with the loud words where the source was not proven off."""
    if not isinstance(error, LashbenchError):
        error = MeasurementError(f"internal error: {type(error).__name__}: {error}")
    state = _contract_state(finished)
    kept = f"{finished.points} point{'' if finished.points == 1 else 's'} kept"
    if state == "confirmed-off":
        return type(error)(f"{error}; {kept}, source confirmed off")
    return type(error)(f"{error}; {kept}; SOURCE OFF {state.upper()}: switch it off by hand")


def _exit_code(finished: Finished) -> int:
    state = _contract_state(finished)
    if state != "confirmed-off":
        raise MeasurementError(f"SOURCE OFF {state.upper()}: switch it off by hand")
    return 0 if finished.state == "complete" else INTERRUPTED
