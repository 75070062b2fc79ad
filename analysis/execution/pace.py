"""How long a job will still take, from the shares that were done and a clock.

Owns the estimate and its words. It prints nothing.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

__all__ = ["Pace", "duration"]

_TELLING_S = 2.0
"""A job that is over sooner needs no estimate."""

_TELLING_SHARE = 0.02
"""Less done says nothing about the rest."""


class Pace:
    """Remaining time of one job after another.

    A share that is smaller than the one before begins a new job.

    Parameters
    ----------
    clock
        Seconds from any moment on.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began_s, self._began_share = 0.0, 0.0
        self._share = math.inf

    def remaining_s(self, share: float) -> float | None:
        """Seconds that are left, None while there is nothing to go by.

        Parameters
        ----------
        share
            Done so far, 0 to 1.
        """
        now_s = self._clock()
        if share < self._share:
            self._began_s, self._began_share = now_s, share
        self._share = share
        elapsed_s, done = now_s - self._began_s, share - self._began_share
        if elapsed_s < _TELLING_S or done < _TELLING_SHARE or share >= 1.0:
            return None
        return elapsed_s * (1.0 - share) / done


def duration(seconds: float) -> str:
    """A time in words, as coarse as an estimate deserves."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    if seconds < 5400.0:
        minutes, rest = divmod(round(seconds / 5.0) * 5, 60)
        return f"{minutes} min {rest:02d} s" if minutes < 10 else f"{round(seconds / 60.0)} min"
    hours, minutes = divmod(round(seconds / 60.0), 60)
    return f"{hours} h {minutes:02d} min"
