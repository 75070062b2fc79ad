"""The cores of this machine for arithmetic between simulations.

Owns how work on many things at once is shared out. It pays where most of the
work is compiled and lets go of the interpreter (`analysis.expectation`); what
simulates goes through an executor (`analysis.executor`).
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

__all__ = ["each"]

T = TypeVar("T")
R = TypeVar("R")

_HERE = threading.local()


def each(work: Callable[[T], R], items: Iterable[T]) -> list[R]:
    """Results in the order of the items, whichever thread they come from.

    What a thread of these asks for in turn it does itself: nobody waits for a thread that waits.
    """
    listed = list(items)
    if len(listed) < 2 or getattr(_HERE, "busy", False):
        return [work(item) for item in listed]
    return list(_pool().map(work, listed))


@cache
def _pool() -> ThreadPoolExecutor:
    def begin() -> None:
        _HERE.busy = True

    return ThreadPoolExecutor(_cores(), thread_name_prefix="arithmetic", initializer=begin)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
