"""What one check found, and how a check that breaks becomes a finding too.

Owns the noun and its three states. It looks at nothing itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

__all__ = ["Check", "Finding", "State", "examine", "failed", "noted", "passed"]

State = Literal["ok", "note", "failed"]


@dataclass(frozen=True, slots=True)
class Finding:
    """What a check found.

    Parameters
    ----------
    name
        What was looked at.
    state
        "ok"; "note" where something that not everybody needs is missing;
        "failed" where lashbench cannot do its work.
    found
        What is there, in words.
    remedy
        What to do; never empty unless all is well.
    """

    name: str
    state: State
    found: str
    remedy: str = ""

    def __post_init__(self) -> None:
        if self.state != "ok" and not self.remedy:
            raise ValueError(f"{self.name}: a finding that is not ok must say what to do")


Check = Callable[[], Iterable[Finding]]
"""Looks at one thing and says what it found, in one line or several."""


def passed(name: str, found: str) -> Finding:
    """All is well."""
    return Finding(name, "ok", found)


def noted(name: str, found: str, remedy: str) -> Finding:
    """Something is missing that not everybody needs."""
    return Finding(name, "note", found, remedy)


def failed(name: str, found: str, remedy: str) -> Finding:
    """Something is missing that lashbench needs."""
    return Finding(name, "failed", found, remedy)


def examine(checks: Iterable[tuple[str, Check]]) -> Iterator[Finding]:
    """Run named checks in order; one that breaks is a failure of its own."""
    for name, check in checks:
        try:
            yield from check()
        # Whatever is wrong with a machine, a doctor has to survive it and go on.
        except Exception as error:
            said = " ".join(str(error).split()) or "no message"
            yield failed(
                name,
                f"the check itself broke: {type(error).__name__}: {said}",
                "run lashbench --debug doctor and report what it says",
            )
