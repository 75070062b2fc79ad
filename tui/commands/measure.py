"""``lashbench measure``: a bench session without a screen.

Owns the options of the verb, what a person is told while it runs, and its
exit code. The session itself, and that it ends safe, is the engine's.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from daq.servers.place import HistoryPlace
from tui.judging import judgement_lines, limits_to_judge_by
from tui.measure_options import PlanOptions, read_band, session_request
from tui.measurements.running import run_session
from tui.options import HistoryOption, Json, JudgeBy, Real, UnitName, Whole
from tui.places import history_path
from tui.session_words import confirm_driving, contract_state, exit_code, tell_event
from tui.text.output import Console, Injected, readers_may_leave
from tui.text.shell_quote import pasted
from tui.unit_under_test import read_unit

if TYPE_CHECKING:
    from analysis.acceptance import Judgement, LimitSet
    from daq.session_events import Finished
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
    db: HistoryOption = None,
    resume: Whole | None = None,
    remeasure: str | None = None,
    run_in: Whole | None = None,
    serial: str = "",
    operator: str = "",
    notes: str = "",
    transcript: Path | None = None,
    dry_run: bool = False,
    yes: bool = False,
    judge: JudgeBy = None,
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
        The bench's history, a file or postgresql://USER@HOST/DATABASE; yours, if left out.
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
    subject, limits = read_unit(unit, console), limits_to_judge_by(judge)
    is_given, db = db is not None, history_path(db, create=not dry_run)
    request = session_request(
        options, unit, subject, instrument, db,
        recipe=recipe, bench=bench, resume=resume, remeasure=read_band(remeasure), run_in=run_in,
        remarks={"serial": serial, "operator": operator, "notes": notes},
    )  # fmt: skip
    if dry_run:
        _show_plan(request, db, json, console)
        return 0
    confirm_driving(instrument, request, db, yes)
    again = ["lashbench", "measure", "--unit", unit, "--instrument", instrument]
    again += ["--db", str(db)] if is_given else []
    # Their limits, slew and ranges hold for what is left, too.
    again += [] if bench == "default" else ["--bench", bench]
    again += [] if recipe is None else ["--recipe", recipe]
    again += [] if judge is None else ["--judge", judge]
    told = _Told(db, limits, json, console, pasted(again))
    return _run(instrument, subject, request, transcript, told)


@dataclass(frozen=True, slots=True)
class _Told:
    """Where a measurement is kept, what it is judged by, and how its end is told."""

    db: HistoryPlace
    limits: LimitSet | None
    json: bool
    console: Console
    again: str


def _show_plan(request: SessionRequest, db: HistoryPlace, json: bool, console: Console) -> None:
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


def _run(
    instrument: str,
    unit: Unit,
    request: SessionRequest,
    transcript: Path | None,
    told: _Told,
) -> int:
    finished, fault = run_session(
        instrument, unit, told.db, request, told.console, tell_event, transcript
    )
    if fault is not None:
        _report(finished, told)
        raise fault
    if told.limits is None or finished.state != "complete":
        _report(finished, told)
        return exit_code(finished)
    return _judged(finished, told, told.limits)


def _judged(finished: Finished, told: _Told, limits: LimitSet) -> int:
    """Judge what was measured; a judgement that cannot be made does not cost its report."""
    from tui.measurements.judging import judge_measurement

    try:
        judgement = judge_measurement(
            told.db, finished.measurement, limits, progress=told.console.progress
        )
    except BaseException:
        _report(finished, told)
        raise
    _report(finished, told, judgement)
    # A source that is not proven off comes first.
    return exit_code(finished) or judgement.exit_code


def _report(finished: Finished, told: _Told, judgement: Judgement | None = None) -> None:
    """Say how it ended; who reads no more must not keep the error and the exit code back."""
    with readers_may_leave():
        _say_how_it_ended(finished, told, judgement)


def _say_how_it_ended(finished: Finished, told: _Told, judgement: Judgement | None) -> None:
    console = told.console
    judged = {} if judgement is None else {"judgement": judgement.to_json()}
    if told.json:
        console.document(
            judged
            | {
                "id": finished.measurement,
                "points": finished.points,
                "flagged": finished.flagged,
                "source_state": contract_state(finished),
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
    if judgement is not None:
        console.data("\n".join(judgement_lines(judgement)))
    if finished.state == "interrupted":
        console.note(f"go on with: {told.again} --resume {finished.measurement}")
