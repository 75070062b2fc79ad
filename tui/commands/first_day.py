"""``lashbench first-day``: what a driver assumes, looked at on a real instrument.

Owns the options of the verb, the leave to drive, how the result is told, and the exit code. The
run is that of `tui.first_day`, the checks are the drivers'.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from daq.errors import InputError, LimitError, MeasurementError
from tui.exit_codes import INTERRUPTED
from tui.options import Json, Real, UnitName
from tui.text.output import Console, Injected, readers_may_leave
from tui.unit_under_test import read_unit

if TYPE_CHECKING:
    from tui.first_day.run import FirstDayRun

__all__ = ["first_day"]

_HIGHEST_VPK = 1.0


def first_day(
    *,
    instrument: Annotated[str, Parameter(help="URL: sim:, prologix:DEVICE, TCPIP::..., ...")],
    out: Path = Path("first-day"),
    level: Real = 0.1,
    unit: UnitName = "adss",
    yes: bool = False,
    json: Json = False,
    console: Injected,
) -> int:
    """Check on a real instrument what its driver assumes; write a transcript and a report.

    With the amplifier disconnected and an oscilloscope on the source. It asks what only you can
    see; without a terminal those questions stay open. If you see the source drive when it should
    be at rest, it ends at once. Ctrl-C ends it with the source off. The report is written as it
    goes and can be sent to the maintainers: it holds the instrument's identity, address and
    answers, and nothing else.

    Parameters
    ----------
    out
        Folder for transcript.jsonl and report.md; made if it is not there. One that holds an
        earlier report is refused.
    level
        Highest level driven, V peak; 1 at most.
    unit
        What is behind a simulated instrument; a real one needs none.
    yes
        Drive hardware without asking; needed where there is no terminal.
    """
    from daq.drivers import driver_at, is_simulated, parse_instrument
    from tui.first_day.folder import Folder
    from tui.first_day.run import FirstDayRun

    if not 0.0 < level <= _HIGHEST_VPK:
        raise LimitError(f"--level {level:g} V peak must be above 0 and at most {_HIGHEST_VPK:g}")
    parse_instrument(instrument)
    driver, _ = driver_at(instrument)
    if driver.first_day is None:
        raise InputError(f"{instrument}: there are no first-day checks for {driver.name}")
    subject = read_unit(unit, console)
    with Folder(out) as folder:
        is_real = not is_simulated(instrument)
        if is_real:
            _confirm(instrument, level, yes)
        run = FirstDayRun(instrument, subject, level, folder, is_real, console)
        run.run()
    with readers_may_leave():
        _tell(run, json, console)
    return _exit_code(run)


def _tell(run: FirstDayRun, json: bool, console: Console) -> None:
    """What came of it, also where it ended early."""
    folder = run.folder
    if json:
        from dataclasses import asdict

        console.document(
            {
                "report": str(folder.report),
                "transcript": str(folder.transcript),
                "ended": run.ended,
                "reason": run.reason,
                "source_state": run.source_state,
                "contradiction": run.contradiction,
                "findings": [asdict(finding) for finding in run.findings],
            }
        )
        return
    for finding in run.findings:
        console.data(f"{finding.verdict:14}  {finding.name}: {finding.seen}")
    console.data(
        f"\n{run.ended}; source {run.source}\nreport {folder.report}, transcript "
        f"{folder.transcript}"
    )


def _exit_code(run: FirstDayRun) -> int:
    """0, 1 or that of an interruption.

    Raises
    ------
    LashbenchError
        With the fault that ended it, and loud where the source is not surely off.
    """
    is_off = run.source_state == "confirmed-off"
    loud = "" if is_off else f"SOURCE OFF {run.source_state.upper()}: switch it off by hand"
    if run.error is not None:
        end = loud or "source confirmed off"
        raise type(run.error)(f"{run.error}; {end}; report {run.folder.report}")
    if loud:
        raise MeasurementError(f"{loud}; report {run.folder.report}")
    if run.ended == "interrupted":
        return INTERRUPTED
    return 1 if any(finding.verdict == "failed" for finding in run.findings) else 0


def _confirm(instrument: str, level: float, yes: bool) -> None:
    if yes:
        return
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise InputError(
            f"{instrument}: the checks drive the source, and there is no terminal to ask at; give "
            "--yes; nothing was sent"
        )
    question = (
        f"is the amplifier disconnected, and may {instrument} drive up to {level:g} V peak? [y/N] "
    )
    print(question, end="", file=sys.stderr, flush=True)  # noqa: T201
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise InputError("not confirmed; nothing was sent")
