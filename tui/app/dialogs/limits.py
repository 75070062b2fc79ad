"""The dialog in which the limits are chosen that the screen judges by.

Owns its field, and stays open with what was typed until the limits are read. It judges nothing.
"""

from __future__ import annotations

from collections.abc import Callable

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen

from daq.untrusted.visible_text import visible_line
from tui.app.widgets.plain import Caption, Field, Words

__all__ = ["LimitsDialog"]

_WORDS = (
    "A file with an [acceptance] table, of limits or of a unit, or the name of a unit. Left empty: "
    "what the bench file names under judge, else the unit's own limits."
)


class LimitsDialog(ModalScreen[str | None]):
    """Asks for a name or path; None where nothing is to change.

    Parameters
    ----------
    named
        What was chosen before; empty for nothing.
    read
        Called with each choice; closes the dialog by `accept`, or has it say why by `refuse`.
    """

    BINDINGS = [Binding("escape", "leave", "Leave it", priority=True)]

    DEFAULT_CSS = """
    LimitsDialog { align: center middle; }
    LimitsDialog > #dialog {
        width: 76; max-width: 96%; height: auto;
        border: round $accent; background: $surface; padding: 0 1;
    }
    LimitsDialog Caption { width: 10; }
    LimitsDialog Field { width: 1fr; }
    LimitsDialog #fault { color: $text-error; height: auto; }
    """

    def __init__(self, named: str, read: Callable[[LimitsDialog, str], None]) -> None:
        super().__init__()
        self._named, self._read = named, read

    def compose(self) -> ComposeResult:
        """The field, and what it takes."""
        with Vertical(id="dialog"):
            yield Words("Judge by these limits", classes="heading")
            with Horizontal(classes="field"):
                yield Caption("limits")
                yield Field(
                    visible_line(self._named), id="limits-file", placeholder="path", compact=True
                )
            yield Words(_WORDS)
            yield Words("", id="fault")
            yield Words("Enter judges by it, Esc leaves it as it is")

    def action_leave(self) -> None:
        """Close without a change."""
        self.dismiss(None)

    def on_input_submitted(self, event: Field.Submitted) -> None:
        """Have it read; stay where it is wrong."""
        event.stop()
        self.query_one("#fault", Words).update("")
        self._read(self, event.value.strip())

    def refuse(self, why: str) -> None:
        """Stay open, with what was typed, and say why."""
        self.query_one("#fault", Words).update(why)

    def accept(self, named: str) -> None:
        """Close with a choice, unless it was closed meanwhile."""
        if self.is_current:
            self.dismiss(named)
