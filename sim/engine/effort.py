"""How much motion was simulated: what an analysis costs, whatever machine it runs on.

Owns the count of simulated seconds, and of what they are worth. It measures no time and slows
nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Lock

__all__ = ["Effort", "counting", "spend"]


class Effort:
    """Seconds of motion simulated inside a `counting` block so far; threads may add to it.

    `simulated_s`, and `worth_s`: seconds of a plain unit's motion that take as long to simulate.
    """

    def __init__(self) -> None:
        self.simulated_s = self.worth_s = 0.0
        self._lock = Lock()

    def add(self, simulated_s: float, worth_s: float | None = None) -> None:
        """Count so many seconds more; a plain unit's motion is worth itself."""
        with self._lock:
            self.simulated_s += simulated_s
            self.worth_s += simulated_s if worth_s is None else worth_s


_COUNTS: ContextVar[tuple[Effort, ...]] = ContextVar("counts", default=())


@contextmanager
def counting() -> Iterator[Effort]:
    """Count what is simulated inside the block; blocks may be nested.

    Another thread counts where it runs in a copy of this one's context.
    """
    effort = Effort()
    token = _COUNTS.set((*_COUNTS.get(), effort))
    try:
        yield effort
    finally:
        _COUNTS.reset(token)


def spend(simulated_s: float, worth_s: float | None = None) -> None:
    """Add to every count that is open."""
    for effort in _COUNTS.get():
        effort.add(simulated_s, worth_s)
