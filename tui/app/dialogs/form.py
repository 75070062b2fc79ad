"""The form that dialogs of fields share: its frame, the line of a fault, and Escape.

Owns their look, and that a form stays open where something typed is wrong. What is asked, and
what becomes of it, is each dialog's matter.
"""

from __future__ import annotations

from typing import Generic, TypeVar

from textual.binding import Binding
from textual.screen import ModalScreen

from tui.app.widgets.plain import Words

__all__ = ["FormDialog"]

_Result = TypeVar("_Result")


class FormDialog(ModalScreen[_Result | None], Generic[_Result]):
    """A form in a box `#dialog`, with a line `#fault`; None where nothing is to change."""

    BINDINGS = [Binding("escape", "leave", "Leave it", priority=True)]

    DEFAULT_CSS = """
    FormDialog { align: center middle; }
    FormDialog > #dialog {
        width: 70; max-width: 96%; height: auto;
        border: round $accent; background: $surface; padding: 0 1;
    }
    FormDialog #fault { color: $text-error; height: auto; }
    """

    def action_leave(self) -> None:
        """Close without a change."""
        self.dismiss(None)

    def refuse(self, why: str) -> None:
        """Stay open, with what was typed, and say why."""
        self.query_one("#fault", Words).update(why)

    def accept(self, result: _Result) -> None:
        """Close with a result, unless it was closed meanwhile."""
        if self.is_current:
            self.dismiss(result)
