"""A session's side of the store: the measurement it writes, and what an earlier session left.

Owns the check of the plan against the limits, which lines the journal holds, and how the traces
of a lost point are found again. It measures nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from daq.analyser import Identity, SourceState
from daq.errors import InputError
from daq.limits import check_plan
from daq.session.agenda import Agenda
from daq.session.history import HeldHistory
from daq.session_events import CheckLine, SessionEvent, Warned
from daq.session_request import SessionRequest
from daq.store_records import Measurement, MeasurementState

__all__ = ["Journal", "Place"]

Place = tuple[float, float]
"""Source level (V peak) and frequency asked for (Hz) of a point."""


class Journal:
    """One measurement as its session writes it.

    Raises
    ------
    LimitError
        If a limit forbids the plan; nothing was written.
    InputError
        If the measurement to resume is not there, or was aborted.
    """

    def __init__(self, store: HeldHistory, request: SessionRequest) -> None:
        self._store = store
        self.before: Measurement | None = None
        """The measurement as an earlier session left it; None if it is new."""
        self.retake: frozenset[Place] = frozenset()
        """Points that were in hand when an earlier session ended."""
        self._readback: Mapping[str, str] = {}
        if request.resume is not None:
            self._resume(request.resume, request)
        elif request.header is not None:
            self.plan = request.header.plan
            check_plan(self.plan, request.limits)
            self.agenda = Agenda(self.plan)
            self.id = store.begin(request.header)

    def _resume(self, measurement: int, request: SessionRequest) -> None:
        store = self._store
        before = store.measurement(measurement)
        if before.state == "aborted":
            raise InputError(
                f"measurement {measurement} was aborted and cannot be resumed; start a new one"
            )
        self.id, self.before, self.plan = measurement, before, before.header.plan
        check_plan(self.plan, request.limits)
        self._readback = before.readback
        self.agenda = Agenda(self.plan, store.points(measurement), request.remeasure_hz)
        self.retake = self._lost(before)
        store.reopen(measurement)
        self.note(
            "resume",
            f"resumed with {self.agenda.done} of {self.agenda.total} points",
            again=self.agenda.again,
        )

    def _lost(self, before: Measurement) -> frozenset[Place]:
        lost = {
            (event.data["source_vpk"], event.data["requested_hz"])
            for event in self._store.events(before.id)
            if event.kind == "lost point"
        }
        first = self.agenda.first_missing()
        # Set up for its sweep and never ended: its program was killed.
        if before.ended is None and before.readback and first is not None:
            lost.add(first)
        return frozenset(lost)

    def note(self, kind: str, text: str, **data: object) -> None:
        """Write a line."""
        self._store.note(self.id, kind, text, data)

    def told(self, lines: Iterable[CheckLine]) -> Iterator[CheckLine]:
        """Write each line of a check and pass it on."""
        for line in lines:
            self.note("check", f"{line.name}: {line.verdict}: {line.text}")
            yield line

    def warned(self, text: str) -> Warned:
        """Write a warning and make the record of it."""
        self.note("warning", text)
        return Warned(text)

    def instrument(self, identity: Identity) -> None:
        """Say who measures; who began a resumed measurement stays on record."""
        if self.before is None or self.before.instrument is None:
            self._store.set_instrument(self.id, identity)

    def source(self, state: SourceState) -> None:
        """Say what is known of the source, before it drives and after it was made safe."""
        self._store.set_source_state(self.id, state)

    def settings(self, readback: Mapping[str, str]) -> Iterator[SessionEvent]:
        """Keep what the instrument said of its settings, or tell where it differs from before."""
        if not self._readback:
            self._readback = dict(readback)
            self._store.set_readback(self.id, readback)
            return
        for name, value in readback.items():
            before = self._readback.get(name, value)
            if value != before:
                yield self.warned(
                    f"{name} reads {value}, and read {before} when the measurement began"
                )
        self._readback = {**self._readback, **readback}

    def end(
        self,
        state: MeasurementState,
        source_state: SourceState,
        reason: str,
        in_hand: Place | None,
    ) -> Measurement:
        """Say how the session ended; the measurement as it now stands."""
        if in_hand is not None:
            level, hz = in_hand
            self.note(
                "lost point",
                f"the point at {hz:g} Hz and {level:g} V peak was in hand and is lost",
                source_vpk=level,
                requested_hz=hz,
            )
        self.note("end", f"{state}: {reason}; source {source_state.value}")
        self._store.finish(self.id, state, source_state)
        return self._store.measurement(self.id)
