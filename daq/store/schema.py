"""The layout of a bench's history file, and how an older file is brought up to it.

Owns the versions of the layout and the marks by which a file is recognised as
ours. It never reads or writes a measurement, and never changes a file that a
newer program wrote.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing
from functools import cache

import sqlalchemy as sa

from daq.errors import FileFormatError

__all__ = ["APPLICATION_ID", "SCHEMA_VERSION", "lay_over", "migrate", "schema_version"]

APPLICATION_ID = 0x4C534842
"""Mark in the file's header ("LSHB"): this SQLite file is a history of lashbench."""

_READABLE = "typeof({0}) = 'text' AND json_valid({0})"
_DOCUMENT = _READABLE.format("document")
_PLANNED = f"""CASE WHEN {_DOCUMENT} THEN coalesce(
    json_array_length(document, '$.frequencies_hz') * json_array_length(document, '$.levels_vpk'),
    0) ELSE 0 END"""
_LEVELS = f"""CASE WHEN {_DOCUMENT}
    THEN coalesce(json_extract(document, '$.levels_vpk'), '[]') ELSE '[]' END"""
_LIVE = "FROM points WHERE measurement_id = measurements.id AND superseded_by IS NULL"
_IN_FORCE = f"(SELECT count(*) {_LIVE})"
# 8 is `PointFlag.RETAKEN`: a point that was merely taken a second time is as good as any.
_FLAGGED = f"(SELECT coalesce(sum(flags & ~8 <> 0), 0) {_LIVE})"
# Layouts 1 and 2 knew no version of the points and ordered by the clock, which may have been
# ahead. What no later session can have overtaken is of the points in force; else nobody knows.
_REPLACED = "SELECT measurement_id FROM points WHERE superseded_by IS NOT NULL"
_OLD_VERSION = f"""CASE WHEN {_DOCUMENT} AND EXISTS (
    SELECT 1 FROM measurements AS m WHERE m.id = estimates.measurement_id
        AND m.ended IS NOT NULL AND estimates.made > m.ended
        AND m.id NOT IN ({_REPLACED})
        AND NOT EXISTS (SELECT 1 FROM events AS v
            WHERE v.measurement_id = m.id AND v.kind = 'resume')) THEN 0 END"""
_OLD_SUMMARY = f"""CASE WHEN {_DOCUMENT} THEN json_object(
    'contribution_ratio', json_extract(document, '$.contribution_ratio'),
    'b1_deg', json_extract(document, '$.b1_deg'), 'b2_deg', json_extract(document, '$.b2_deg'),
    'b_t_deg', json_extract(document, '$.b_t_deg'),
    'warnings', json_extract(document, '$.warnings'),
    'failed', json_extract(document, '$.failed')) ELSE '{{}}' END"""

