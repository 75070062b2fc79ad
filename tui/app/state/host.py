"""What the keepers of the screen's work ask of the application.

Owns this interface. The keepers are written against it, so that none imports the application,
which has them all (`tui.app.application`). Nothing here does anything.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

from tui.app.state.desk import Desk

if TYPE_CHECKING:
    from textual.message import Message
    from textual.notifications import SeverityLevel

__all__ = ["Host", "View"]


class View(Protocol):
    """Whatever shows the results of one measurement (`analysis_keeper.AnalysisKeeper`)."""

    def view(self, measurement: int | None) -> None:
        """Make a measurement the one that results are about."""
        ...


class Host(Protocol):
    """An application with a desk, workers, messages and dialogs."""

    desk: Desk

    @property
    def analyses(self) -> View:
        """Where results are shown."""
        ...

    @property
    def log_words(self) -> str:
        """Where whoever wants to know more should look."""
        ...

    def post_message(self, message: Message) -> bool:
        """Put a message into the queue of the event loop; safe in any thread."""
        ...

    def run_worker(
        self,
        work: Callable[[], None],
        name: str | None = "",
        group: str = "default",
        *,
        exit_on_error: bool = True,
        thread: bool = False,
    ) -> Any:
        """Do something in a thread of its own."""
        ...

    def notify(
        self,
        message: str,
        *,
        severity: SeverityLevel = "information",
        timeout: float | None = None,
    ) -> None:
        """Say something for a moment."""
        ...

    def show_error(self, title: str, error: Exception | str) -> None:
        """A dialog with an error."""
        ...

    def action_stop_source(self) -> None:
        """The one key that stops the source."""
        ...
