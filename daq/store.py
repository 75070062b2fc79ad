"""The history of a bench: every measurement, committed point by point.

Owns reading and writing of one SQLite file. A method that writes returns once
the record is committed: no death of the program undoes it, and the disk is
asked for it at once. Nothing is ever deleted or overwritten: a point that
is measured again supersedes the old one, which stays. The store judges nothing
and knows no instrument.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import sqlalchemy as sa
from sqlalchemy.dialects.sqlite import insert

from daq import store_schema as table
from daq.analyser import Identity, SourceState, SweepPoint
from daq.errors import FileFormatError, InputError
from daq.frf import FrequencyResponse, PointFlag
from daq.store_file import WRITES, log_of, open_engine, telling_faults
from daq.store_flush import Flusher
from daq.store_records import (
    Estimate,
    Measurement,
    MeasurementHeader,
    MeasurementState,
    SessionEvent,
    StoredPoint,
    plan_text,
)
from daq.store_rows import measurement_of, point_of, point_row, response_of

__all__ = ["Store"]


class Store:
    """An open history. Use it as a context manager; it may be used from several threads.

    Raises
    ------
    InputError
        If there is no such file (and `create` is False), or it may not be used.
    FileFormatError
        If it is damaged, belongs to another program, or is newer than this one.
    MeasurementError
        From any method, if the disk refuses the data.
    """

    def __init__(self, path: str | Path, *, create: bool = False, read_only: bool = False) -> None:
        self.path = Path(path)
        self._engine = open_engine(self.path, create=create, read_only=read_only)
        self._writer = self._engine.execution_options(**{WRITES: True})
        self._flusher = Flusher(log_of(self.path))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the file, which is on the disk then; may be called twice."""
        self._flusher.close()
        self._engine.dispose()

    # ------------------------------------------------------------ writing

    def begin(self, header: MeasurementHeader) -> int:
        """Open a new measurement and return its identifier.

        Its state is "interrupted" until `finish` says otherwise, so that a
        program killed at any moment leaves the truth behind.
        """
        with self._writing() as connection:
            row = {
                "unit_id": _shared(
                    connection, table.units, {"name": header.unit, "serial": header.serial}
                ),
                "plan_id": _shared(connection, table.plans, {"document": plan_text(header.plan)}),
                "address": header.address,
                "state": "interrupted",
                "source_state": SourceState.UNKNOWN.value,
                "started": _now(),
                "software": header.software,
                "operator": header.operator,
                "notes": header.notes,
                "configurations": dict(header.configurations),
                "readback": {},
            }
            return _inserted(connection, table.measurements, row)

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
            instrument = _shared(connection, table.instruments, row)
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
        taken = _now()
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
            old = connection.execute(sa.select(columns.id).where(here)).scalar_one_or_none()
            if old is not None:
                # Out of the way of the unique index first; the reference is
                # checked at the commit, when it is right again.
                self._supersede(connection, old, -1)
            new = _inserted(connection, table.points, row)
            if old is not None:
                self._supersede(connection, old, new)
        return StoredPoint(new, source_vpk, requested_hz, point, taken)

    def note(
        self, measurement: int, kind: str, text: str, data: Mapping[str, Any] | None = None
    ) -> SessionEvent:
        """Add a line to the session's journal."""
        entry = SessionEvent(time=_now(), kind=kind, text=text, data=dict(data or {}))
        row = {
            "measurement_id": measurement,
            "time": entry.time,
            "kind": kind,
            "text": text,
            "data": dict(entry.data),
        }
        with self._writing() as connection:
            _inserted(connection, table.events, row)
        return entry

    def reopen(self, measurement: int) -> None:
        """Take up a measurement again: it is "interrupted" until `finish` says otherwise."""
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
                ended=_now(),
            )
        self._flusher.now()

    def add_estimate(
        self, measurement: int, software: str, document: Mapping[str, Any]
    ) -> Estimate:
        """Keep what an analysis said of a measurement; earlier ones stay."""
        estimate = Estimate(measurement, _now(), software, dict(document))
        row = {
            "measurement_id": measurement,
            "made": estimate.made,
            "software": software,
            "document": dict(document),
        }
        with self._writing() as connection:
            _inserted(connection, table.estimates, row)
        return estimate

    # ------------------------------------------------------------ reading

    def measurement(self, measurement: int) -> Measurement:
        """One measurement without its points.

        Raises
        ------
        InputError
            If there is none with that identifier.
        """
        found = self._measurements(table.measurements.c.id == measurement)
        if not found:
            raise InputError(
                f"measurement {measurement} is not in {self.path}; `history` lists those that are"
            )
        return found[0]

    def measurements(self, unit: str | None = None) -> list[Measurement]:
        """All measurements, or those of one unit by name (any case), oldest first."""
        if unit is None:
            return self._measurements(sa.true())
        return self._measurements(sa.func.casefold(table.units.c.name) == unit.casefold())

    def points(self, measurement: int, *, superseded: bool = False) -> list[StoredPoint]:
        """Committed points in the order in which they were taken.

        Points that were measured again appear only if `superseded` is True.
        """
        columns = table.points.c
        query = sa.select(table.points).where(columns.measurement_id == measurement)
        if not superseded:
            query = query.where(columns.superseded_by.is_(None))
        with self._reading() as connection:
            return [point_of(row) for row in connection.execute(query.order_by(columns.id))]

    def response(self, measurement: int) -> FrequencyResponse:
        """The points in force of one measurement as a frequency response.

        Raises
        ------
        InputError
            If there is no such measurement, or it has no point yet.
        """
        found, points = self.measurement(measurement), self.points(measurement)
        if not points:
            raise InputError(f"measurement {measurement} in {self.path} has no point yet")
        return response_of(found, points)

    def events(self, measurement: int) -> list[SessionEvent]:
        """The session's journal, in order."""
        columns = table.events.c
        query = (
            sa.select(columns.time, columns.kind, columns.text, columns.data)
            .where(columns.measurement_id == measurement)
            .order_by(columns.id)
        )
        with self._reading() as connection:
            return [SessionEvent(*row) for row in connection.execute(query)]

    def latest_estimates(self) -> dict[int, Estimate]:
        """The last estimate of each measurement that has one, by its identifier."""
        columns = table.estimates.c
        query = sa.select(
            columns.measurement_id, columns.made, columns.software, columns.document
        ).order_by(columns.id)
        with self._reading() as connection:
            return {row.measurement_id: Estimate(*row) for row in connection.execute(query)}

    # ------------------------------------------------------------ inside

    @contextmanager
    def _writing(self) -> Iterator[sa.Connection]:
        with telling_faults(self.path), self._writer.begin() as connection:
            yield connection
        self._flusher.soon()

    @contextmanager
    def _reading(self) -> Iterator[sa.Connection]:
        with telling_faults(self.path), self._engine.begin() as connection:
            try:
                yield connection
            except (ValueError, TypeError, KeyError) as error:
                # What was stored may stand in it, line ends and all.
                told = " ".join(str(error).split())
                raise FileFormatError(
                    f"{self.path}: holds a record that cannot be read ({told}); restore a copy"
                ) from error

    def _update(self, connection: sa.Connection, measurement: int, **values: Any) -> None:
        columns = table.measurements.c
        done = connection.execute(
            sa.update(table.measurements).where(columns.id == measurement).values(values)
        )
        if done.rowcount != 1:
            raise InputError(f"measurement {measurement} is not in {self.path}")

    @staticmethod
    def _supersede(connection: sa.Connection, old: int, new: int) -> None:
        connection.execute(
            sa.update(table.points).where(table.points.c.id == old).values(superseded_by=new)
        )

    def _measurements(self, where: sa.ColumnElement[bool]) -> list[Measurement]:
        live = table.points.c.superseded_by.is_(None)
        # A point that was merely taken a second time is as good as any.
        touched = table.points.c.flags.op("&")(~int(PointFlag.RETAKEN)) != 0
        counts = (
            sa.select(
                table.points.c.measurement_id.label("of"),
                sa.func.count().label("points"),
                sa.func.sum(sa.case((touched, 1), else_=0)).label("flagged"),
            )
            .where(live)
            .group_by(table.points.c.measurement_id)
            .subquery()
        )
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
                counts.c.points,
                counts.c.flagged,
            )
            .join(table.units, table.units.c.id == table.measurements.c.unit_id)
            .join(table.plans, table.plans.c.id == table.measurements.c.plan_id)
            .outerjoin(
                table.instruments, table.instruments.c.id == table.measurements.c.instrument_id
            )
            .outerjoin(counts, counts.c.of == table.measurements.c.id)
            .where(where)
            .order_by(table.measurements.c.id)
        )
        with self._reading() as connection:
            return [measurement_of(row) for row in connection.execute(query)]


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="microseconds")


def _inserted(connection: sa.Connection, where: sa.Table, row: Mapping[str, Any]) -> int:
    key = connection.execute(sa.insert(where).values(row)).lastrowid
    return int(key)


def _shared(connection: sa.Connection, where: sa.Table, row: Mapping[str, Any]) -> int:
    # Written before it is read: a transaction that reads first could lose the
    # race for the write lock to another program.
    connection.execute(insert(where).values(row).on_conflict_do_nothing())
    same = [where.c[name] == value for name, value in row.items()]
    return int(connection.execute(sa.select(where.c.id).where(*same)).scalar_one())
