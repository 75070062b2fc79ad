"""How far long work is: told to whoever asked, in parts that add up.

Owns the type of that callable and its division among the steps of a task.
"""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Progress", "part_of", "remaining"]

Progress = Callable[[float, str], None]
"""Takes the share done, 0 to 1, and what is being done."""


def part_of(
    progress: Progress | None, low: float, high: float, text: str
) -> Callable[[float], None] | None:
    """What a step tells of its own share, 0 to 1, as a part of the whole."""
    if progress is None:
        return None
    return lambda share: progress(low + (high - low) * share, text)


def remaining(progress: Progress | None, done: float) -> Progress | None:
    """What the steps tell that come when so large a share of the whole is done."""
    if progress is None:
        return None
    return lambda share, text: progress(done + (1.0 - done) * share, text)
