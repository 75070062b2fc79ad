"""What was analysed of a measurement, kept in its history, and which of it is in force.

Owns estimates and diagnoses as they are stored. What is in force is decided by the
versions of the points that an answer is of, never by the clock; what an answer means is
for others to say.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import sqlalchemy as sa

from daq.store import tables as table
from daq.store.base import StoreFile, inserted, now
from daq.store.listing import ESTIMATE_IN_FORCE
from daq.store.rows import document_of, moment, text, whole
from daq.store_records import Diagnosed, Estimate

__all__ = ["AnswerStore"]

_MOST_TOGETHER, _LATEST = 1000, 20
_NUMBERS = ("contribution_ratio", "b1_deg", "b2_deg", "b_t_deg", "warnings")
_OF_ESTIMATES = (*_NUMBERS, "failed", "refuted")
_OF_DIAGNOSES = (*_NUMBERS, "verdict", "causes", "models", "tolerance")
"""Fields of a document that lists show; they stand in a column of their own."""


class AnswerStore(StoreFile):
    """The part of `daq.store.store.Store` that keeps answers."""

    def add_estimate(
        self,
        measurement: int,
        software: str,
        document: Mapping[str, Any],
        *,
        points_version: int | None = None,
        physics: str = "",
        edition: str = "",
        elapsed_s: float | None = None,
    ) -> Estimate:
        """Keep what an estimate said of a measurement; earlier ones stay.

        Parameters
        ----------
        points_version
            Version of the points that it is of (`Measurement.points_version`, or what
            `response` says in its provenance); that of now, if left out.
        """
        made = now()
        with self._writing() as connection:
            if points_version is None:
                found = self._versions(connection, [measurement])
                if measurement not in found:
                    raise self._unknown(measurement)
                points_version = found[measurement]
            estimate = Estimate(
                measurement, made, software, dict(document), points_version, physics, edition,
                elapsed_s,
            )  # fmt: skip
            row = {
                "measurement_id": measurement,
                "made": made,
                "software": software,
                "document": dict(document),
                "points_version": points_version,
                "physics": physics,
                "edition": edition,
                "elapsed_s": elapsed_s,
                "summary": _gist(document, _OF_ESTIMATES),
            }
            inserted(connection, table.estimates, row)
        return estimate

    def add_diagnosis(
        self,
        measurement: int,
        software: str,
        document: Mapping[str, Any],
        points: Mapping[int, int],
        *,
        physics: str = "",
        as_measured: bool = True,
        edition: str = "",
        elapsed_s: float | None = None,
    ) -> Diagnosed:
        """Keep what a diagnosis said of a measurement; earlier ones stay.

        Parameters
        ----------
        points
            Version of the points of every measurement that was diagnosed together.
        physics, as_measured, edition, elapsed_s
            As `daq.store_records.Diagnosed`.
        """
        made = now()
        row = {
            "measurement_id": measurement,
            "made": made,
            "software": software,
            "document": dict(document),
            "physics": physics,
            "as_measured": as_measured,
            "edition": edition,
            "elapsed_s": elapsed_s,
            "summary": _gist(document, _OF_DIAGNOSES),
        }
        with self._writing() as connection:
            diagnosis = inserted(connection, table.diagnoses, row)
            for number, version in points.items():
                inserted(
                    connection,
                    table.diagnosed_points,
                    {
                        "diagnosis_id": diagnosis,
                        "measurement_id": number,
                        "points_version": version,
                    },
                )
        return Diagnosed(
            measurement, made, software, dict(document), dict(points), physics, as_measured,
            edition, elapsed_s,
        )  # fmt: skip

    def estimate_in_force(self, measurement: int) -> Estimate | None:
        """The last estimate that is of the points as they are now; None if there is none."""
        columns = table.estimates.c
        with self._reading() as connection:
            found = self._in_force(connection, ESTIMATE_IN_FORCE, measurement)
            if found is None:
                return None
            row = connection.execute(sa.select(table.estimates).where(columns.id == found)).one()
            return _estimate_of(row)

    def diagnoses_in_force(self, measurement: int) -> list[Diagnosed]:
        """Diagnoses of the points as they are now, of this measurement and others, latest first.

        At most the last 20.
        """
        columns = table.diagnoses.c
        query = sa.select(table.diagnoses).where(columns.measurement_id == measurement)
        with self._reading() as connection:
            found = []
            for row in connection.execute(query.order_by(columns.id.desc()).limit(_LATEST)):
                points = self._diagnosed_points(connection, whole(row.id))
                now = self._versions(connection, list(points))
                if measurement in points and points == now:
                    found.append(_diagnosed_of(row, points))
            return found

    def latest_estimates(self) -> dict[int, Estimate]:
        """The last estimate of each measurement that has one, by its identifier.

        Of whatever version of the points; `lines` shows those that are in force.
        """
        columns = table.estimates.c
        last = sa.select(sa.func.max(columns.id)).group_by(columns.measurement_id)
        query = sa.select(table.estimates).where(columns.id.in_(last)).order_by(columns.id)
        with self._reading() as connection:
            return {row.measurement_id: _estimate_of(row) for row in connection.execute(query)}

    @staticmethod
    def _in_force(connection: sa.Connection, which: str, measurement: int) -> int | None:
        query = sa.text(f"SELECT {which} FROM measurements AS m WHERE m.id = :of")
        found = connection.execute(query, {"of": measurement}).scalar_one_or_none()
        return None if found is None else whole(found)

    @staticmethod
    def _diagnosed_points(connection: sa.Connection, diagnosis: int) -> dict[int, int]:
        columns = table.diagnosed_points.c
        query = sa.select(table.diagnosed_points).where(columns.diagnosis_id == diagnosis)
        return {
            whole(row.measurement_id): whole(row.points_version)
            for row in connection.execute(query.limit(_MOST_TOGETHER))
        }


def _gist(document: Mapping[str, Any], names: Iterable[str]) -> dict[str, Any]:
    return {name: document[name] for name in names if name in document}


def _estimate_of(row: sa.Row[Any]) -> Estimate:
    return Estimate(
        measurement=whole(row.measurement_id),
        made=moment(row.made),
        software=text(row.software),
        document=document_of(row.document),
        points_version=row.points_version,
        physics=text(row.physics),
        edition=text(row.edition),
        elapsed_s=row.elapsed_s,
    )


def _diagnosed_of(row: sa.Row[Any], points: Mapping[int, int]) -> Diagnosed:
    return Diagnosed(
        measurement=whole(row.measurement_id),
        made=moment(row.made),
        software=text(row.software),
        document=document_of(row.document),
        points=points,
        physics=text(row.physics),
        as_measured=bool(row.as_measured),
        edition=text(row.edition),
        elapsed_s=row.elapsed_s,
    )