# A step is the SQL that leads from the version before to its own. Steps are
# frozen once released: a new file runs through all of them, as an old one does,
# so that the two cannot differ.
_STEPS: tuple[tuple[str, ...], ...] = (
    (
        """CREATE TABLE units (
            id INTEGER PRIMARY KEY,
            name TEXT NOT NULL,
            serial TEXT NOT NULL,
            UNIQUE (name, serial))""",
        """CREATE TABLE instruments (
            id INTEGER PRIMARY KEY,
            maker TEXT NOT NULL,
            model TEXT NOT NULL,
            serial TEXT NOT NULL,
            revision TEXT NOT NULL,
            options TEXT NOT NULL,
            simulated INTEGER NOT NULL,
            UNIQUE (maker, model, serial, revision, options, simulated))""",
        """CREATE TABLE plans (
            id INTEGER PRIMARY KEY,
            document TEXT NOT NULL UNIQUE)""",
        """CREATE TABLE measurements (
            id INTEGER PRIMARY KEY AUTOINCREMENT,
            unit_id INTEGER NOT NULL REFERENCES units (id),
            plan_id INTEGER NOT NULL REFERENCES plans (id),
            instrument_id INTEGER REFERENCES instruments (id),
            address TEXT NOT NULL,
            state TEXT NOT NULL CHECK (state IN ('complete', 'interrupted', 'aborted')),
            source_state TEXT NOT NULL,
            started TEXT NOT NULL,
            ended TEXT,
            software TEXT NOT NULL,
            operator TEXT NOT NULL,
            notes TEXT NOT NULL,
            configurations TEXT NOT NULL,
            readback TEXT NOT NULL)""",
        """CREATE TABLE points (
            id INTEGER PRIMARY KEY,
            measurement_id INTEGER NOT NULL REFERENCES measurements (id),
            source_vpk REAL NOT NULL,
            requested_hz REAL NOT NULL,
            frequency_hz REAL NOT NULL,
            gain_re REAL,
            gain_im REAL,
            gain_std_db REAL,
            phase_std_deg REAL,
            variance_1 REAL,
            variance_2 REAL,
            flags INTEGER NOT NULL,
            detail TEXT NOT NULL,
            taken TEXT NOT NULL,
            superseded_by INTEGER REFERENCES points (id) DEFERRABLE INITIALLY DEFERRED)""",
        """CREATE UNIQUE INDEX points_live
            ON points (measurement_id, source_vpk, requested_hz) WHERE superseded_by IS NULL""",
        """CREATE TABLE events (
            id INTEGER PRIMARY KEY,
            measurement_id INTEGER NOT NULL REFERENCES measurements (id),
            time TEXT NOT NULL,
            kind TEXT NOT NULL,
            text TEXT NOT NULL,
            data TEXT NOT NULL)""",
        "CREATE INDEX events_of ON events (measurement_id)",
    ),
    (
        """CREATE TABLE estimates (
            id INTEGER PRIMARY KEY,
            measurement_id INTEGER NOT NULL REFERENCES measurements (id),
            made TEXT NOT NULL,
            software TEXT NOT NULL,
            document TEXT NOT NULL)""",
        "CREATE INDEX estimates_of ON estimates (measurement_id)",
    ),
    (
        "CREATE INDEX points_replaced ON points (measurement_id) WHERE superseded_by IS NOT NULL",
        "CREATE INDEX measurements_of ON measurements (unit_id)",
        "ALTER TABLE plans ADD COLUMN points INTEGER NOT NULL DEFAULT 0",
        "ALTER TABLE plans ADD COLUMN levels TEXT NOT NULL DEFAULT '[]'",
        f"UPDATE plans SET points = {_PLANNED}, levels = {_LEVELS}",
        "ALTER TABLE measurements ADD COLUMN points INTEGER NOT NULL DEFAULT 0",
        "ALTER TABLE measurements ADD COLUMN flagged INTEGER NOT NULL DEFAULT 0",
        "ALTER TABLE measurements ADD COLUMN points_version INTEGER NOT NULL DEFAULT 0",
        f"UPDATE measurements SET points = {_IN_FORCE}, flagged = {_FLAGGED}",
        "ALTER TABLE estimates ADD COLUMN points_version INTEGER",
        "ALTER TABLE estimates ADD COLUMN physics TEXT NOT NULL DEFAULT ''",
        "ALTER TABLE estimates ADD COLUMN edition TEXT NOT NULL DEFAULT ''",
        "ALTER TABLE estimates ADD COLUMN elapsed_s REAL",
        "ALTER TABLE estimates ADD COLUMN summary TEXT NOT NULL DEFAULT '{}'",
        f"UPDATE estimates SET points_version = {_OLD_VERSION}, summary = {_OLD_SUMMARY}",
        """CREATE TABLE diagnoses (
            id INTEGER PRIMARY KEY,
            measurement_id INTEGER NOT NULL REFERENCES measurements (id),
            made TEXT NOT NULL,
            software TEXT NOT NULL,
            document TEXT NOT NULL,
            physics TEXT NOT NULL,
            as_measured INTEGER NOT NULL,
            edition TEXT NOT NULL,
            elapsed_s REAL,
            summary TEXT NOT NULL)""",
        "CREATE INDEX diagnoses_of ON diagnoses (measurement_id)",
        """CREATE TABLE diagnosed_points (
            diagnosis_id INTEGER NOT NULL REFERENCES diagnoses (id),
            measurement_id INTEGER NOT NULL REFERENCES measurements (id),
            points_version INTEGER NOT NULL,
            PRIMARY KEY (diagnosis_id, measurement_id)) WITHOUT ROWID""",
        """CREATE TABLE corrections (
            id INTEGER PRIMARY KEY,
            measurement_id INTEGER NOT NULL REFERENCES measurements (id),
            time TEXT NOT NULL,
            person TEXT NOT NULL,
            field TEXT NOT NULL CHECK (field IN ('serial', 'operator', 'notes')),
            old TEXT NOT NULL,
            new TEXT NOT NULL)""",
        "CREATE INDEX corrections_of ON corrections (measurement_id)",
    ),
)

SCHEMA_VERSION = len(_STEPS)
"""Version of the layout that this program writes."""

_NO_ESTIMATES = """CREATE TEMP TABLE estimates (id, measurement_id, made, software, document,
    points_version, physics, edition, elapsed_s, summary)"""
# Looked for once: the layouts before the third have no index for it.
_FIND_REPLACED = f"CREATE TEMP TABLE replaced AS SELECT DISTINCT * FROM ({_REPLACED})"
_FOUND_VERSION = _OLD_VERSION.replace(_REPLACED, "SELECT measurement_id FROM replaced")
_OLD_ESTIMATES = f"""CREATE TEMP VIEW estimates AS SELECT *, {_FOUND_VERSION} AS points_version,
    '' AS physics, '' AS edition, NULL AS elapsed_s, {_OLD_SUMMARY} AS summary
    FROM main.estimates"""
