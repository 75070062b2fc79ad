"""The history as a list: one bounded row per measurement, with what was said of it.

Owns the queries that choose rows and read nothing else of the file: no point, no
plan, no whole document. What a row means is `daq.store_records.HistoryLine`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import sqlalchemy as sa

from daq.analyser import SourceState
from daq.bounded_text import parse_json
from daq.store_records import Answer, HistoryLine
from daq.store_rows import document_of, moment, real, state_of, text, whole

__all__ = ["DIAGNOSIS_IN_FORCE", "ESTIMATE_IN_FORCE", "read_lines", "unit_names"]

ESTIMATE_IN_FORCE = """(SELECT max(id) FROM estimates AS x
    WHERE x.measurement_id = m.id AND x.points_version = m.points_version)"""
"""The last estimate that is of the points as they are; `m` is the measurement."""

DIAGNOSIS_IN_FORCE = """(SELECT max(x.id) FROM diagnoses AS x
    WHERE x.measurement_id = m.id AND x.as_measured
        AND EXISTS (SELECT 1 FROM diagnosed_points AS q
            WHERE q.diagnosis_id = x.id AND q.measurement_id = m.id)
        AND NOT EXISTS (SELECT 1 FROM diagnosed_points AS q
            JOIN measurements AS o ON o.id = q.measurement_id
            WHERE q.diagnosis_id = x.id AND q.points_version <> o.points_version))"""
"""The last diagnosis whose measurements all have the points that it saw."""

_LONGEST_SUMMARY = 65536
_CHOSEN = """
    FROM measurements AS m
    JOIN units AS u ON u.id = m.unit_id
    WHERE (:unit IS NULL OR m.unit_id IN (SELECT id FROM units WHERE casefold(name) = :unit))
        AND (:serial IS NULL OR u.serial = :serial)
        AND (NOT :with_points OR m.points > 0)"""
_LINES = f"""
SELECT m.id, u.name AS unit, u.serial, m.started, m.ended, m.state, m.source_state, m.points,
    m.flagged, p.points AS planned, p.levels, i.simulated, m.operator, m.notes,
    (SELECT count(*) FROM corrections AS c WHERE c.measurement_id = m.id) AS corrections,
    e.made AS e_made, e.software AS e_software, e.edition AS e_edition, e.summary AS e_summary,
    d.made AS d_made, d.software AS d_software, d.edition AS d_edition, d.summary AS d_summary
FROM (SELECT m.* {_CHOSEN} ORDER BY m.id DESC LIMIT :last) AS m
JOIN units AS u ON u.id = m.unit_id
JOIN plans AS p ON p.id = m.plan_id
LEFT JOIN instruments AS i ON i.id = m.instrument_id
LEFT JOIN estimates AS e ON e.id = {ESTIMATE_IN_FORCE}
LEFT JOIN diagnoses AS d ON d.id = {DIAGNOSIS_IN_FORCE}
ORDER BY m.id"""


def read_lines(
    connection: sa.Connection,
    unit: str | None = None,
    serial: str | None = None,
    last: int | None = None,
    with_points: bool = False,
) -> Iterator[HistoryLine]:
    """Measurements of a unit (any case) and a serial number, oldest first, the last of them.

    Raises
    ------
    ValueError
        If a row holds what no measurement has.
    """
    chosen = {
        "unit": None if unit is None else unit.casefold(),
        "serial": serial,
        "with_points": with_points,
        "last": -1 if last is None else last,
    }
    levels: dict[str, tuple[float, ...]] = {}
    for row in connection.execute(sa.text(_LINES), chosen):
        if row.levels not in levels:
            # Most measurements share a plan.
            levels.clear()
            levels[row.levels] = _levels(row.levels)
        yield HistoryLine(
            id=whole(row.id),
            unit=text(row.unit),
            serial=text(row.serial),
            started=moment(row.started),
            ended=None if row.ended is None else moment(row.ended),
            state=state_of(row.state),
            source_state=SourceState(row.source_state),
            points=whole(row.points),
            flagged=whole(row.flagged),
            planned=whole(row.planned),
            levels_vpk=levels[row.levels],
            simulated=bool(row.simulated),
            operator=text(row.operator),
            notes=text(row.notes),
            corrections=whole(row.corrections),
            estimate=_answer(row.e_made, row.e_software, row.e_edition, row.e_summary),
            diagnosis=_answer(row.d_made, row.d_software, row.d_edition, row.d_summary),
        )


def count_lines(
    connection: sa.Connection, unit: str | None = None, serial: str | None = None
) -> int:
    """How many measurements of a unit and a serial number there are."""
    chosen = {"unit": unit and unit.casefold(), "serial": serial, "with_points": False}
    return int(connection.execute(sa.text(f"SELECT count(*) {_CHOSEN}"), chosen).scalar_one())


def unit_names(connection: sa.Connection) -> list[str]:
    """Names of the units that were measured, each once, by the alphabet."""
    query = "SELECT DISTINCT name FROM units ORDER BY name LIMIT 1000"
    return [text(row.name) for row in connection.execute(sa.text(query))]


def _levels(stored: object) -> tuple[float, ...]:
    found = parse_json(text(stored))
    if not isinstance(found, list):
        raise ValueError("levels of a plan are no list")
    return tuple(map(real, found))


def _answer(made: Any, software: Any, edition: Any, summary: Any) -> Answer | None:
    if summary is None:
        return None
    document = document_of(parse_json(text(summary, _LONGEST_SUMMARY)))
    return Answer(moment(made), text(software), text(edition), document)
