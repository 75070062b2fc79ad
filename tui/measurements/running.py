"""A session from its first record to its end, for every verb that measures.

Owns the loop over its records: signals reach the session, and the iterator is closed at every
end. What is told of a record is the caller's. It draws no screen and judges nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from daq.errors import LashbenchError, MeasurementError
from daq.servers.place import HistoryPlace
from tui.session_words import complete_error
from tui.text.output import Console

if TYPE_CHECKING:
    from daq.control import SessionControl
    from daq.session_events import Finished, SessionEvent
    from daq.session_request import SessionRequest
    from sim.unit import Unit

__all__ = ["run_session"]


def run_session(
    instrument: str,
    unit: Unit,
    db: HistoryPlace,
    request: SessionRequest,
    console: Console,
    tell: Callable[[SessionEvent, Console], None],
    transcript: Path | None = None,
    control: SessionControl | None = None,
) -> tuple[Finished, LashbenchError | None]:
    """Run a session to its end.

    Parameters
    ----------
    tell
        Called with each record; that nobody reads any more ends no session.
    control
        What the session is ended by beside signals; one of its own, if left out.

    Returns
    -------
    Finished
        How it ended.
    LashbenchError or None
        The fault that ended it, with what is kept and the state of the source.

    Raises
    ------
    LashbenchError
        If it failed before anything was kept.
    """
    from daq.control import SessionControl as Control
    from daq.session_events import Finished
    from tui.bench import bench_session
    from tui.signals import listening

    finished = None
    control = control or Control()
    with (
        listening(control, console.note),
        closing(bench_session(instrument, unit, db, request, control, transcript)) as events,
    ):
        try:
            with console.unhurried():
                for event in events:
                    # Whoever listened may have left; the measurement goes on without.
                    with suppress(BrokenPipeError):
                        tell(event, console)
                    if isinstance(event, Finished):
                        finished = event
        except Exception as error:
            if finished is None:
                raise
            fault = complete_error(error, finished)
            fault.__cause__ = error
            return finished, fault
    if finished is None:
        raise MeasurementError("the session ended without a word; this is a fault of lashbench")
    return finished, None
