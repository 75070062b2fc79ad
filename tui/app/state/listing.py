"""The sessions that the history step lists: their order, and what their limits say of each.

Owns the order and which sessions are not judged yet. It reads no history and draws nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.acceptance import Judgement
    from daq.store_records import HistoryLine
    from tui.judging import InForce

__all__ = ["Listed", "Listing"]

_ORDERS = ("newest first", "r", "b1", "b2", "serial number")
_SORTED_BY = ("id", "contribution_ratio", "b1_deg", "b2_deg", "serial")
"""In the order of the key."""

_AT_ONCE = 3
"""Sessions judged in one go: the first are told while others wait, since a limit of ARF or RF
takes the points of each, half a second."""


@dataclass(frozen=True, slots=True)
class Listed:
    """What was read of a history, oldest first.

    Parameters
    ----------
    lines, rows
        The same sessions, for the judgement and for people.
    trends
        In words.
    limits
        What they are judged by; None where nothing is.
    fault
        Why the limits could not be read.
    """

    lines: Sequence[HistoryLine] = ()
    rows: Sequence[dict[str, Any]] = ()
    trends: Sequence[str] = ()
    limits: InForce | None = None
    fault: str = ""


class Listing:
    """What is listed, in an order."""

    def __init__(self) -> None:
        self.found = Listed()
        self._order = 0
        self._judged: dict[tuple[Any, ...], Judgement] = {}

    @property
    def order(self) -> str:
        """What it is sorted by, in words; empty for the usual order."""
        return _ORDERS[self._order] if self._order else ""

    def turn(self) -> None:
        """Another order."""
        self._order = (self._order + 1) % len(_ORDERS)

    def ordered(self) -> list[dict[str, Any]]:
        """The rows in the order in which they stand; what has no value comes last."""
        key = _SORTED_BY[self._order]
        newest = list(self.found.rows[::-1])

        def value(row: dict[str, Any]) -> float | str | None:
            found = row[key]
            return found["value"] if isinstance(found, dict) else found

        if not self._order:
            return newest
        known = [row for row in newest if value(row) not in (None, "")]
        lacking = [row for row in newest if value(row) in (None, "")]
        return [*sorted(known, key=value), *lacking]  # type: ignore[arg-type]

    def judgement(self, number: int) -> Judgement | None:
        """What the limits say of a session; None where nobody judges, or did not yet."""
        line = next((one for one in self.found.lines if one.id == number), None)
        return None if line is None else self._judged.get(self._key(line))

    def waiting(self) -> list[HistoryLine]:
        """Sessions that are not judged yet, the newest first."""
        limits = self.found.limits
        if limits is None:
            return []
        # A unit's own limits are not those of another.
        due = (line for line in self.found.lines[::-1] if limits.unit in ("", line.unit))
        return [line for line in due if self._key(line) not in self._judged]

    def next_to_judge(self) -> list[HistoryLine]:
        """As many of them as are judged in one go."""
        return self.waiting()[:_AT_ONCE]

    def take(self, judged: Mapping[int, Judgement]) -> None:
        """Remember judgements, by the number of the session."""
        lines = {line.id: line for line in self.found.lines}
        self._judged |= {self._key(lines[n]): one for n, one in judged.items() if n in lines}

    def _key(self, line: HistoryLine) -> tuple[Any, ...]:
        """What a judgement is of: it holds while nothing of this is another."""
        limits = self.found.limits
        made = [one and (one.made, one.edition) for one in (line.estimate, line.diagnosis)]
        digest = "" if limits is None else limits.limits.digest
        return (line.id, digest, line.state, line.points, *made)
