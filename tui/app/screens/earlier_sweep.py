"""An earlier session of the same unit behind the points, on the steps that plot a response.

Owns the key's work: find that session, or take it away. It draws nothing.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from tui.app.state.sessions import latest_complete
from tui.app.step_screen import StepScreen

if TYPE_CHECKING:
    from daq.frf import FrequencyResponse

__all__ = ["EarlierSweep"]


class EarlierSweep(StepScreen):
    """A step with the key for an earlier sweep."""

    def shown_measurement(self) -> int | None:
        """The measurement whose points are plotted."""
        raise NotImplementedError

    def action_reference(self) -> None:
        """Put the latest complete session of this unit behind the points, or take it away."""
        desk = self.desk
        if desk.reference is not None:
            desk.reference = None
            self.show()
        elif desk.unit is not None:
            shown = self.shown_measurement()
            read = partial(latest_complete, desk.db, desk.unit.name, desk.serial, shown)
            self.bench.beside.do(
                "reference", read, self._take_reference, "The reference cannot be read"
            )

    def _take_reference(self, found: tuple[int, FrequencyResponse] | None) -> None:
        if found is None:
            self.notify("no earlier complete session of this unit")
            return
        self.desk.reference_name, self.desk.reference = f"#{found[0]}", found[1]
        self.show()
