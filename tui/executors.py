"""Where a verb's ensembles run, from what ``--cluster`` says.

Owns the way from an address to an executor and its end. It runs nothing itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from analysis.execution.executor import Executor
    from tui.computations import Computations

__all__ = ["executor_at"]


@contextmanager
def executor_at(address: str | None, compute: Computations) -> Iterator[Executor | None]:
    """The workers of a scheduler while the block lasts; None, this machine, without an address.

    Raises
    ------
    InputError
        If Dask is not installed, or the address is none.
    LinkError
        If no scheduler answers there, or it has no workers.
    """
    if address is None:
        yield None
        return
    with compute.cluster(address) as cluster:
        yield cluster
