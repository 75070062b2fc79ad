"""Dialogs: an error with text that can be copied, a question, the help of a step.

Owns what stops the flow until somebody decides. What needs no decision is a
toast and not here.
"""

from __future__ import annotations

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Button, Static, TextArea

__all__ = ["Dialog", "ErrorDialog", "HelpDialog", "QuestionDialog"]


class Dialog(ModalScreen[bool | None]):
    """A titled box over the step; final classes fill it."""

    BINDINGS = [Binding("escape", "answer(False)", "Close", priority=True)]

    def __init__(self, title: str) -> None:
        super().__init__()
        self.heading = title

    def compose(self) -> ComposeResult:
        """Title, content, keys."""
        with Vertical(id="dialog"):
            yield Static(self.heading, id="title", markup=False)
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
        yield TextArea(self.text, read_only=True, soft_wrap=True, show_cursor=False, id="text")
        yield Static("Enter or Esc closes, C copies the text", id="keys")

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
        self.query_one("#no", Button).focus()

    def content(self) -> ComposeResult:
        """The question, both answers."""
        yield Static(self.text, markup=False)
        with Horizontal(classes="field"):
            yield Button(f"{self.yes} [{self.key}]".replace("[", "\\["), id="yes", compact=True)
            yield Button(f"{self.no} \\[Esc]", id="no", compact=True)
        yield Static(f"{self.key}: {self.yes}   Esc or Enter: {self.no}", id="keys", markup=False)

    def on_button_pressed(self, event: Button.Pressed) -> None:
        """Answer by button."""
        self.dismiss(event.button.id == "yes")


class HelpDialog(Dialog):
    """What a step is for and which keys it has."""

    BINDINGS = [Binding("enter,f1", "answer(True)", "Close", priority=True)]

    def __init__(self, title: str, text: str) -> None:
        super().__init__(title)
        self.text = text

    def content(self) -> ComposeResult:
        """The text."""
        yield TextArea(self.text, read_only=True, soft_wrap=True, show_cursor=False, id="text")
        yield Static("Enter or Esc closes", id="keys")
