"""The line of keys at the bottom of a screen.

Owns when that line is built anew: only where what it shows has changed. It never decides which
keys there are.
"""

from __future__ import annotations

from textual.screen import Screen
from textual.widgets import Footer

__all__ = ["KeyFooter"]


class KeyFooter(Footer):
    """A footer that ignores the many notices after which the same keys are shown."""

    _shown: tuple[object, ...] | None = None

    def bindings_changed(self, screen: Screen) -> None:
        """Build the line anew, if the screen's keys are others than those it was built of."""
        if not screen.app.app_focus or screen is not self.screen:
            return
        keys = tuple(
            (one.binding, one.enabled, one.tooltip) for one in screen.active_bindings.values()
        )
        if keys != self._shown:
            self._shown = keys
            super().bindings_changed(screen)
