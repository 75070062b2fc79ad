"""The dialog that asks how long the best sweep may take.

Owns its field. The search runs beside the screen and is told on its step.
"""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical

from daq.errors import InputError
from tui.app.dialogs.form import FormDialog
from tui.app.widgets.plain import Caption, Field, Words
from tui.options import real_number
from tui.unit_under_test import checked_minutes

__all__ = ["BestPlanDialog"]


class BestPlanDialog(FormDialog[float]):
    """Asks for minutes at the bench; None where no sweep is to be found.

    Parameters
    ----------
    unit
        Name of the unit, for the heading.
    minutes
        What is likely.
    """

    DEFAULT_CSS = """
    BestPlanDialog Caption { width: 18; }
    BestPlanDialog Field { width: 12; }
    """

    def __init__(self, unit: str, minutes: float) -> None:
        super().__init__()
        self._unit, self._minutes = unit, minutes

    def compose(self) -> ComposeResult:
        """The field, and what it is for."""
        with Vertical(id="dialog"):
            yield Words(f"The sweep that tells most of {self._unit}", classes="heading")
            with Horizontal(classes="field"):
                yield Caption("driving, minutes")
                yield Field(f"{self._minutes:g}", id="minutes", compact=True)
            yield Words(
                "Units as the datasheet allows are simulated beside the screen; levels, band and "
                "points are chosen that tell the contribution ratio best."
            )
            yield Words("", id="fault")
            yield Words("Enter finds it, Esc leaves the plan as it is")

    def on_input_submitted(self, event: Field.Submitted) -> None:
        """Read the field; stay where it is wrong."""
        event.stop()
        try:
            minutes = checked_minutes(real_number(event.value.strip()))
        except (InputError, ValueError) as error:
            self.refuse(str(error))
            return
        self.dismiss(minutes)
