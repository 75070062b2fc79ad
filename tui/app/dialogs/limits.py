"""The dialog in which the limits are chosen that the screen judges by.

Owns its field, and stays open with what was typed until the limits are read. It judges nothing.
"""

from __future__ import annotations

from collections.abc import Callable

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical

from daq.untrusted.visible_text import visible_line
from tui.app.dialogs.form import FormDialog
from tui.app.widgets.plain import Caption, Field, Words

__all__ = ["LimitsDialog"]

_WORDS = (
    "A file with an [acceptance] table, of limits or of a unit, or the name of a unit. Left empty: "
    "what the bench file names under judge, else the unit's own limits."
)


class LimitsDialog(FormDialog[str]):
    """Asks for a name or path; None where nothing is to change.

    Parameters
    ----------
    named
        What was chosen before; empty for nothing.
    read
        Called with each choice; closes the dialog by `accept`, or has it say why by `refuse`.
    """

    DEFAULT_CSS = """
    LimitsDialog > #dialog { width: 76; }
    LimitsDialog Caption { width: 10; }
    LimitsDialog Field { width: 1fr; }
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

    def on_input_submitted(self, event: Field.Submitted) -> None:
        """Have it read; stay where it is wrong."""
        event.stop()
        self.refuse("")
        self._read(self, event.value.strip())
