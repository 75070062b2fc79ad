"""The layout of a bench's history file, and how an older file is brought up to it.

Owns the tables, their versions and the marks by which a file is recognised as
ours. It never reads or writes a measurement, and never changes a file that a
newer program wrote.
"""

from __future__ import annotations

import sqlalchemy as sa

from daq.errors import FileFormatError

__all__ = [
    "APPLICATION_ID",
    "SCHEMA_VERSION",
    "estimates",
    "events",
    "instruments",
    "measurements",
    "migrate",
    "plans",
    "points",
    "schema_version",
    "units",
]

APPLICATION_ID = 0x4C534842
"""Mark in the file's header ("LSHB"): this SQLite file is a history of lashbench."""

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
)

SCHEMA_VERSION = len(_STEPS)
"""Version of the layout that this program writes."""

_metadata = sa.MetaData()

units = sa.Table(
    "units",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("name", sa.Text),
    sa.Column("serial", sa.Text),
)
instruments = sa.Table(
    "instruments",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("maker", sa.Text),
    sa.Column("model", sa.Text),
    sa.Column("serial", sa.Text),
    sa.Column("revision", sa.Text),
    sa.Column("options", sa.JSON),
    sa.Column("simulated", sa.Boolean),
)
plans = sa.Table(
    "plans",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("document", sa.Text),
)
measurements = sa.Table(
    "measurements",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("unit_id", sa.Integer),
    sa.Column("plan_id", sa.Integer),
    sa.Column("instrument_id", sa.Integer),
    sa.Column("address", sa.Text),
    sa.Column("state", sa.Text),
    sa.Column("source_state", sa.Text),
    sa.Column("started", sa.Text),
    sa.Column("ended", sa.Text),
    sa.Column("software", sa.Text),
    sa.Column("operator", sa.Text),
    sa.Column("notes", sa.Text),
    sa.Column("configurations", sa.JSON),
    sa.Column("readback", sa.JSON),
)
points = sa.Table(
    "points",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("measurement_id", sa.Integer),
    sa.Column("source_vpk", sa.REAL),
    sa.Column("requested_hz", sa.REAL),
    sa.Column("frequency_hz", sa.REAL),
    sa.Column("gain_re", sa.REAL),
    sa.Column("gain_im", sa.REAL),
    sa.Column("gain_std_db", sa.REAL),
    sa.Column("phase_std_deg", sa.REAL),
    sa.Column("variance_1", sa.REAL),
    sa.Column("variance_2", sa.REAL),
    sa.Column("flags", sa.Integer),
    sa.Column("detail", sa.JSON),
    sa.Column("taken", sa.Text),
    sa.Column("superseded_by", sa.Integer),
)
events = sa.Table(
    "events",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("measurement_id", sa.Integer),
    sa.Column("time", sa.Text),
    sa.Column("kind", sa.Text),
    sa.Column("text", sa.Text),
    sa.Column("data", sa.JSON),
)
estimates = sa.Table(
    "estimates",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("measurement_id", sa.Integer),
    sa.Column("made", sa.Text),
    sa.Column("software", sa.Text),
    sa.Column("document", sa.JSON),
)


def schema_version(connection: sa.Connection, name: str) -> int:
    """Version of the layout of an open file; 0 if it is empty.

    Raises
    ------
    FileFormatError
        If the file belongs to another program, or to a newer version of this one.
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
    return version


def migrate(connection: sa.Connection, version: int) -> None:
    """Run the steps after `version`; the caller's transaction makes it all or nothing."""
    for step in _STEPS[version:]:
        for statement in step:
            connection.exec_driver_sql(statement)
    connection.exec_driver_sql(f"PRAGMA application_id = {APPLICATION_ID}")
    connection.exec_driver_sql(f"PRAGMA user_version = {SCHEMA_VERSION}")
