"""The widgets that show text: what they are given as a string is plain text, whatever it holds.

Owns the one way in which text reaches the screen. A string is never read as markup, and its
characters that are not seen are escaped; style and actions are given as `Content`, of our own
words only. No other module takes these widgets from Textual (ruff holds that).
"""

from __future__ import annotations

from typing import Any

from rich.highlighter import Highlighter
from rich.text import Text
from textual.content import Content
from textual.widgets import Button, DataTable, Input, Label, OptionList, Static, TextArea
from textual.widgets.option_list import Option

from daq.untrusted.visible_text import visible, visible_line

__all__ = [
    "Caption", "Choices", "Field", "Passage", "Push", "Table", "Words", "choice", "plain",
]  # fmt: skip

_STAND_IN = "\N{REPLACEMENT CHARACTER}"


def plain(text: str | Content) -> Content:
    """Text as it stands; what is `Content` already is ours and stays."""
    return text if isinstance(text, Content) else Content(visible(text))


def choice(text: str, identifier: str) -> Option:
    """An entry of `Choices`; the identifier is given back as it is."""
    return Option(plain(text), id=identifier)


class Words(Static):
    """Lines of text."""

    def __init__(self, text: str | Content = "", **named: Any) -> None:
        super().__init__(plain(text), markup=False, **named)

    def update(self, text: Any = "", *, layout: bool = True) -> None:
        """Show another text."""
        super().update(plain(text), layout=layout)


class Caption(Label):
    """The words beside a field."""

    def __init__(self, text: str, **named: Any) -> None:
        super().__init__(plain(text), markup=False, **named)


class Push(Button):
    """A button."""

    def __init__(self, text: str, **named: Any) -> None:
        super().__init__(plain(text), **named)


class Table(DataTable[Text]):
    """A table whose cells and headings are one line each."""

    def add_column(self, label: Any, **named: Any) -> Any:
        """Add a column under a heading."""
        return super().add_column(_cell(label), **named)

    def add_row(self, *cells: Any, **named: Any) -> Any:
        """Add a row of strings."""
        return super().add_row(*map(_cell, cells), **named)

    def update_cell(self, row_key: Any, column_key: Any, value: Any, **named: Any) -> None:
        """Put another string into a cell."""
        super().update_cell(row_key, column_key, _cell(value), **named)


class Choices(OptionList):
    """A list to choose from, of what `choice` makes."""

    def __init__(self, *entries: Option, **named: Any) -> None:
        super().__init__(*entries, markup=False, **named)


class Field(Input):
    """A line that is typed; what is not seen of its value has a stand-in, the value stays."""

    def __init__(self, value: str = "", **named: Any) -> None:
        super().__init__(value, highlighter=_StandIns(), **named)


class Passage(TextArea):
    """A text to be read, selected and copied."""

    def __init__(self, text: str, **named: Any) -> None:
        super().__init__(visible(text), read_only=True, soft_wrap=True, show_cursor=False, **named)


def _cell(text: str | Text) -> Text:
    return text if isinstance(text, Text) else Text(visible_line(str(text)), no_wrap=True, end="")


class _StandIns(Highlighter):
    """Puts as many characters in place of others, so that the cursor stands where it is."""

    def __call__(self, text: str | Text) -> Text:
        signs = str(text)
        shown = "".join(sign if visible_line(sign) == sign else _STAND_IN for sign in signs)
        return Text(shown, no_wrap=True, overflow="ignore", end="")

    def highlight(self, text: Text) -> None:
        """No style of its own."""
