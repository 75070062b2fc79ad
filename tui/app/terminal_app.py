"""What every screen does about the terminal that it is drawn on: told to end or left, it ends.

Owns how that is noticed. What has to be ended first is the screen's.
"""

from __future__ import annotations

import asyncio
import logging
import sys
from typing import TYPE_CHECKING

from textual.app import App

from daq.untrusted.visible_text import visible, visible_line
from tui.exit_codes import INTERRUPTED
from tui.signals import ending_on_signals

if TYPE_CHECKING:
    from textual.driver import Driver
    from textual.notifications import SeverityLevel
    from textual.timer import Timer

__all__ = ["TerminalApp"]

_LOOK_S = 0.5
"""A terminal may go away without a signal, where the program is in a session of its own."""
_LOG = logging.getLogger("lashbench.screen")


class TerminalApp(App[int]):
    """An application that ends with its terminal, and by the signals that end programs."""

    _looking: Timer | None = None

    def get_driver_class(self) -> type[Driver]:
        """The one that outlasts its terminal, where there is one for this platform."""
        found = super().get_driver_class()
        if sys.platform != "win32":
            from textual.drivers.linux_driver import LinuxDriver

            from tui.app.state.lasting_driver import LastingDriver

            return LastingDriver if found is LinuxDriver else found
        return found

    def notify(
        self,
        message: str,
        *,
        title: str = "",
        severity: SeverityLevel = "information",
        timeout: float | None = None,
        markup: bool = False,
    ) -> None:
        """A note that goes away: plain text, whatever it holds and whoever asks for markup."""
        del markup
        super().notify(
            visible(message),
            title=visible_line(title),
            severity=severity,
            timeout=timeout,
            markup=False,
        )

    def copy_to_clipboard(self, text: str) -> None:
        """Hand text to the terminal, as it is seen: it may be pasted at a prompt."""
        super().copy_to_clipboard(visible(text))

    def stop_at_once(self) -> None:
        """Ctrl+X or a signal, told before the event loop hears of it; must wait for nothing."""

    def end_at_once(self) -> None:
        """Nobody may be there to read or to press anything."""
        self.exit(INTERRUPTED, INTERRUPTED)

    def on_mount(self) -> None:
        """Listen and look; Textual calls this beside the `on_mount` of whoever derives from it."""
        if self.is_headless:
            return
        ending_on_signals(asyncio.get_running_loop(), self.stop_at_once, self.end_at_once)
        self._looking = self.set_interval(_LOOK_S, self._look)

    def _look(self) -> None:
        """See whether the terminal is still there."""
        driver = self._driver
        if sys.platform == "win32" or driver is None:
            return
        from tui.app.state.lasting_driver import LastingDriver

        if not isinstance(driver, LastingDriver):
            return
        if driver.gone:
            _LOG.warning("the terminal went away")
            if self._looking is not None:
                self._looking.stop()
            driver.read_no_more()
            self.end_at_once()
        elif driver.owes_a_picture():
            self.screen.refresh()
