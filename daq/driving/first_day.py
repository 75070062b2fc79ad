"""The first day with a real instrument: checks of what a driver assumes, and what came of each.

Owns the order of a run: the source is proven off before the first check, after each that drives,
and in the end. What is checked is each driver's matter. It talks to no person.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal

from daq.analyser import Analyser, Identity, SourceState
from daq.errors import LashbenchError, MeasurementError
from daq.transports.base import Transport

__all__ = ["Check", "Finding", "FirstDay", "Verdict", "report", "run"]

Verdict = Literal["holds", "differs", "not looked at", "failed"]


@dataclass(frozen=True, slots=True)
class Finding:
    """What came of one check."""

    name: str
    assumed: str
    """What the driver assumes."""
    where: str
    """The module to change if it differs."""
    verdict: Verdict
    seen: str


@dataclass(slots=True)
class FirstDay:
    """What a check has to work with.

    Parameters
    ----------
    analyser, transport
        The driver, and the wire below it for questions of the instrument's own language.
    level_vpk
        The highest level that a check may drive with, V peak.
    look
        Asks the person at the bench a question; True, False, or None where nobody looks.
    on_exchange
        Told before each exchange how long it may take, s.
    """

    analyser: Analyser
    transport: Transport
    level_vpk: float
    look: Callable[[str], bool | None]
    on_exchange: Callable[[float], None] | None = None
    kept: dict[str, object] = field(default_factory=dict)
    """What one check leaves for another."""


@dataclass(frozen=True, slots=True)
class Check:
    """One assumption, and how it is looked at.

    `run` gives whether it holds, None where nobody could see it, and what was seen.
    """

    name: str
    assumed: str
    where: str
    run: Callable[[FirstDay], tuple[bool | None, str]]
    drives: bool = False


def run(day: FirstDay, checks: Sequence[Check]) -> Iterator[Finding]:
    """Look at one assumption after the other, yielding what came of each.

    Raises
    ------
    MeasurementError
        If the source cannot be proven off between two checks: nothing more is driven.
    LashbenchError
        If the instrument is not the one that the driver drives.
    """
    _prove_off(day)
    for check in checks:
        try:
            holds, seen = check.run(day)
            verdict: Verdict = "holds" if holds else "differs"
            if holds is None:
                verdict = "not looked at"
        except LashbenchError as error:
            verdict, seen = "failed", str(error)
        yield Finding(check.name, check.assumed, check.where, verdict, seen)
        if check.drives or verdict == "failed":
            _prove_off(day)
    _prove_off(day)


def _prove_off(day: FirstDay) -> None:
    state = day.analyser.make_safe()
    if state is not SourceState.CONFIRMED_OFF:
        raise MeasurementError(
            f"the source is {state.value} after the safe-off recipe; nothing more is driven: "
            "switch it off by hand"
        )


def report(
    identity: Identity | None, url: str, findings: Sequence[Finding], state: SourceState, more: str
) -> str:
    """The report as Markdown, to be read and to be sent."""
    who = "nobody answered"
    if identity is not None:
        options = ", ".join(identity.options) or "none"
        who = (
            f"{identity.maker} {identity.model}, serial {identity.serial}, revision "
            f"{identity.revision}, options {options}"
            + (" (SIMULATED)" if identity.simulated else "")
        )
    counts = {
        verdict: sum(finding.verdict == verdict for finding in findings)
        for verdict in ("holds", "differs", "failed", "not looked at")
    }
    lines = [
        "# First day", "", f"- instrument: {who}", f"- address: {url}",
        f"- source in the end: {state.value}",
        "- " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()),
        f"- transcript: {more}", "",
        "| check | verdict | assumed | seen | where |", "| --- | --- | --- | --- | --- |",
    ]  # fmt: skip
    for finding in findings:
        cells = (finding.name, f"**{finding.verdict}**", finding.assumed, finding.seen,
                 f"`{finding.where}`")  # fmt: skip
        lines.append("| " + " | ".join(" ".join(c.split()).replace("|", "/") for c in cells) + " |")
    return "\n".join([*lines, ""])
