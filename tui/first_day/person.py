"""The person at the bench: questions with answers that are among those offered, in bounded time.

Owns the form of a question and the reading of its answer. It touches no instrument.
"""

from __future__ import annotations

import os
import select
import sys
import time
from collections.abc import Callable
from contextlib import suppress

from daq.driving.first_day import NoAnswer

__all__ = ["DRIVEN_S", "Person"]

DRIVEN_S = 60.0
"""How long a question may wait while the source drives."""
_RESTING_S = 600.0
"""How long one may wait while it is off."""
_SLICE_S = 0.2
_ANSWERS = {"y": True, "yes": True, "n": False, "no": False, "not watched": None}
_OFFERED = "[yes / no / not watched] "


class Person:
    """Whoever answers at the terminal; nobody where there is none.

    Parameters
    ----------
    say
        Prints text, leaving the line open.
    level_vpk
        What the source drives at most while a question waits, V peak.
    driven_s
        How long a question may wait while the source drives, s.
    """

    def __init__(
        self, say: Callable[[str], None], level_vpk: float, driven_s: float = DRIVEN_S
    ) -> None:
        self._say = say
        self._level_vpk = level_vpk
        self._driven_s = driven_s
        self.on_wait: Callable[[], None] = lambda: None
        """Called five times a second while an answer is waited for; may raise."""

    @property
    def is_there(self) -> bool:
        """Whether there is a terminal to ask at."""
        return sys.stdin.isatty() and sys.stderr.isatty()

    def look(self, question: str, drives: bool) -> bool | None:
        """Ask; True for yes, False for no, None for not watched.

        Parameters
        ----------
        drives
            Whether the source may drive until the answer.

        Raises
        ------
        NoAnswer
            If the source may drive and nobody answers in time.
        """
        if not self.is_there:
            return None
        patience_s = self._driven_s if drives else _RESTING_S
        if drives:
            self._say(
                f"THE SOURCE MAY DRIVE UP TO {self._level_vpk:g} V PEAK while this waits, for "
                f"{patience_s:g} s at most.\n"
            )
        _forget_what_was_typed()
        until_s = time.monotonic() + patience_s
        self._say(f"{question}\n{_OFFERED}")
        while True:
            line = self._line(until_s)
            if line is None:
                break
            answer = " ".join(line.split()).lower()
            if answer in _ANSWERS:
                return _ANSWERS[answer]
            self._say(f"{answer!r} is none of the answers; type one of them: {_OFFERED}")
        if not drives:
            self._say(f"\nno answer within {patience_s:g} s: taken as not watched\n")
            return None
        self._say(f"\nno answer within {patience_s:g} s: the source is being made safe\n")
        raise NoAnswer(f"no answer within {patience_s:g} s; the source was made safe")

    def _line(self, until_s: float) -> str | None:
        """What is typed next; None once the time is up. The end of the input is an empty line."""
        while time.monotonic() < until_s:
            self.on_wait()
            if not select.select([sys.stdin], [], [], _SLICE_S)[0]:
                continue
            line = b""
            with suppress(OSError):
                # A terminal gives one line at a time.
                line = os.read(sys.stdin.fileno(), 4096)
            if not line:
                # Ctrl+D, or a terminal that is gone and has this to say without end.
                time.sleep(_SLICE_S)
            return line.decode("utf-8", "replace")
        return None


def _forget_what_was_typed() -> None:
    """Drop what was typed before the question was there to be answered."""
    with suppress(ImportError, OSError):
        import termios

        with suppress(termios.error):
            termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
