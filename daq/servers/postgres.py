"""Opening a history on a PostgreSQL server, and saying plainly what is wrong with it.

Owns the connection settings on which "committed means kept" and bounded waits rest, and the claim
on a measurement under way. No message of it holds a password. It knows no records.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import sqlalchemy as sa
from sqlalchemy import event
from sqlalchemy.exc import ArgumentError, DBAPIError

from daq.errors import ConfigurationError, FileFormatError, InputError, LashbenchError, LinkError
from daq.errors import MeasurementError as BenchError
from daq.servers.layout import LAYOUT, MAKE, SCHEMA
from daq.servers.place import HistoryServer

__all__ = ["claim_measurement", "open_server", "telling_server_faults"]

_CONNECT_S = 5
_LOCK_S = 5
_SILENT_MS = 8000
"""How long what was sent may stay unacknowledged; a session gives a history 10 s."""
_KEY = 0x6C617368
"""Of this program's advisory locks."""
_MAKING = 0

_REFUSED = ("28", "3D", "42501", "25006")
"""Conditions that another address, user or right mends: password, database, privilege."""
_FULL = ("53", "58")
_ABSENT = ("42P01", "3F000", "42703")


def open_server(place: HistoryServer, *, create: bool, read_only: bool) -> sa.Engine:
    """Open a history; it is made in an empty database with `create`.

    Raises
    ------
    ConfigurationError
        If the driver is not installed.
    InputError
        If user, password, database or rights are refused, or there is no history.
    LinkError
        If the server is away.
    FileFormatError
        If the history is of another version of this program.
    """
    try:
        import psycopg  # noqa: F401
    except ImportError as error:
        raise ConfigurationError(
            f"{place}: needs psycopg; install it with pip install 'lashbench[postgres]'"
        ) from error
    engine = _engine(place, read_only)
    try:
        with telling_server_faults(place):
            version = _version(engine)
            if version is None and create and not read_only:
                version = _make(engine)
    except BenchError as error:
        engine.dispose()
        raise LinkError(str(error)) from None
    except BaseException:
        engine.dispose()
        raise
    if version == LAYOUT:
        return engine
    engine.dispose()
    if version is None:
        raise InputError(f"{place}: there is no history in that database; measure first")
    newer = version > LAYOUT
    raise FileFormatError(
        f"{place}: has layout {version}, this lashbench knows {LAYOUT}; nothing was changed, "
        f"{'update lashbench' if newer else 'use the lashbench that made it'}"
    )


def claim_measurement(place: HistoryServer, engine: sa.Engine, measurement: int) -> sa.Connection:
    """Hold a measurement for as long as the connection is open: no other bench goes on with it.

    Raises
    ------
    MeasurementError
        If another session has it.
    """
    with telling_server_faults(place):
        connection = engine.execution_options(isolation_level="AUTOCOMMIT").connect()
        query = sa.select(sa.func.pg_try_advisory_lock(_KEY, measurement))
        if connection.execute(query).scalar_one():
            return connection
        connection.close()
    raise BenchError(
        f"{place}: another session is measuring {measurement}; wait for it to end, or stop it"
    )


@contextmanager
def telling_server_faults(place: HistoryServer) -> Iterator[None]:
    """Turn what the server or its driver says into one line with what to do.

    Raises
    ------
    MeasurementError
        If the server is away, full, or another transaction holds what is needed.
    InputError
        If it refuses user, password, database or rights.
    FileFormatError
        If what is there is no history.
    """
    try:
        yield
    except DBAPIError as error:
        raise _plain(place, error) from None
    except UnicodeEncodeError as error:
        raise InputError(f"{place}: a text that is not UTF-8 cannot be kept") from error


def _engine(place: HistoryServer, read_only: bool) -> sa.Engine:
    try:
        url = sa.make_url(place.shown).set(drivername="postgresql+psycopg")
    except (ArgumentError, ValueError):
        raise InputError(f"{place}: cannot be read as an address of a server") from None
    # On Linux what is sent and not acknowledged ends the connection.
    options: dict[str, Any] = {
        "connect_timeout": _CONNECT_S,
        "tcp_user_timeout": _SILENT_MS,
        "keepalives_idle": 5,
        "keepalives_interval": 2,
        "keepalives_count": 3,
        "application_name": "lashbench",
        "options": f"-c lock_timeout={_LOCK_S}s -c search_path={SCHEMA}",
    }
    if place.password is not None:
        options["password"] = place.password
    options = {name: value for name, value in options.items() if name not in url.query}
    engine = sa.create_engine(
        url, connect_args=options, pool_size=4, pool_pre_ping=True, hide_parameters=True
    )

    @event.listens_for(engine, "connect")
    def _settle(connection: Any, _record: object) -> None:
        # A committed point is on the server's disk, whatever the server is set to.
        with connection.cursor() as cursor:
            cursor.execute("SET synchronous_commit = on")
        connection.commit()

    if read_only:
        # As with a file: what is read within one act is of one moment.
        return engine.execution_options(isolation_level="REPEATABLE READ", postgresql_readonly=True)
    return engine


def _version(engine: sa.Engine) -> int | None:
    """Layout of the history; None if there is none."""
    with engine.connect() as connection:
        there = sa.text("SELECT to_regclass(:name)")
        if connection.execute(there, {"name": f"{SCHEMA}.layout"}).scalar_one() is None:
            return None
        found = connection.execute(sa.text(f"SELECT version FROM {SCHEMA}.layout"))
        return int(found.scalar_one())


def _make(engine: sa.Engine) -> int:
    with engine.begin() as connection:
        # Two benches may begin at the same moment.
        connection.execute(sa.select(sa.func.pg_advisory_xact_lock(_KEY, _MAKING)))
        made = connection.execute(
            sa.text("SELECT 1 FROM pg_namespace WHERE nspname = :name"), {"name": SCHEMA}
        ).scalar_one_or_none()
        if made is None:
            for statement in MAKE:
                connection.exec_driver_sql(statement)
    return LAYOUT


def _plain(place: HistoryServer, error: DBAPIError) -> LashbenchError:
    state = getattr(error.orig, "sqlstate", None) or ""
    said = " ".join(str(error.orig).split())[:300]
    if place.password:
        said = said.replace(place.password, "***")
    if "NUL (0x00)" in said:
        return InputError(f"{place}: a text with the character NUL cannot be kept")
    if state.startswith(_REFUSED) or "password" in said or "does not exist" in said and not state:
        return InputError(f"{place}: refused ({said}); check user, password, database and rights")
    if state.startswith(_ABSENT):
        return FileFormatError(f"{place}: does not hold what a history must ({said})")
    if state == "55P03":
        return BenchError(
            f"{place}: held by another program for more than {_LOCK_S} s; close that one"
        )
    if state.startswith(_FULL):
        return BenchError(
            f"{place}: the server refused the data ({said}); what was committed is kept"
        )
    if not state or state.startswith(("08", "57")):
        return BenchError(
            f"{place}: the server does not answer ({said}); what was committed is kept, look at "
            "server and network"
        )
    return FileFormatError(f"{place}: does not hold what a history must ({said})")
