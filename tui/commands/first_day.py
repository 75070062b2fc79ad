"""``lashbench first-day``: what a driver assumes, looked at on a real instrument.

Owns the options of the verb, the questions to the person at the bench and the two files that it
writes. The checks are the drivers'; that the source ends off is `daq.driving.first_day`'s.
"""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from daq.errors import InputError, LimitError, MeasurementError
from tui.options import Json, Real, UnitName
from tui.text.output import Console, Injected

if TYPE_CHECKING:
    from daq.analyser import Identity
    from daq.driving.first_day import Finding, FirstDay

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
    see; without a terminal those questions stay open. The report can be sent to the maintainers:
    it holds the instrument's identity, address and answers, and nothing else.

    Parameters
    ----------
    out
        Folder for transcript.jsonl and report.md; made if it is not there.
    level
        Highest level driven, V peak; 1 at most.
    unit
        What is behind a simulated instrument; a real one needs none.
    yes
        Drive hardware without asking; needed where there is no terminal.
    """
    from daq.drivers import driver_at, is_simulated, parse_instrument

    if not 0.0 < level <= _HIGHEST_VPK:
        raise LimitError(f"--level {level:g} V peak must be above 0 and at most {_HIGHEST_VPK:g}")
    parse_instrument(instrument)
    driver, _ = driver_at(instrument)
    if driver.first_day is None:
        raise InputError(f"{instrument}: there are no first-day checks for {driver.name}")
    transcript, report = out / "transcript.jsonl", out / "report.md"
    for file in (transcript, report):
        if file.exists():
            raise InputError(f"{file} is there already; give another folder with --out")
    is_real = not is_simulated(instrument)
    if is_real:
        _confirm(instrument, level, yes)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{out}: cannot be made ({error.strerror})") from error
    with ExitStack() as stack:
        findings, document = _looked_at(
            instrument, unit, level, out, transcript, report, is_real, console, stack
        )
    for finding in findings:
        if not json:
            console.data(f"{finding.verdict:14}  {finding.name}: {finding.seen}")
    if json:
        console.document(document)
    else:
        console.data(f"\n{report} and {transcript} are written")
    return 1 if any(finding.verdict == "failed" for finding in findings) else 0


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


def _look(question: str) -> bool | None:
    """Ask the person at the bench; None without a terminal, or without an answer."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return None
    print(f"{question} [y/n, Enter: not seen] ", end="", file=sys.stderr, flush=True)  # noqa: T201
    answer = sys.stdin.readline().strip().lower()
    return {"y": True, "yes": True, "n": False, "no": False}.get(answer)


def _looked_at(
    url: str,
    unit: str,
    level: float,
    out: Path,
    transcript: Path,
    report: Path,
    is_real: bool,
    console: Console,
    stack: ExitStack,
) -> tuple[list[Finding], dict[str, object]]:
    from dataclasses import asdict

    from daq.analyser import SourceState
    from daq.driving import first_day as checks
    from daq.driving.first_day import FirstDay
    from daq.formats.atomic import write_text
    from daq.session.bench_lock import BenchLock
    from daq.session.watchdog import Watchdog
    from sim.unit import load_unit
    from tui.bench import connect_wire

    watchdog: Watchdog | None = None
    history = out / "first-day.db"
    if is_real:
        lock = stack.enter_context(BenchLock(history, instrument=url))
        watchdog = Watchdog(url, history, lock.descriptor)
    driver, transport = connect_wire(url, load_unit(unit), transcript)
    analyser = driver.drive(transport)
    stack.callback(analyser.close)
    day = FirstDay(analyser, transport, level, _look)
    findings: list[Finding] = []
    state = SourceState.UNKNOWN
    fault: BaseException | None = None
    try:
        if watchdog is not None:
            watchdog.stand_by(lambda: None)
            day.on_exchange = analyser.on_exchange = watchdog.beat
        assert driver.first_day is not None
        for finding in checks.run(day, driver.first_day()):
            console.note(f"  {finding.verdict}: {finding.name}")
            findings.append(finding)
    except BaseException as error:
        fault = error
        raise
    finally:
        state = analyser.make_safe()
        if watchdog is not None:
            if state is SourceState.CONFIRMED_OFF:
                watchdog.dismiss()
            else:
                watchdog.leave()
        text = checks.report(_identity(day), url, findings, state, transcript.name)
        if fault is not None:
            text += f"\nIt ended early: {' '.join(str(fault).split())}\n"
        write_text(report, text)
    if state is not SourceState.CONFIRMED_OFF:
        raise MeasurementError(f"SOURCE OFF {state.value.upper()}: switch it off by hand")
    return findings, {
        "report": str(report),
        "transcript": str(transcript),
        "source_state": state.value,
        "findings": [asdict(finding) for finding in findings],
    }


def _identity(day: FirstDay) -> Identity | None:
    from daq.analyser import Identity as Known

    found = day.kept.get("identity")
    return found if isinstance(found, Known) else None
