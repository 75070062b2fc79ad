"""How many cores linear algebra takes between simulations: one.

Owns that limit alone. A library of linear algebra takes every core there is, and its threads wait
for each other without letting go: on a machine that is busy with anything else one of two cores
is late every time, and what took 16 s took 264. Matrices of some hundred rows gain little by more.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import scipy.linalg  # noqa: F401  it brings a library of its own, which the limit has to find
from threadpoolctl import threadpool_limits

__all__ = ["on_one_core"]


@contextmanager
def on_one_core() -> Iterator[None]:
    """Linear algebra takes one core inside; decorates functions, too.

    It holds for the whole process, and ends with what was before. What simulates has threads of
    its own (`analysis.execution.executor`).
    """
    with threadpool_limits(limits=1, user_api="blas"):
        yield
