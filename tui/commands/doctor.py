"""``lashbench doctor``: whether this installation can do its work, and what to mend.

Owns the order of the checks and how they are told. What is looked at is in
`tui.checkup`; nothing is changed and no instrument is touched.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

from tui.checkup.finding import Check, Finding, examine
from tui.checkup.instruments import check_serial_ports, check_visa
from tui.checkup.self_test import check_itself
from tui.checkup.software import check_engine, check_packages, check_python
from tui.checkup.surroundings import check_folders, check_terminal
from tui.options import Json
from tui.text.output import Console, Injected, readers_may_leave

__all__ = ["CHECKS", "doctor"]

CHECKS: tuple[tuple[str, Check], ...] = (
    ("Python", check_python),
    ("packages", check_packages),
    ("compiled engine", check_engine),
    ("terminal", check_terminal),
    ("folders", check_folders),
    ("serial ports", check_serial_ports),
    ("VISA", check_visa),
    ("self-test", check_itself),
)
"""Every check, in the order in which they are told; later ones lean on earlier ones."""

_MARKS = {"ok": "ok  ", "note": "note", "failed": "FAIL"}


def doctor(*, json: Json = False, console: Injected) -> int:
    """Check Python, packages, terminal, ports and VISA, and measure on the simulator.

    Each line that is not ok says what to do. A note is about something that
    not everybody needs; the exit code is 1 if a line failed.
    """
    findings: list[Finding] = []
    for finding in examine(_announced(console)):
        findings.append(finding)
        if not json:
            # The verdict is on all of it, however much of it is read.
            with readers_may_leave():
                console.data(_line(finding))
    failed = sum(finding.state == "failed" for finding in findings)
    with readers_may_leave():
        if json:
            checks = [asdict(finding) for finding in findings]
            console.document({"ok": not failed, "failed": failed, "checks": checks})
        else:
            console.data(f"\n{failed} to mend" if failed else "\nall that is needed is there")
    return 1 if failed else 0


def _announced(console: Console) -> Iterator[tuple[str, Check]]:
    """The checks, each told before it runs: loading libraries and the self-test take seconds."""
    for place, (name, check) in enumerate(CHECKS):
        console.progress(place / len(CHECKS), name)
        yield name, check


def _line(finding: Finding) -> str:
    line = f"{_MARKS[finding.state]}  {finding.name}: {finding.found}"
    return f"{line}\n      -> {finding.remedy}" if finding.remedy else line
