"""What a person may ask of a running session, from another thread or a signal handler.

Owns the requests and their meaning; it carries none of them out. No method
takes a lock or waits for one, so that a signal handler may call any of them
at any moment.
"""

from __future__ import annotations

from typing import Literal

__all__ = ["Cancelled", "Cut", "SessionControl"]

Cut = Literal["stop", "interrupt", "abort"]
"""Ways to end a session early.

``stop``: when the point in hand is finished; what is missing can be measured later.
``interrupt``: at once; the point in hand is lost, the rest can be measured later.
``abort``: at once and for good; the points are kept, the measurement is not resumed.
"""


class Cancelled(Exception):
    """Ends a wait at once; a session raises and catches it, nobody else sees it."""


class SessionControl:
    """Pause, go on, stop, interrupt and abort; the harder request wins, each is kept."""

    def __init__(self) -> None:
        self._paused = False
        self._reasons: dict[Cut, str] = {}
        self.asked = 0
        """How often an end was asked for; who waits for something else may take one more for it."""

    def pause(self) -> None:
        """Hold after the point in hand, with the source off, until `go_on` or a cut."""
        self._paused = True

    def go_on(self) -> None:
        """Go on after a pause."""
        self._paused = False

    def stop(self, reason: str = "asked to stop") -> None:
        """End when the point in hand is finished."""
        self._ask("stop", reason)

    def interrupt(self, reason: str = "interrupted") -> None:
        """End at once; the measurement can be resumed."""
        self._ask("interrupt", reason)

    def abort(self, reason: str = "aborted by the operator") -> None:
        """End at once and for good."""
        self._ask("abort", reason)

    def _ask(self, cut: Cut, reason: str) -> None:
        self.asked += 1
        self._reasons.setdefault(cut, reason)

    @property
    def paused(self) -> bool:
        """Whether a pause is asked for."""
        return self._paused

    @property
    def cut(self) -> tuple[Cut, str] | None:
        """The hardest way to end that was asked for, and why; None if none was."""
        hardest: tuple[Cut, ...] = ("abort", "interrupt", "stop")
        for cut in hardest:
            if cut in self._reasons:
                return cut, self._reasons[cut]
        return None

    def check(self) -> None:
        """Let a wait that may take long be ended.

        Raises
        ------
        Cancelled
            If the session is to end at once.
        """
        cut = self.cut
        if cut is not None and cut[0] != "stop":
            raise Cancelled(cut[1])
