"""Textual's driver of a terminal, made to outlast that terminal.

Owns what is written to the terminal and how its loss is noticed. It ends nothing itself.
Textual's own driver spins where there is nothing more to read, and makes the whole screen wait
where nobody takes what is written: neither a signal nor the loss would be heard of.
"""

from __future__ import annotations

import os
import sys
from typing import Any

from textual.drivers.linux_driver import LinuxDriver
from textual.events import Key
from textual.message import Message

from tui.text.narrator import Narrator
from tui.text.output import hush

__all__ = ["STOP_KEY", "LastingDriver"]

STOP_KEY = "ctrl+x"

_PATIENCE_S = 2.0
"""How long is waited for a terminal to take what is left, when the screen is gone."""
_PICTURE = 256
"""Characters from which on a piece is a picture's; those that set a terminal up are shorter."""


class LastingDriver(LinuxDriver):
    """Draws without ever waiting for whoever looks at it, and knows whether anybody can."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        # Not sys.stderr, which catches what is printed while a screen is up.
        assert sys.__stderr__ is not None, "no screen is opened without a terminal"
        self._screen = sys.__stderr__
        self._narrator = Narrator(self._screen)
        self._cannot_read = False
        self._left_out = False

    @property
    def gone(self) -> bool:
        """Whether keys or picture have no terminal any more."""
        files = self.fileno, self._screen.fileno()
        return self._cannot_read or not all(os.isatty(file) for file in files)

    def owes_a_picture(self) -> bool:
        """Whether something was left out that the terminal has room for now; it is told once."""
        caught_up = self._left_out and not self._narrator.is_behind
        self._left_out = self._left_out and not caught_up
        return caught_up

    def read_no_more(self) -> None:
        """Let the thread that reads keys end; what is gone is always ready to be read."""
        self.exit_event.set()

    def run_input_thread(self) -> None:
        """Read keys until there is nothing to read them from."""
        try:
            super().run_input_thread()
        except OSError:
            self._cannot_read = True

    def process_message(self, message: Message) -> None:
        """Hand a key on; the one that stops the source reaches it first, whatever the loop does."""
        if isinstance(message, Key) and message.key == STOP_KEY:
            stop = getattr(self._app, "stop_at_once", None)
            if stop is not None:
                stop()
        super().process_message(message)

    def write(self, data: str) -> None:
        """Have something written; pictures only while not too many wait."""
        if not self._narrator.say(data, fleeting=len(data) > _PICTURE):
            self._left_out = True

    def close(self) -> None:
        """Let the terminal take what is left; whatever is written later must not wait, nor fail."""
        super().close()
        if self.gone or not self._narrator.has_said_all(_PATIENCE_S):
            for stream in (sys.__stdout__, self._screen):
                if stream is not None:
                    hush(stream)
        self._narrator.end()
