"""Which histories this process has open, so that nothing else here touches their files.

Owns that count. SQLite guards a file with POSIX locks, which belong to the whole process: they are
gone as soon as anything in it closes the file, however it was opened (sqlite.org/howtocorrupt.html,
2.2). Another program then takes the log away under a session that goes on writing into it.
"""

from __future__ import annotations

import threading
from collections import Counter

__all__ = ["OPENING", "closed", "is_open", "opened"]

OPENING = threading.RLock()
"""Held while a file is looked at from outside of SQLite, and until SQLite has it open."""
_OPEN: Counter[str] = Counter()
_COUNTING = threading.Lock()


def opened(file: str) -> None:
    """A connection to a file was made; the file by its own name, links followed."""
    with _COUNTING:
        _OPEN[file] += 1


def closed(file: str) -> None:
    """A connection is closed."""
    with _COUNTING:
        _OPEN[file] -= 1


def is_open(file: str) -> bool:
    """Whether SQLite in this process may hold locks on a file, which it checked when it began."""
    with _COUNTING:
        return _OPEN[file] > 0
