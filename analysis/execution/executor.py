"""Where the tasks of an ensemble run: here, or wherever else an executor sends them.

Owns the interface that ensembles are written against, and the executor of this
machine. A task is a value, its work a function of the module level that takes
one core and gives the same result wherever it runs; nothing here knows what
either is about. What is computed between simulations is shared out among the cores of
this machine as well, whoever simulates.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextvars import copy_context
from typing import Protocol, TypeVar

__all__ = ["Executor", "LocalExecutor", "side_by_side"]

_MOST_BESIDE = 4
"""Threads that share out arithmetic: part of it is the interpreter's, one thread at a time."""

T = TypeVar("T")
R = TypeVar("R")


class Executor(Protocol):
    """Runs tasks that do not depend on each other."""

    def each(
        self,
        work: Callable[[T], R],
        tasks: Sequence[T],
        progress: Callable[[float], None] | None = None,
    ) -> list[R]:
        """Results in the order of the tasks, whatever the order in which they were done.

        `progress` is told the share done, from the calling thread. An error in
        a task, or in `progress`, ends the whole; what has not begun is dropped. What tasks
        simulate counts for the caller (`sim.engine.effort`).
        """
        ...


class LocalExecutor:
    """The cores of this machine, a thread each: the engine lets go of the interpreter.

    Parameters
    ----------
    cores
        How many to use; all that the process may run on if not given. They are known afterwards
        as `cores`.
    """

    def __init__(self, cores: int | None = None) -> None:
        self.cores = cores or _cores()

    def each(
        self,
        work: Callable[[T], R],
        tasks: Sequence[T],
        progress: Callable[[float], None] | None = None,
    ) -> list[R]:
        """See `Executor`."""
        with ThreadPoolExecutor(self.cores) as pool:
            # Each in a copy of the context, through which motion is counted.
            futures = [pool.submit(copy_context().run, work, task) for task in tasks]
            try:
                for done, future in enumerate(as_completed(futures)):
                    future.result()
                    if progress is not None:
                        progress((done + 1) / len(futures))
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
        return [future.result() for future in futures]


def side_by_side(work: Callable[[T], R], tasks: Iterable[T]) -> list[R]:
    """Results in the order of the tasks, computed on the cores of this machine.

    For work of some milliseconds or more that is compiled for the most part, and lets go of the
    interpreter meanwhile. It may share out its own.
    """
    known, cores = list(tasks), min(_cores(), _MOST_BESIDE)
    if min(cores, len(known)) < 2:
        return [work(one) for one in known]
    return LocalExecutor(cores).each(work, known)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
