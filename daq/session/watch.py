"""The session's interface to its watchdog.

Owns that interface, and the one for instruments that need nobody: those that live and die with the
session. It starts no process.
"""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Watch"]


class Watch:
    """Nobody stands by; `daq.session.watchdog.Watchdog` is somebody."""

    def stand_by(self, look: Callable[[], None]) -> None:
        """Return once somebody is ready to switch the source off.

        Parameters
        ----------
        look
            Called while it is waited; may raise.

        Raises
        ------
        MeasurementError
            If nobody can be made ready.
        """

    def beat(self, within_s: float = 0.0) -> None:
        """Say that the session drives, and lives.

        Parameters
        ----------
        within_s
            How long the session may be silent now, s; a margin is added.
        """

    def rest(self) -> None:
        """Say that the source is proven off and the session may be silent until its next beat."""

    def check(self) -> None:
        """Return if the session still has the bench, and somebody stands by.

        Raises
        ------
        MeasurementError
            If the bench was taken from the session, or nobody stands by any more.
        """

    def remarks(self) -> list[str]:
        """What a person should know, said once."""
        return []
