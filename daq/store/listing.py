"""The history as a list: one bounded row per measurement, with what was said of it.

Owns the queries that choose rows and read nothing else of the file: no point, no
plan, no whole document. What a row means is `daq.store_records.HistoryLine`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa

from daq.analyser import SourceState
from daq.store.rows import document_of, moment, real, state_of, text, whole
from daq.store_records import LONGEST_NAME, Answer, HistoryLine, MeasurementState
from daq.untrusted.bounded_text import parse_json

__all__ = [
    "ESTIMATE_IN_FORCE",
    "Choice",
    "count_lines",
    "read_lacking",
    "read_lines",
    "unit_names",
]

_MOST_NAMES = 1000

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
_LINES = f"""
SELECT m.id, u.name AS unit, u.serial, m.started, m.ended, m.state, m.source_state, m.points,
    m.flagged, p.points AS planned, p.levels, i.simulated, m.operator, m.notes,
    (SELECT count(*) FROM corrections AS c WHERE c.measurement_id = m.id) AS corrections,
    e.made AS e_made, e.software AS e_software, e.edition AS e_edition, e.summary AS e_summary,
    d.made AS d_made, d.software AS d_software, d.edition AS d_edition, d.summary AS d_summary
FROM (SELECT m.* FROM measurements AS m {{where}} ORDER BY m.id DESC LIMIT :last) AS m
JOIN units AS u ON u.id = m.unit_id
JOIN plans AS p ON p.id = m.plan_id
LEFT JOIN instruments AS i ON i.id = m.instrument_id
LEFT JOIN estimates AS e ON e.id = {ESTIMATE_IN_FORCE}
LEFT JOIN diagnoses AS d ON d.id = {DIAGNOSIS_IN_FORCE}
ORDER BY m.id"""


_ANSWERED = """(EXISTS (SELECT 1 FROM estimates AS x WHERE x.measurement_id = m.id)
    OR EXISTS (SELECT 1 FROM diagnoses AS x WHERE x.measurement_id = m.id))"""
_COUNT = "SELECT count(*) FROM measurements AS m {where}"
_LACKING = f"""
SELECT m.id, e.id AS estimate, e.edition, e.summary
FROM (SELECT m.* FROM measurements AS m {{where}} ORDER BY m.id DESC LIMIT :last) AS m
LEFT JOIN estimates AS e ON e.id = {ESTIMATE_IN_FORCE}
WHERE m.state = 'complete'{{which}}
ORDER BY m.id"""
_ALL = (1 << 63) - 1
_MOST_WORDS = 10
"""The last of them holds the rest of the text as it stands."""
_SEARCHED = ("m.operator", "m.notes", "m.state", "CAST(m.id AS TEXT)")
_LIKE = "LIKE {word} ESCAPE '|'"
_HAS_WORD = (
    "("
    + " OR ".join(f"lower({column}) {_LIKE}" for column in _SEARCHED)
    + f" OR m.unit_id IN (SELECT id FROM units WHERE lower(name) {_LIKE}"
    + f" OR lower(serial) {_LIKE}))"
)
"""Whether a measurement `m` has a word; a scan, as no index serves a part of a text."""
_DAY = re.compile(r"\d-\d")
_ON_DAY = f"({_HAS_WORD} OR m.started {_LIKE})"
"""The same of a word that looks like a day; a bare 20 would be in the year of each."""


@dataclass(frozen=True, slots=True)
class Choice:
    """Which measurements are meant.

    Parameters
    ----------
    unit
        Name of the unit, in any case; all, if left out.
    serial
        Serial number; all, if left out.
    last
        At most so many, the newest.
    with_points
        Leave out what has no point.
    exact
        Take the unit's name as it stands.
    answered
        Leave out what was never estimated or diagnosed.
    since
        Only what was started then or later: ISO 8601, UTC, as the history keeps it.
    state
        Only what stands so: complete, interrupted or aborted.
    search
        Only what has each of these words, in any case (on a server: of its locale), in its unit,
        serial number, operator, notes, state or number; one that looks like a day, as 11-30, also
        in the start.
    """

    unit: str | None = None
    serial: str | None = None
    last: int | None = None
    with_points: bool = False
    exact: bool = False
    answered: bool = False
    since: str | None = None
    state: MeasurementState | None = None
    search: str | None = None

    def asked(self, connection: sa.Connection, query: str, which: str = "") -> sa.CursorResult[Any]:
        """Ask a query that has a place for the conditions; they are such as an index serves."""
        values: dict[str, Any] = {"last": _ALL if self.last is None else self.last}
        kinds, conditions = [], []
        if self.unit is not None:
            names = [self.unit]
            if not self.exact:
                folded = self.unit.casefold()
                names = [name for name in unit_names(connection) if name.casefold() == folded]
            values |= {f"name{place}": name for place, name in enumerate(names)}
            places = ", ".join(f":name{place}" for place in range(len(names)))
            kinds.append(f"name IN ({places})" if names else "1 = 0")
        if self.serial is not None:
            values["serial"] = self.serial
            kinds.append("serial = :serial")
        if kinds:
            conditions.append(f"m.unit_id IN (SELECT id FROM units WHERE {' AND '.join(kinds)})")
        if self.with_points:
            conditions.append("m.points > 0")
        if self.answered:
            conditions.append(_ANSWERED)
        for column, condition, value in (
            ("started", ">=", self.since),
            ("state", "=", self.state),
        ):
            if value is not None:
                values[column] = value
                conditions.append(f"m.{column} {condition} :{column}")
        for place, word in enumerate((self.search or "").split(None, _MOST_WORDS - 1)):
            values[f"word{place}"] = f"%{_literal(word.lower())}%"
            condition = _ON_DAY if _DAY.search(word) else _HAS_WORD
            conditions.append(condition.format(word=f":word{place}"))
        where = f"WHERE {' AND '.join(conditions)}" if conditions else ""
        return connection.execute(sa.text(query.format(where=where, which=which)), values)


def read_lines(connection: sa.Connection, choice: Choice) -> Iterator[HistoryLine]:
    """Measurements as a list shows them, oldest first.

    Raises
    ------
    ValueError
        If a row holds what no measurement has.
    """
    levels: dict[str, tuple[float, ...]] = {}
    for row in choice.asked(connection, _LINES):
        if row.levels not in levels:
            # Most measurements share a plan.
            levels.clear()
            levels[row.levels] = _levels(row.levels)
        yield HistoryLine(
            id=whole(row.id),
            unit=text(row.unit, LONGEST_NAME),
            serial=text(row.serial, LONGEST_NAME),
            started=moment(row.started),
            ended=None if row.ended is None else moment(row.ended),
            state=state_of(row.state),
            source_state=SourceState(row.source_state),
            points=whole(row.points),
            flagged=whole(row.flagged),
            planned=whole(row.planned),
            levels_vpk=levels[row.levels],
            simulated=bool(row.simulated),
            operator=text(row.operator, LONGEST_NAME),
            notes=text(row.notes),
            corrections=whole(row.corrections),
            estimate=_answer(row.e_made, row.e_software, row.e_edition, row.e_summary),
            diagnosis=_answer(row.d_made, row.d_software, row.d_edition, row.d_summary),
        )


def count_lines(connection: sa.Connection, choice: Choice) -> int:
    """How many measurements are meant."""
    return int(choice.asked(connection, _COUNT).scalar_one())


def read_lacking(
    connection: sa.Connection, choice: Choice, edition: str | None = None
) -> list[int]:
    """Complete measurements without an estimate in force.

    Parameters
    ----------
    edition
        Count what failed, or is of another edition than this, as none.
    """
    if edition is None:
        rows = choice.asked(connection, _LACKING, " AND e.id IS NULL")
        return [whole(row.id) for row in rows]
    found = []
    for row in choice.asked(connection, _LACKING):
        if row.estimate is None or row.edition != edition or _failed(row.summary):
            found.append(whole(row.id))
    return found


def _failed(summary: object) -> bool:
    try:
        found = parse_json(text(summary, _LONGEST_SUMMARY))
    except ValueError:
        return False
    return isinstance(found, dict) and found.get("failed") is not None


def unit_names(connection: sa.Connection) -> list[str]:
    """Names of the units that were measured, each once, by the alphabet."""
    query = f"SELECT DISTINCT name FROM units ORDER BY name LIMIT {_MOST_NAMES}"
    return [text(row.name, LONGEST_NAME) for row in connection.execute(sa.text(query))]


def _literal(word: str) -> str:
    """A word in which nothing stands for other text."""
    return re.sub(r"([|%_])", r"|\1", word)


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
