"""An executor on the workers of a Dask scheduler, for ensembles that outgrow one machine.

Owns the connection to the scheduler and what becomes of tasks whose worker is
lost. It computes nothing. Dask pickles what travels: give it the address of a
scheduler that you trust, as whoever speaks for one can run code here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import metadata
from types import TracebackType
from typing import Any, Self, TypeVar

from daq.errors import AnalysisError, InputError, LinkError
from sim.engine.effort import counting, spend

__all__ = ["ClusterExecutor"]

T = TypeVar("T")
R = TypeVar("R")


class ClusterExecutor:
    """The workers of one scheduler; a context manager that leaves none of its tasks behind.

    Parameters
    ----------
    address
        As Dask writes it: ``tcp://host:8786``, or ``host:8786``.
    connect_s, workers_s
        How long to wait for the scheduler, and then for its first worker, s.

    Raises
    ------
    InputError
        If Dask is not installed, or the address is none.
    LinkError
        If nothing answers there in that time, or no worker is connected to it.
    """

    def __init__(self, address: str, *, connect_s: float = 10.0, workers_s: float = 10.0) -> None:
        try:
            from distributed import Client
            from distributed.comm.addressing import parse_address, parse_host_port
            from distributed.comm.registry import get_backend
        except ImportError as error:
            raise InputError(
                "--cluster needs Dask; install the extra: pip install 'lashbench[cluster]'"
            ) from error
        self.address = address
        try:
            # A client of an address that is none takes 20 s to give up, and then says so itself.
            scheme, place = parse_address(address)
            get_backend(scheme)
            parse_host_port(place)
        except ValueError as error:
            raise InputError(f"{address!r} is no address of a Dask scheduler: {error}") from error
        try:
            self._client: Any = Client(address, timeout=connect_s, set_as_default=False)
        except (OSError, TimeoutError) as error:
            raise LinkError(
                f"no Dask scheduler answers at {address} within {connect_s:g} s; start one with: "
                "dask scheduler"
            ) from error
        try:
            self._client.wait_for_workers(1, timeout=workers_s)
        except TimeoutError as error:
            self._client.close()
            raise LinkError(
                f"the Dask scheduler at {address} has no workers; start some with: "
                f"dask worker {address} --nthreads 1"
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._client.close()

    def each(
        self,
        work: Callable[[T], R],
        tasks: Sequence[T],
        progress: Callable[[float], None] | None = None,
    ) -> list[R]:
        """See `analysis.execution.executor.Executor`.

        A task whose worker is lost runs again on another one; the results of
        the others stay.

        Raises
        ------
        LinkError
            If the scheduler is lost, or a task has taken several workers down with it.
        AnalysisError
            If a worker holds another version of lashbench.
        """
        from distributed import CancelledError, KilledWorker, as_completed

        made_by = metadata.version("lashbench")
        # Not pure: equal tasks are told apart, and nothing is taken from an earlier run.
        futures = self._client.map(
            _run, [(work, task, made_by) for task in tasks], pure=False, batch_size=64
        )
        place = {future.key: at for at, future in enumerate(futures)}
        results: dict[int, R] = {}
        try:
            for future in as_completed(futures, loop=self._client.loop):
                results[place[future.key]], spent = future.result()
                spend(*spent)
                # Fetched is safe: a worker that is lost from now on takes no result with it.
                future.release()
                if progress is not None:
                    progress(len(results) / len(tasks))
        except CancelledError as error:
            raise LinkError(f"the Dask scheduler at {self.address} was lost") from error
        except KilledWorker as error:
            raise LinkError(f"a task was lost with every worker that took it: {error}") from error
        except BaseException:
            # The scheduler may be what was lost; the error that matters is on its way.
            with suppress(Exception):
                self._client.cancel(futures, force=True)
            raise
        return [results[at] for at in range(len(tasks))]


def _run(parcel: tuple[Callable[[T], R], T, str]) -> tuple[R, tuple[float, float]]:
    """On a worker: do a task, and count what it simulates.

    Raises
    ------
    AnalysisError
        If this is another lashbench than the one that sent it.
    """
    work, task, made_by = parcel
    here = metadata.version("lashbench")
    if here != made_by:
        raise AnalysisError(
            f"a worker holds lashbench {here}, this is {made_by}; install the same everywhere"
        )
    with counting() as effort:
        result = work(task)
    return result, (effort.simulated_s, effort.worth_s)
