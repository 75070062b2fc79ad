"""The history of a bench: every measurement, committed point by point.

Owns reading and writing of one history, a file or on a server. A method that writes returns once
the record is committed: no death of the program undoes it, and the disk is
asked for it at once. Nothing is ever deleted: a point that is measured again
supersedes the old one, which stays, and what is corrected stays in an audit
trail. What was analysed counts by the version of the points that it is of, never
by the clock. The store judges nothing and knows no instrument.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import sqlalchemy as sa

from daq.analyser import Identity, SourceState, SweepPoint
from daq.errors import InputError
from daq.frf import FrequencyResponse, PointFlag
from daq.store import tables as table
from daq.store.answers import AnswerStore
from daq.store.base import check_length, inserted, now, shared
from daq.store.corrections import CorrectionStore
from daq.store.listing import unit_names
from daq.store.rows import (
    event_of,
    measurement_of,
    point_of,
    point_row,
    response_of,
)
from daq.store_records import (
    CORRECTABLE,
    Measurement,
    MeasurementHeader,
    MeasurementState,
    SessionEvent,
    StoredPoint,
    plan_text,
)

__all__ = ["Store"]

_MOST_ROWS = 300_000
"""Points, or lines of a journal, of one measurement that are read; a sweep has up to 100,000."""


class Store(AnswerStore, CorrectionStore):
    """An open history. Use it as a context manager; it may be used from several threads.

    Parameters
    ----------
    path
        The file, or the server (`daq.servers.place`).
    create
        Make it if it is not there.
    read_only
        Nothing can be written.

    Raises
    ------
    InputError
        If there is no such file (and `create` is False), or it may not be used.
    FileFormatError
        If it is damaged, belongs to another program, or is newer than this one.
    MeasurementError
        From any method, if the disk refuses the data.
    """

    # ------------------------------------------------------------ writing

    def begin(self, header: MeasurementHeader) -> int:
        """Open a new measurement and return its identifier.

        Its state is "interrupted" until `finish` says otherwise, so that a
        program killed at any moment leaves the truth behind.

        Raises
        ------
        InputError
            If a text in it is longer than a history holds.
        """
        for name in ("unit", *CORRECTABLE):
            check_length(name, getattr(header, name))
        plan = header.plan
        shared_plan = {
            "document": plan_text(plan),
            "points": plan.points,
            "levels": list(plan.levels_vpk),
        }
        with self._writing() as connection:
            row = {
                "unit_id": shared(
                    connection, table.units, {"name": header.unit, "serial": header.serial}
                ),
                "plan_id": shared(connection, table.plans, shared_plan, by="document"),
                "address": header.address,
                "state": "interrupted",
                "source_state": SourceState.UNKNOWN.value,
                "started": now(),
                "software": header.software,
                "operator": header.operator,
                "notes": header.notes,
                "configurations": dict(header.configurations),
                "readback": {},
            }
            measurement = inserted(connection, table.measurements, row)
        self._claim(measurement)
        return measurement

    def set_instrument(self, measurement: int, identity: Identity) -> None:
        """Record who measures."""
        row = {
            "maker": identity.maker,
            "model": identity.model,
            "serial": identity.serial,
            "revision": identity.revision,
            "options": list(identity.options),
            "simulated": identity.simulated,
        }
        with self._writing() as connection:
            instrument = shared(connection, table.instruments, row)
            self._update(connection, measurement, instrument_id=instrument)

    def set_readback(self, measurement: int, readback: Mapping[str, str]) -> None:
        """Record what the instrument said of its settings."""
        with self._writing() as connection:
            self._update(connection, measurement, readback=dict(readback))

    def set_source_state(self, measurement: int, state: SourceState) -> None:
        """Record what is known of the source."""
        with self._writing() as connection:
            self._update(connection, measurement, source_state=state.value)

    def add_point(
        self, measurement: int, source_vpk: float, requested_hz: float, point: SweepPoint
    ) -> StoredPoint:
        """Commit a point; one already there at the same place is superseded and kept."""
        taken = now()
        row = {
            "measurement_id": measurement,
            "source_vpk": source_vpk,
            "requested_hz": requested_hz,
            "taken": taken,
        } | point_row(point)
        columns = table.points.c
        here = sa.and_(
            columns.measurement_id == measurement,
            columns.source_vpk == source_vpk,
            columns.requested_hz == requested_hz,
            columns.superseded_by.is_(None),
        )
        with self._writing() as connection:
            old = connection.execute(sa.select(columns.id, columns.flags).where(here)).one_or_none()
            if old is not None:
                # Out of the way of the unique index first; the reference is
                # checked at the commit, when it is right again.
                self._supersede(connection, old.id, -1)
            new = inserted(connection, table.points, row)
            if old is not None:
                self._supersede(connection, old.id, new)
            count = table.measurements.c
            change = _counts(point.flags) - (0 if old is None else _counts(old.flags))
            self._update(
                connection,
                measurement,
                points=count.points + int(old is None),
                flagged=count.flagged + change,
                points_version=count.points_version + 1,
            )
        return StoredPoint(new, source_vpk, requested_hz, point, taken)

    def note(
        self, measurement: int, kind: str, text: str, data: Mapping[str, Any] | None = None
    ) -> SessionEvent:
        """Add a line to the session's journal."""
        entry = SessionEvent(time=now(), kind=kind, text=text, data=dict(data or {}))
        row = {
            "measurement_id": measurement,
            "time": entry.time,
            "kind": kind,
            "text": text,
            "data": dict(entry.data),
        }
        with self._writing() as connection:
            inserted(connection, table.events, row)
        return entry

    def reopen(self, measurement: int) -> None:
        """Take up a measurement again: it is "interrupted" until `finish` says otherwise.

        Raises
        ------
        MeasurementError
            If another bench has it under way, on a server.
        """
        self._claim(measurement)
        with self._writing() as connection:
            self._update(connection, measurement, state="interrupted", ended=None)

    def finish(self, measurement: int, state: MeasurementState, source_state: SourceState) -> None:
        """Record how a measurement ended, and what is known of the source; the disk has it then."""
        with self._writing() as connection:
            self._update(
                connection,
                measurement,
                state=state,
                source_state=source_state.value,
                ended=now(),
            )
        if self._flusher is not None:
            self._flusher.now()

    # ------------------------------------------------------------ reading

    def measurement(self, measurement: int) -> Measurement:
        """One measurement without its points.

        Raises
        ------
        InputError
            If there is none with that identifier.
        """
        with self._reading() as connection:
            return self._one(connection, measurement)

    def measurements(self, unit: str | None = None) -> list[Measurement]:
        """All measurements, or those of one unit by name (any case), oldest first.

        With all that is known of them; `lines` is what a long history is looked through by.
        """
        where: sa.ColumnElement[bool] = sa.true()
        with self._reading() as connection:
            if unit is not None:
                folded = unit.casefold()
                names = [name for name in unit_names(connection) if name.casefold() == folded]
                where = table.units.c.name.in_(names)
            return list(self._measurements(connection, where))

    def points(self, measurement: int, *, superseded: bool = False) -> list[StoredPoint]:
        """Committed points in the order in which they were taken.

        Points that were measured again appear only if `superseded` is True.
        """
        with self._reading() as connection:
            return self._points(connection, measurement, superseded)

    def response(self, measurement: int) -> FrequencyResponse:
        """The points in force of one measurement as a frequency response.

        Its provenance says which version of the points it is, and what was corrected.

        Raises
        ------
        InputError
            If there is no such measurement, or it has no point yet.
        """
        # In one transaction: the version is that of these points, whoever writes meanwhile.
        with self._reading() as connection:
            found = self._one(connection, measurement)
            points = self._points(connection, measurement, False)
            if not points:
                raise InputError(f"measurement {measurement} in {self.path} has no point yet")
            return response_of(found, points, self._corrections(connection, measurement))

    def events(self, measurement: int) -> list[SessionEvent]:
        """The session's journal, in order."""
        columns = table.events.c
        query = sa.select(table.events).where(columns.measurement_id == measurement)
        with self._reading() as connection:
            self._check_number(connection, query, "lines in its journal", measurement)
            return [event_of(row) for row in connection.execute(query.order_by(columns.id))]

    # ------------------------------------------------------------ inside

    @staticmethod
    def _supersede(connection: sa.Connection, old: int, new: int) -> None:
        connection.execute(
            sa.update(table.points).where(table.points.c.id == old).values(superseded_by=new)
        )

    def _one(self, connection: sa.Connection, measurement: int) -> Measurement:
        for found in self._measurements(connection, table.measurements.c.id == measurement):
            return found
        raise self._unknown(measurement)

    @staticmethod
    def _measurements(
        connection: sa.Connection, where: sa.ColumnElement[bool]
    ) -> Iterator[Measurement]:
        query = (
            sa.select(
                table.measurements,
                table.units.c.name.label("unit"),
                table.units.c.serial.label("unit_serial"),
                table.plans.c.document.label("plan"),
                table.instruments.c.maker,
                table.instruments.c.model,
                table.instruments.c.serial.label("instrument_serial"),
                table.instruments.c.revision,
                table.instruments.c.options,
                table.instruments.c.simulated,
            )
            .join(table.units, table.units.c.id == table.measurements.c.unit_id)
            .join(table.plans, table.plans.c.id == table.measurements.c.plan_id)
            .outerjoin(
                table.instruments, table.instruments.c.id == table.measurements.c.instrument_id
            )
            .where(where)
            .order_by(table.measurements.c.id)
        )
        return map(measurement_of, connection.execute(query))

    def _points(
        self, connection: sa.Connection, measurement: int, superseded: bool
    ) -> list[StoredPoint]:
        columns = table.points.c
        own = columns.measurement_id == measurement
        # Two questions, as each has an index of its own.
        kinds = [columns.superseded_by.is_(None)]
        if superseded:
            kinds.append(columns.superseded_by.is_not(None))
        found: list[StoredPoint] = []
        for kind in kinds:
            query = sa.select(table.points).where(own, kind)
            self._check_number(connection, query, "points", measurement)
            found += map(point_of, connection.execute(query))
        return sorted(found, key=lambda point: point.id)

    @staticmethod
    def _check_number(
        connection: sa.Connection, query: sa.Select[Any], words: str, measurement: int
    ) -> None:
        rows = query.with_only_columns(sa.literal(1)).limit(_MOST_ROWS + 1).subquery()
        if (
            connection.execute(sa.select(sa.func.count()).select_from(rows)).scalar_one()
            > _MOST_ROWS
        ):
            raise ValueError(f"measurement {measurement} has more than {_MOST_ROWS} {words}")


def _counts(flags: int) -> int:
    # A point that was merely taken a second time is as good as any.
    return int(bool(int(flags) & ~int(PointFlag.RETAKEN)))
