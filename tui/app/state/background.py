"""Work beside the screen: what reads a history or a file, so that no key ever waits for it.

Owns the threads of such work and what becomes of it. They end with the program, whatever a file
system does: nothing here may write what must not be lost, and nothing here may drive.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, TypeVar

from daq.errors import LashbenchError
from tui.app.messages import WorkDone
from tui.app.state.host import Host

__all__ = ["Beside"]

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class _Job:
    work: Callable[[], Any]
    then: Callable[[Any], None]
    fault: Callable[[Exception], None]


class Beside:
    """The work of one application: by kind, one at a time, and only the latest counts.

    Parameters
    ----------
    app
        Who is told; its event loop calls what is to follow.
    """

    def __init__(self, app: Host) -> None:
        self._app = app
        self._wanted: dict[str, _Job] = {}
        self._running: dict[str, _Job] = {}

    def do(
        self,
        kind: str,
        work: Callable[[], T],
        then: Callable[[T], None],
        title: str,
        refused: Callable[[LashbenchError], None] | None = None,
    ) -> None:
        """Have something done, and something else with its result, in the event loop.

        Work of a kind that is under way is let come to its end, and its result is dropped: however
        often something is asked for, one thread of a kind reads.

        Parameters
        ----------
        kind
            What it is about.
        work
            Called on a thread; must touch nothing that the screens hold.
        then
            Takes its result.
        title
            Over the error, where there is one.
        refused
            Takes an error of input or limits in place of the error dialog.
        """

        def fault(error: Exception) -> None:
            if refused is not None and isinstance(error, LashbenchError):
                refused(error)
            else:
                self._app.show_error(title, error)

        self._wanted[kind] = _Job(work, then, fault)
        if kind not in self._running:
            self._begin(kind)

    def is_under_way(self, kind: str) -> bool:
        """Whether work of a kind is not done yet."""
        return kind in self._wanted

    def done(self, message: WorkDone) -> None:
        """Go on with a result, unless something later was asked for."""
        kind, job = message.kind, self._running.pop(message.kind)
        if self._wanted[kind] is not job:
            self._begin(kind)
            return
        del self._wanted[kind]
        if message.error is not None:
            job.fault(message.error)
        else:
            job.then(message.result)

    def _begin(self, kind: str) -> None:
        job = self._running[kind] = self._wanted[kind]
        threading.Thread(target=self._run, args=(kind, job), name=kind, daemon=True).start()

    def _run(self, kind: str, job: _Job) -> None:
        try:
            message = WorkDone(kind, job.work(), None)
        except Exception as error:
            message = WorkDone(kind, None, error)
        # A screen that is gone needs no result.
        with suppress(RuntimeError):
            self._app.post_message(message)
