"""Whether a measurement ended before its plan was done.

Owns the words for it. It reads the state that a history keeps, and judges no reading.
"""

from __future__ import annotations

__all__ = ["state_doubt"]


def state_doubt(state: object) -> str:
    """Why a measurement is not to be judged, by its state in the history; empty if it is complete.

    Parameters
    ----------
    state
        ``"complete"``, ``"interrupted"`` or ``"aborted"``; anything else is not known, and
        says nothing.
    """
    return f"the measurement is not complete: {state}" if state in _INCOMPLETE else ""


_INCOMPLETE = ("interrupted", "aborted")
