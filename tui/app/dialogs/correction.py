"""The dialog in which what was said of a stored measurement is corrected.

Owns its fields. What may be corrected, and that the old values stay, is the history's part.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical

from daq.store_records import CORRECTABLE
from daq.untrusted.visible_text import visible_line
from tui.app.dialogs.form import FormDialog
from tui.app.widgets.plain import Caption, Field, Words

__all__ = ["CorrectionDialog"]

_LABELS = {"serial": "serial number", "operator": "operator", "notes": "notes"}


class CorrectionDialog(FormDialog[tuple[str, dict[str, str]]]):
    """Asks for new values and who gives them; None where nothing is to be corrected.

    Parameters
    ----------
    measurement
        Identifier, for the heading.
    values
        What stands there now.
    person
        Who is likely to correct.
    """

    DEFAULT_CSS = """
    CorrectionDialog Caption { width: 18; }
    CorrectionDialog Field { width: 1fr; }
    """

    def __init__(self, measurement: int, values: Mapping[str, Any], person: str) -> None:
        super().__init__()
        self._measurement, self._person = measurement, person
        self._values = {name: str(values[name]) for name in CORRECTABLE}

    def compose(self) -> ComposeResult:
        """A line per field."""
        with Vertical(id="dialog"):
            yield Words(f"Correct measurement {self._measurement}", classes="heading")
            for name, value in self._values.items():
                with Horizontal(classes="field"):
                    yield Caption(_LABELS[name])
                    yield Field(visible_line(value), id=f"correct-{name}", compact=True)
            with Horizontal(classes="field"):
                yield Caption("corrected by")
                yield Field(visible_line(self._person), id="correct-person", compact=True)
            yield Words("", id="fault")
            yield Words("Enter corrects it, Esc leaves it, Tab goes on; old values are kept")

    def on_input_submitted(self, event: Field.Submitted) -> None:
        """Read the fields; stay where one is wrong."""
        event.stop()
        person = self._text("person")
        changes = {
            name: self._text(name)
            for name, value in self._values.items()
            # What came from a history is shown with escapes, and stays unless it is changed.
            if self._text(name) != visible_line(value).strip()
        }
        fault = "" if person else "say who corrects it"
        for name, value in {"corrected by": person, **changes}.items():
            fault = fault if value.isprintable() else f"{name} is not one line of text"
        if fault:
            self.refuse(fault)
            return
        self.dismiss((person, changes) if changes else None)

    def _text(self, name: str) -> str:
        return self.query_one(f"#correct-{name}", Field).value.strip()
