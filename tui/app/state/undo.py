"""Undoing the last entry: choices of the desk as they were before it.

Owns which entries can be undone: unit, remarks, bench, limits, address, recipe and plan. Nothing
that was measured, stored or driven is ever taken back.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tui.app.state.desk import Desk

__all__ = ["Undo"]

_NAMES = {
    "unit_name": "unit",
    "serial": "serial number",
    "operator": "operator",
    "notes": "notes",
    "bench": "bench file",
    "judge_by": "limits to judge by",
    "recipe_asked": "recipe",
    "url": "address",
    "options": "plan",
    "given_plan": "proposed plan",
    "resume": "measurement to go on with",
}
_TYPED = ("serial", "operator", "notes")
"""What is typed letter by letter: all letters are one entry."""

_MOST = 100


@dataclass(frozen=True, slots=True)
class _Choices:
    """What the operator chose, by the names of the desk."""

    unit_name: str
    unit: Any
    unit_origin: str
    unit_text: str | None
    serial: str
    operator: str
    notes: str
    bench: str
    judge_by: str
    recipe_asked: str | None
    url: str
    options: Any
    given_plan: Any
    follows: int | None
    resume: int | None

    @classmethod
    def of(cls, desk: Desk) -> _Choices:
        return cls(*(getattr(desk, one.name) for one in fields(cls)))

    def differing(self, other: _Choices) -> list[str]:
        """Names, for people, of what differs."""
        return [words for name, words in _NAMES.items()
                if getattr(self, name) != getattr(other, name)]  # fmt: skip


class Undo:
    """The entries of one desk.

    Parameters
    ----------
    desk
        Whose choices are remembered.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._now = _Choices.of(desk)
        self._before: list[tuple[_Choices, list[str]]] = []

    def note(self) -> None:
        """Look at the desk; another choice than before is an entry."""
        found = _Choices.of(self._desk)
        changed = self._now.differing(found)
        if not changed:
            return
        typed = len(changed) == 1 and changed[0] in [_NAMES[name] for name in _TYPED]
        goes_on = typed and self._before and self._before[-1][1] == changed
        # The first unit is chosen by the screen, and no entry of anybody.
        if not goes_on and self._now.unit is not None:
            self._before = [*self._before, (self._now, changed)][-_MOST:]
        self._now = found

    def settle(self) -> None:
        """What is on the desk came from a session that ended, and is no entry."""
        self._now = _Choices.of(self._desk)

    def back(self) -> list[str]:
        """Put the choices before the last entry on the desk; what was undone, nothing if none."""
        self.note()
        if not self._before:
            return []
        self._now, changed = self._before.pop()
        for one in fields(_Choices):
            setattr(self._desk, one.name, getattr(self._now, one.name))
        return changed
