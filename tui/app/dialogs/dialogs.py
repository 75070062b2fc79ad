"""Dialogs: an error with text that can be copied, a question, the help of a step.

Owns what stops the flow until somebody decides. What needs no decision is a
toast and not here.
"""

from __future__ import annotations

from collections.abc import Sequence

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen

from tui.app.widgets.plain import Passage, Push, Words

__all__ = ["KEYS", "CommandDialog", "Dialog", "ErrorDialog", "HelpDialog", "QuestionDialog"]

KEYS = """Everywhere: Ctrl+X stops the source at once (a software stop, no emergency stop).
Ctrl+N next step, Esc back, 1 to 7 go to a step, Ctrl+P all commands, Ctrl+Y copies what is
shown, Z undoes the last entry (Ctrl+Z in a field), J chooses the limits that are judged by, F2
shows the lashbench commands that do the same, Ctrl+Q quits. Tab moves between fields, Enter
chooses."""
"""The keys that hold on every screen, for its help."""


class Dialog(ModalScreen[bool | None]):
    """A titled box over the step; final classes fill it."""

    BINDINGS = [Binding("escape", "answer(False)", "Close", priority=True)]

    def __init__(self, title: str) -> None:
        super().__init__()
        self.heading = title

    def compose(self) -> ComposeResult:
        """Title, content, keys."""
        with Vertical(id="dialog"):
            yield Words(self.heading, id="title")
            yield from self.content()

    def content(self) -> ComposeResult:
        """What is between title and end of the box."""
        yield from ()

    def action_answer(self, answer: bool) -> None:
        """Close with an answer."""
        self.dismiss(answer)


class ErrorDialog(Dialog):
    """Something went wrong and the operator must know; the text can be selected and copied."""

    BINDINGS = [
        Binding("enter", "answer(True)", "Close", priority=True),
        Binding("c,C", "copy", "Copy"),
    ]

    def __init__(self, title: str, text: str) -> None:
        super().__init__(title)
        self.text = text

    def content(self) -> ComposeResult:
        """The text and what to press."""
        yield Passage(self.text, id="text")
        yield Words("Enter or Esc closes, C copies the text", id="keys")

    def action_copy(self) -> None:
        """Hand the text to the terminal's clipboard."""
        self.app.copy_to_clipboard(self.text)
        self.app.notify("copied")


class QuestionDialog(Dialog):
    """A question with a deliberate yes: its own key, or the button."""

    def __init__(self, title: str, text: str, yes: str, key: str = "y", no: str = "No") -> None:
        super().__init__(title)
        self.text, self.yes, self.key, self.no = text, yes, key, no

    def on_mount(self) -> None:
        """Bind the key of this question; the safe answer has the focus."""
        self._bindings.bind(self.key, "answer(True)", self.yes)
        self.query_one("#no", Push).focus()

    def content(self) -> ComposeResult:
        """The question, both answers."""
        yield Words(self.text)
        with Horizontal(classes="field"):
            yield Push(f"{self.yes} [{self.key}]", id="yes", compact=True)
            yield Push(f"{self.no} [Esc]", id="no", compact=True)
        yield Words(f"{self.key}: {self.yes}   Esc or Enter: {self.no}", id="keys")

    def on_button_pressed(self, event: Push.Pressed) -> None:
        """Answer by button."""
        self.dismiss(event.button.id == "yes")


class HelpDialog(Dialog):
    """What a step is for and which keys it has."""

    BINDINGS = [Binding("enter,f1", "answer(True)", "Close", priority=True)]

    def __init__(self, title: str, text: str) -> None:
        super().__init__(title)
        # The dialog breaks the lines, at the width that it has.
        self.text = "\n\n".join(" ".join(part.split()) for part in text.split("\n\n"))

    def content(self) -> ComposeResult:
        """The text."""
        yield Passage(self.text, id="text")
        yield Words("Enter or Esc closes", id="keys")


class CommandDialog(ErrorDialog):
    """Commands for a shell, one a line, to be copied."""

    BINDINGS = [Binding("f2", "answer(True)", "Close", priority=True)]

    def __init__(self, title: str, lines: Sequence[str]) -> None:
        super().__init__(title, "\n".join(lines))
