"""The history as a session holds it: every call returns or is given up in bounded time.

Owns that bound, and what is said where the history does not answer. A file system may stop
answering for ever, and a source that drives must not wait for it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from daq.analyser import Identity, SourceState, SweepPoint
from daq.control import SessionControl
from daq.errors import MeasurementError
from daq.session.watch import Watch
from daq.store import Store
from daq.store_records import (
    Measurement,
    MeasurementHeader,
    MeasurementState,
    SessionEvent,
    StoredPoint,
)
from daq.untrusted.bounded_calls import Aside, NoReturn

__all__ = ["ANSWER_S", "LAST_WORDS_S", "HeldHistory", "answered"]

ANSWER_S = 10.0
"""How long a history may take for one call while a session runs, s. SQLite itself waits 5 s for
another program that holds the file."""
LAST_WORDS_S = 1.0
"""The same once it did not answer, s."""
_GRACE_S = 1.0
"""How long a call may still take once an end is asked for, s."""

_Result = TypeVar("_Result")


class HeldHistory:
    """What a session asks of a `daq.store.Store`, with a bound; errors are those of the store.

    Parameters
    ----------
    store
        Open, writable.
    aside
        Where its calls are made.
    control, watch
        Asked while a call is waited for: an end that was asked for gives it up, a little later.

    Raises
    ------
    MeasurementError
        From any method, if the history does not answer.
    """

    def __init__(self, store: Store, aside: Aside, control: SessionControl, watch: Watch) -> None:
        self._store = store
        self._aside = aside
        self._control = control
        self._watch = watch
        self._cut_since_s: float | None = None
        self.is_closing = False
        """Whether the source is off, and what is left to be written is waited for."""

    def begin(self, header: MeasurementHeader) -> int:
        """See `daq.store.Store.begin`."""
        return self._do(lambda: self._store.begin(header))

    def measurement(self, measurement: int) -> Measurement:
        """See `daq.store.Store.measurement`."""
        return self._do(lambda: self._store.measurement(measurement))

    def points(self, measurement: int) -> list[StoredPoint]:
        """See `daq.store.Store.points`."""
        return self._do(lambda: self._store.points(measurement))

    def events(self, measurement: int) -> list[SessionEvent]:
        """See `daq.store.Store.events`."""
        return self._do(lambda: self._store.events(measurement))

    def reopen(self, measurement: int) -> None:
        """See `daq.store.Store.reopen`."""
        self._do(lambda: self._store.reopen(measurement))

    def note(self, measurement: int, kind: str, text: str, data: Mapping[str, Any]) -> None:
        """See `daq.store.Store.note`."""
        self._do(lambda: self._store.note(measurement, kind, text, data))

    def set_instrument(self, measurement: int, identity: Identity) -> None:
        """See `daq.store.Store.set_instrument`."""
        self._do(lambda: self._store.set_instrument(measurement, identity))

    def set_source_state(self, measurement: int, state: SourceState) -> None:
        """See `daq.store.Store.set_source_state`."""
        self._do(lambda: self._store.set_source_state(measurement, state))

    def set_readback(self, measurement: int, readback: Mapping[str, str]) -> None:
        """See `daq.store.Store.set_readback`."""
        self._do(lambda: self._store.set_readback(measurement, readback))

    def add_point(
        self, measurement: int, source_vpk: float, requested_hz: float, point: SweepPoint
    ) -> StoredPoint:
        """See `daq.store.Store.add_point`."""
        return self._do(lambda: self._store.add_point(measurement, source_vpk, requested_hz, point))

    def finish(self, measurement: int, state: MeasurementState, source_state: SourceState) -> None:
        """See `daq.store.Store.finish`."""
        self._do(lambda: self._store.finish(measurement, state, source_state))

    def _look(self) -> None:
        if self.is_closing:
            return
        self._watch.check()
        self._watch.beat()
        cut = self._control.cut
        if cut is None or cut[0] == "stop":
            return
        self._cut_since_s = self._cut_since_s or time.monotonic()
        if time.monotonic() - self._cut_since_s > _GRACE_S:
            self._control.check()

    def _do(self, call: Callable[[], _Result]) -> _Result:
        return answered(self._aside, call, f"{self._store.path}", look=self._look)


def answered(
    aside: Aside,
    call: Callable[[], _Result],
    path: str,
    *,
    bound_s: float = ANSWER_S,
    look: Callable[[], None] | None = None,
) -> _Result:
    """Make a call to a history; what it returned.

    Raises
    ------
    MeasurementError
        If it did not return in time.
    """
    bound_s = min(bound_s, LAST_WORDS_S) if aside.is_stuck else bound_s
    try:
        return aside.call(call, bound_s, look)
    except NoReturn as error:
        raise MeasurementError(
            f"{path}: does not answer within {bound_s:g} s; what was committed is kept, look at "
            "its disk or network"
        ) from error
