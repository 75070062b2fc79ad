"""The first day with a real instrument: checks of what a driver assumes, and what came of each.

Owns the order of a run: the source is proven off before the first check, after each that drives,
and in the end; one that is seen to drive when it should be at rest ends the run. What is checked
is each driver's matter. It talks to no person.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal

from daq.analyser import Analyser, Identity, SourceState
from daq.errors import LashbenchError, LinkError, MeasurementError, ProtocolError
from daq.transports.base import Transport

__all__ = [
    "WORDS", "Check", "Finding", "FirstDay", "NoAnswer", "NotAtRest", "Verdict", "at_rest",
    "report", "run",
]  # fmt: skip

Verdict = Literal["holds", "differs", "not looked at", "failed"]
WORDS = {True: "yes", False: "no", None: "not watched"}
"""Answers of a person, in words."""


class NotAtRest(MeasurementError):
    """The source was seen to drive when it should be at rest: nothing more is driven."""


class NoAnswer(Exception):
    """Nobody answered a question while the source drove; `run` catches it and makes safe."""


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
        Asks the person at the bench a question, and is told whether the source may drive until
        the answer; True, False, or None where nobody looks. May raise `NoAnswer`.
    make_safe
        Runs the safe-off recipe to its end; never raises.
    listen
        Called before each check; raises where the run is to end.
    """

    analyser: Analyser
    transport: Transport
    level_vpk: float
    look: Callable[[str, bool], bool | None]
    make_safe: Callable[[], SourceState]
    listen: Callable[[], None]
    kept: dict[str, object] = field(default_factory=dict)
    """What one check leaves for another."""

    def drives(self, moment: str) -> bool | None:
        """Ask whether the source drives, at a moment when it may."""
        return self.look(f"{moment}: does the source drive?", True)


@dataclass(frozen=True, slots=True)
class Check:
    """One assumption, and how it is looked at.

    `run` gives whether it holds, None where nobody could see it, and what was seen. One that sets
    a level above 0 `drives`.
    """

    name: str
    assumed: str
    where: str
    run: Callable[[FirstDay], tuple[bool | None, str]]
    drives: bool = False


def at_rest(day: FirstDay) -> tuple[bool | None, str]:
    """Run the safe-off recipe, and ask the person at the bench whether the source is at rest.

    Raises
    ------
    MeasurementError
        If the read-back does not prove it off.
    NotAtRest
        If the person says that it is not.
    """
    state = day.make_safe()
    steps = str(getattr(day.analyser, "safe_off", None) or f"source {state.value}")
    if state is not SourceState.CONFIRMED_OFF:
        raise MeasurementError(f"after the safe-off recipe: {steps}")
    seen = day.look("after the safe-off recipe: is the source at rest?", False)
    if seen is False:
        raise NotAtRest(
            f"instrument and person disagree: it reads back {state.value}, the person at the bench "
            "sees the source drive"
        )
    return seen, f"read back: {steps}; at rest on the oscilloscope: {WORDS[seen]}"


def run(day: FirstDay, checks: Sequence[Check]) -> Iterator[Finding]:
    """Look at one assumption after the other, yielding what came of each.

    Raises
    ------
    NotAtRest
        After the finding: if the source was seen to drive when it should be at rest.
    LinkError
        After the finding: if the connection was lost.
    LashbenchError
        If the source cannot be proven off, of the kind of the fault before; if the instrument is
        not the one that the driver drives. Nothing more is driven then.
    """
    day.kept["identity"] = day.analyser.identify()
    _prove_off(day, None)
    for check in checks:
        day.listen()
        fault: LashbenchError | None = None
        verdict: Verdict
        try:
            holds, seen = check.run(day)
            verdict = "not looked at" if holds is None else "holds" if holds else "differs"
        except NoAnswer as silence:
            verdict, seen, fault = "not looked at", str(silence), None
        except NotAtRest as error:
            verdict, seen, fault = "differs", str(error), error
        except LashbenchError as error:
            verdict, seen, fault = "failed", str(error), error
        # Before anybody is told, so that the source is off while they read.
        if check.drives or fault is not None:
            try:
                _prove_off(day, fault)
            except LashbenchError:
                yield Finding(check.name, check.assumed, check.where, verdict, seen)
                raise
        yield Finding(check.name, check.assumed, check.where, verdict, seen)
        if fault is not None and _ends_the_day(fault):
            raise fault
    _prove_off(day, None)


def _ends_the_day(fault: LashbenchError) -> bool:
    is_lost = isinstance(fault, LinkError) and not isinstance(fault, ProtocolError)
    return is_lost or isinstance(fault, NotAtRest)


def _prove_off(day: FirstDay, fault: LashbenchError | None) -> None:
    state = day.make_safe()
    if state is not SourceState.CONFIRMED_OFF:
        kind = MeasurementError if fault is None else type(fault)
        before = "" if fault is None else f"{fault}; "
        raise kind(
            f"{before}the source is {state.value} after the safe-off recipe; nothing more is driven"
        )


def report(
    url: str,
    identity: Identity | None,
    findings: Sequence[Finding],
    source: str,
    ended: str,
    transcript: str,
) -> str:
    """The report as Markdown, to be read and to be sent.

    Parameters
    ----------
    source
        What is known of the source in the end.
    ended
        How the run ended.
    transcript
        Name of the file with the dialogue.
    """
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
        "# First day", "", f"- source in the end: {source}", f"- ended: {ended}",
        f"- instrument: {who}", f"- address: {url}",
        "- " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()),
        f"- transcript: {transcript}", "",
        "| check | verdict | assumed | seen | where |", "| --- | --- | --- | --- | --- |",
    ]  # fmt: skip
    for finding in findings:
        cells = (finding.name, f"**{finding.verdict}**", finding.assumed, finding.seen,
                 f"`{finding.where}`")  # fmt: skip
        lines.append("| " + " | ".join(" ".join(c.split()).replace("|", "/") for c in cells) + " |")
    return "\n".join([*lines, ""])
