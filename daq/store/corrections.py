"""Corrections of what was said of a measurement, with their audit trail; the history as a list.

Owns who changed what, when, and what stood there before: lines are added, none is ever
changed. And the quick look at many measurements, which reads no point and no plan.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import sqlalchemy as sa

from daq.errors import InputError
from daq.store import tables as table
from daq.store.base import StoreFile, check_length, inserted, now, shared
from daq.store.listing import Choice, count_lines, read_lacking, read_lines, unit_names
from daq.store.rows import correction_of, text
from daq.store_records import CORRECTABLE, Correction, HistoryLine, MeasurementState

__all__ = ["CorrectionStore"]

_MOST_CORRECTIONS = 1000


class CorrectionStore(StoreFile):
    """The part of `daq.store.store.Store` that lists measurements and corrects remarks."""

    def correct(
        self, measurement: int, person: str, changes: Mapping[str, str]
    ) -> list[Correction]:
        """Correct what was said of a measurement; what stood there stays in the audit trail.

        Parameters
        ----------
        person
            Who corrects.
        changes
            New values by name, of `daq.store_records.CORRECTABLE`.

        Returns
        -------
        list of Correction
            What was changed; nothing of what is said already.

        Raises
        ------
        InputError
            If there is no such measurement, nobody is named, or a value cannot be kept.
        """
        check_length("name", person)
        if not person.strip():
            raise InputError("a correction says who made it; give a name")
        for name, value in changes.items():
            if name not in CORRECTABLE:
                raise InputError(f"{name!r} cannot be corrected; {', '.join(CORRECTABLE)} can be")
            check_length(name, value)
        columns, time, done = table.measurements.c, now(), []
        query = (
            sa.select(table.units.c.name, table.units.c.serial, columns.operator, columns.notes)
            .join(table.units, table.units.c.id == columns.unit_id)
            .where(columns.id == measurement)
        )
        with self._writing() as connection, self._legible():
            found = connection.execute(query).one_or_none()
            if found is None:
                raise self._unknown(measurement)
            for name, new in changes.items():
                old = text(getattr(found, name))
                if old == new:
                    continue
                if name == "serial":
                    unit = {"name": found.name, "serial": new}
                    values: dict[str, Any] = {"unit_id": shared(connection, table.units, unit)}
                else:
                    values = {name: new}
                self._update(connection, measurement, **values)
                correction = Correction(time, person, name, old, new)
                inserted(
                    connection,
                    table.corrections,
                    {
                        "measurement_id": measurement,
                        "time": time,
                        "person": person,
                        "field": name,
                        "old": old,
                        "new": new,
                    },
                )
                done.append(correction)
        return done

    def corrections(self, measurement: int) -> list[Correction]:
        """The audit trail: what was corrected afterwards, oldest first."""
        with self._reading() as connection:
            return self._corrections(connection, measurement)

    def lines(
        self,
        unit: str | None = None,
        serial: str | None = None,
        *,
        last: int | None = None,
        with_points: bool = False,
        exact: bool = False,
        since: str | None = None,
        state: MeasurementState | None = None,
        search: str | None = None,
    ) -> list[HistoryLine]:
        """Measurements as a list shows them, oldest first: the gist, and what was said of each.

        Parameters
        ----------
        unit, serial
            Only those of this unit and this serial number.
        last
            At most so many, the newest.
        with_points
            Leave out what has no point.
        exact
            Take the unit's name as it stands; else in any case.
        since, state
            Only those started then or later (ISO 8601, UTC), and those that stand so.
        search
            Only those that have each of its words, see `daq.store.listing.Choice`.
        """
        choice = Choice(
            unit, serial, last, with_points, exact, since=since, state=state, search=search
        )
        with self._reading() as connection:
            return list(read_lines(connection, choice))

    def each_line(
        self,
        unit: str | None = None,
        serial: str | None = None,
        *,
        last: int | None = None,
        with_points: bool = False,
        exact: bool = False,
        answered: bool = False,
        since: str | None = None,
        state: MeasurementState | None = None,
        search: str | None = None,
    ) -> Iterator[HistoryLine]:
        """As `lines`, one after the other, so that any number takes the memory of one.

        With `answered` only those that were ever estimated or diagnosed.
        """
        choice = Choice(unit, serial, last, with_points, exact, answered, since, state, search)
        with self._reading() as connection:
            yield from read_lines(connection, choice)

    def count(
        self,
        unit: str | None = None,
        serial: str | None = None,
        *,
        since: str | None = None,
        state: MeasurementState | None = None,
        search: str | None = None,
    ) -> int:
        """How many measurements there are of a unit (any case) and a serial number, see `lines`."""
        with self._reading() as connection:
            return count_lines(
                connection, Choice(unit, serial, since=since, state=state, search=search)
            )

    def lacking(
        self,
        unit: str | None = None,
        serial: str | None = None,
        *,
        last: int | None = None,
        edition: str | None = None,
        since: str | None = None,
        state: MeasurementState | None = None,
        search: str | None = None,
    ) -> list[int]:
        """Complete measurements, among the last of `lines`, without an estimate in force.

        Parameters
        ----------
        edition
            Count what failed, or is of another edition than this, as none.
        """
        with self._reading() as connection:
            choice = Choice(unit, serial, last, since=since, state=state, search=search)
            return read_lacking(connection, choice, edition)

    def unit_names(self) -> list[str]:
        """Names of all units that were measured."""
        with self._reading() as connection:
            return unit_names(connection)

    @staticmethod
    def _corrections(connection: sa.Connection, measurement: int) -> list[Correction]:
        columns = table.corrections.c
        query = sa.select(table.corrections).where(columns.measurement_id == measurement)
        rows = connection.execute(query.order_by(columns.id).limit(_MOST_CORRECTIONS))
        return [correction_of(row) for row in rows]