_OLD_REST = (
    f"""CREATE TEMP VIEW plans AS SELECT *, {_PLANNED} AS points, {_LEVELS} AS levels
    FROM main.plans""",
    f"""CREATE TEMP VIEW measurements AS SELECT *, {_IN_FORCE} AS points, {_FLAGGED} AS flagged,
    0 AS points_version FROM main.measurements""",
    """CREATE TEMP TABLE diagnoses (id, measurement_id, made, software, document, physics,
    as_measured, edition, elapsed_s, summary)""",
    "CREATE TEMP TABLE diagnosed_points (diagnosis_id, measurement_id, points_version)",
    "CREATE TEMP TABLE corrections (id, measurement_id, time, person, field, old, new)",
)
_LAID_OVER = {1: (_NO_ESTIMATES, *_OLD_REST), 2: (_FIND_REPLACED, _OLD_ESTIMATES, *_OLD_REST)}
"""By layout: what makes a file that may not be written look like one of this program's."""

_OF_SQLITE = {
    "sqlite_sequence": "CREATE TABLE sqlite_sequence(name,seq)",
    "sqlite_stat1": "CREATE TABLE sqlite_stat1(tbl,idx,stat)",
    "sqlite_stat4": "CREATE TABLE sqlite_stat4(tbl,idx,neq,nlt,ndlt,sample)",
}
_MOST_PARTS = 100
"""Entries of a layout that are looked at; ours has less than 40."""


def schema_version(connection: sa.Connection, name: str) -> int:
    """Version of the layout of an open file; 0 if it is empty.

    Raises
    ------
    FileFormatError
        If the file belongs to another program or to a newer version of this one, or its
        layout is any other than the one that this program makes.
    """
    mark = connection.exec_driver_sql("PRAGMA application_id").scalar_one()
    version = int(connection.exec_driver_sql("PRAGMA user_version").scalar_one())
    if mark != APPLICATION_ID:
        tables = connection.exec_driver_sql("SELECT count(*) FROM sqlite_master").scalar_one()
        if mark or version or tables:
            raise FileFormatError(f"{name}: is an SQLite file, but not a history of lashbench")
        return 0
    if version > SCHEMA_VERSION:
        raise FileFormatError(
            f"{name}: was written by a newer lashbench (layout {version}, this one knows "
            f"{SCHEMA_VERSION}); nothing was changed, update lashbench to open it"
        )
    programs = "SELECT count(*) FROM sqlite_master WHERE type IN ('view', 'trigger')"
    if connection.exec_driver_sql(programs).scalar_one():
        raise FileFormatError(f"{name}: holds views or triggers, which a history never has")
    if version < 1:
        raise FileFormatError(f"{name}: bears the mark of lashbench but no layout version")
    _check_layout(connection, version, name)
    return version


def migrate(connection: sa.Connection, version: int) -> None:
    """Run the steps after `version`; the caller's transaction makes it all or nothing."""
    for step in _STEPS[version:]:
        for statement in step:
            connection.exec_driver_sql(statement)
    connection.exec_driver_sql(f"PRAGMA application_id = {APPLICATION_ID}")
    connection.exec_driver_sql(f"PRAGMA user_version = {SCHEMA_VERSION}")


def lay_over(connection: sqlite3.Connection, version: int) -> None:
    """Make an older file look like one of this layout, to this connection alone.

    What a step would compute is computed when it is asked for; the file is not touched.
    """
    for statement in _LAID_OVER.get(version, ()):
        connection.execute(statement)


def _check_layout(connection: sa.Connection, version: int, name: str) -> None:
    """Refuse what could run, or be read otherwise than it stands: generated columns and the like.

    The text of every table and index is compared with that of the steps; nothing in the file
    has been evaluated by then.
    """
    found: dict[str, str] = {}
    query = f"SELECT name, sql FROM sqlite_master LIMIT {_MOST_PARTS}"
    for part, sql in connection.exec_driver_sql(query):
        if sql is not None or not str(part).startswith("sqlite_autoindex_"):
            found[str(part)] = _squeezed(sql)
    expected = _layout(version)
    for part, sql in found.items():
        if sql != expected.get(part, _squeezed(_OF_SQLITE.get(part))) or not sql:
            raise FileFormatError(
                f"{name}: holds {part[:40]!r} as a history never does; restore a copy"
            )
    missing = sorted(set(expected) - set(found))
    if missing:
        raise FileFormatError(f"{name}: lacks {missing[0]!r}, which a history has; restore a copy")


@cache
def _layout(version: int) -> dict[str, str]:
    """Text of every table and index of a version, by name."""
    with closing(sqlite3.connect(":memory:")) as made:
        for step in _STEPS[:version]:
            for statement in step:
                made.execute(statement)
        rows = made.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL").fetchall()
    return {name: _squeezed(sql) for name, sql in rows if name not in _OF_SQLITE}


def _squeezed(sql: object) -> str:
    """Without blanks: a copy through a dump may set other ones."""
    return "".join(sql.split()) if isinstance(sql, str) else ""
