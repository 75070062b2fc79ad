"""Marking sessions of a list and laying them over each other, on the step that lists them.

Owns which sessions are marked, and with what. It reads responses beside the screen and lists
nothing.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from tui.app.plot.bode import BodePlot
from tui.app.plot.traces import LEVEL_MARKS, traces_of_sessions
from tui.app.state.sessions import responses_of
from tui.app.step_screen import StepScreen

if TYPE_CHECKING:
    from daq.frf import FrequencyResponse

__all__ = ["SessionOverlay"]

_FEWEST = 2
"""Sessions of an overlay."""


class SessionOverlay(StepScreen):
    """A step with a list of sessions and a plot of those that are marked."""

    def row_under_cursor(self) -> dict[str, Any] | None:
        """The session that keys are about."""
        raise NotImplementedError

    def fill(self) -> None:
        """Write the list anew."""
        raise NotImplementedError

    def mark_of(self, number: int) -> str:
        """The mark of a session in list and plot; empty where it has none."""
        marked = self.desk.marked
        return LEVEL_MARKS[marked.index(number)] if number in marked else ""

    def overlay_words(self) -> str:
        """What to press next for an overlay."""
        count = len(self.desk.marked)
        if count < _FEWEST:
            return "Space marks two or more, O: overlay"
        return f"{count} marked, O: overlay; T: trend"

    def action_mark(self) -> None:
        """Mark or unmark the session under the cursor; as many as there are marks."""
        row, desk = self.row_under_cursor(), self.desk
        if row is None:
            return
        number = int(row["id"])
        if number in desk.marked:
            desk.marked = tuple(one for one in desk.marked if one != number)
        elif len(desk.marked) == len(LEVEL_MARKS):
            self.notify(
                f"{len(LEVEL_MARKS)} sessions can be told apart; Space on one unmarks it",
                severity="warning",
            )
            return
        else:
            desk.marked = (*desk.marked, number)
        self.fill()
        if self.has_class("-overlay") and len(desk.marked) >= _FEWEST:
            # The plot shows the marks that stand in the table.
            self.action_overlay()
        else:
            self.action_trend()

    def action_overlay(self) -> None:
        """Lay the marked sessions over each other."""
        marked = list(self.desk.marked)
        if len(marked) < _FEWEST:
            self.notify("mark two sessions or more first: Space", severity="warning")
            return

        def draw(responses: list[FrequencyResponse]) -> None:
            traces = traces_of_sessions(dict(zip(marked, responses, strict=True)))
            self.add_class("-overlay")
            self.query_one(BodePlot).draw(traces)
            self.show()

        read = partial(responses_of, self.desk.db, marked)
        self.bench.beside.do("overlay", read, draw, "The sessions cannot be overlaid")

    def action_trend(self) -> None:
        """Back to the trend."""
        self.remove_class("-overlay")
        self.show()
