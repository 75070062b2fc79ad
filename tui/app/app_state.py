"""What a step's screen may ask of the application.

Owns this interface. The screens are written against it, so that none imports the application,
which has them all (`tui.app.application`). Nothing here does anything.
"""

from __future__ import annotations

from typing import Protocol

from tui.app.state.analysis_keeper import AnalysisKeeper
from tui.app.state.background import Beside
from tui.app.state.host import Host
from tui.app.state.session_keeper import SessionKeeper
from tui.app.state.undo import Undo

__all__ = ["AppState"]


class AppState(Host, Protocol):
    """The bench application: its desk, its keepers, and the way through the steps."""

    undo: Undo
    keeper: SessionKeeper
    beside: Beside

    @property
    def analyses(self) -> AnalysisKeeper:
        """The analyses, and where their results go."""
        ...

    def go(self, step: int) -> None:
        """Put a step on top, if what it needs is there; else say what is missing."""
        ...

    def find_instruments(self) -> None:
        """List instruments beside the screen."""
        ...

    def open_session(self, measurement: int) -> None:
        """Read a stored measurement and look at it."""
        ...

    def put_away(self) -> None:
        """Another unit is on the desk: drop what was about the one before."""
        ...

    def action_copy(self) -> None:
        """Copy the step's result."""
        ...
