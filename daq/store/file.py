"""Opening the SQLite file of a bench's history, and saying plainly what is wrong with it.

Owns the connection settings on which "committed means kept" rests: a
write-ahead log, which outlives any death of the program and, whatever happens,
leaves a file that is whole. That the log reaches the disk soon after each
commit is `daq.store.flush`'s part. It knows no tables.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import sqlalchemy as sa
from sqlalchemy import event
from sqlalchemy.exc import DBAPIError
from sqlalchemy.pool import QueuePool

from daq.errors import FileFormatError, InputError, LashbenchError, MeasurementError
from daq.store.open_histories import OPENING, closed, is_open, opened
from daq.store.schema import SCHEMA_VERSION, lay_over, migrate, schema_version
from daq.store.sqlite_files import check_beside

__all__ = ["engine_of", "log_of", "open_engine", "telling_faults"]

_MAGIC = b"SQLite format 3\x00"
_BUSY_S = 5.0
WRITES = "lashbench_writes"
_MOST_BYTES = 8 << 20
"""Bytes of one value or statement: a plan of 100,000 points has two million."""
_HEAP_BYTES = 128 << 20
"""Memory that SQLite may take in this process, whatever a file makes it do; it needs a few MiB."""
_CHECKED_BYTES = 32 << 20
"""Size up to which a file is checked whole when it is opened, which takes 0.1 s; above it, what
is read is checked as it is read."""


def open_engine(path: Path, *, create: bool, read_only: bool) -> sa.Engine:
    """Open a history, checked whole; an older one is brought up to date if it may be written.

    Raises
    ------
    InputError
        If there is no such file, or it may not be read or written.
    FileFormatError
        If the file is not a history, is damaged, or is newer than this program.
    """
    with OPENING:
        exists = _check_place(path, create=create, read_only=read_only)
        if not is_open(str(_behind_links(path))):
            check_beside(_behind_links(path))
        mode = _mode(path, exists, read_only)
        engine = engine_of(path, mode=mode)
        try:
            with telling_faults(path):
                version = _check_content(engine, path, create=create, read_only=read_only)
        except BaseException:
            engine.dispose()
            raise
    if version == SCHEMA_VERSION:
        return engine
    engine.dispose()
    return engine_of(path, mode=mode, older=version)


def engine_of(path: Path, mode: str, older: int | None = None) -> sa.Engine:
    """An engine on a file in one of SQLite's URI modes; nothing is opened yet.

    Parameters
    ----------
    older
        Version of an older layout that is to be read as if it were of this one.
    """
    file = _behind_links(path)
    uri, takes_locks = f"{file.as_uri()}?{mode}", "immutable" not in mode

    def connect() -> sqlite3.Connection:
        # The driver's own transaction handling commits before DDL; ours begins by hand.
        connection = sqlite3.connect(
            uri, uri=True, timeout=_BUSY_S, isolation_level=None, check_same_thread=False
        )
        if takes_locks:
            opened(str(file))
        return connection

    engine = sa.create_engine("sqlite://", creator=connect, poolclass=QueuePool, pool_size=4)

    @event.listens_for(engine, "connect")
    def _settle(connection: sqlite3.Connection, _record: object) -> None:
        # Before the first statement, which reads the layout that a file claims to have.
        for kind in (sqlite3.SQLITE_LIMIT_LENGTH, sqlite3.SQLITE_LIMIT_SQL_LENGTH):
            connection.setlimit(kind, _MOST_BYTES)
        for kind in (sqlite3.SQLITE_LIMIT_ATTACHED, sqlite3.SQLITE_LIMIT_TRIGGER_DEPTH):
            connection.setlimit(kind, 0)
        connection.execute(f"PRAGMA hard_heap_limit = {_HEAP_BYTES}")
        connection.execute("PRAGMA trusted_schema = OFF")
        connection.execute("PRAGMA cell_size_check = ON")
        connection.execute("PRAGMA synchronous = NORMAL")
        connection.execute("PRAGMA foreign_keys = ON")
        # SQLite's own leaves all but ASCII as it is.
        connection.create_function("lower", 1, _lower, deterministic=True)
        if older is not None:
            lay_over(connection, older)

    @event.listens_for(engine, "close")
    def _leave(_connection: sqlite3.Connection, _record: object) -> None:
        if takes_locks:
            closed(str(file))

    @event.listens_for(engine, "begin")
    def _begin(connection: sa.Connection) -> None:
        writes = connection.get_execution_options().get(WRITES, False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def log_of(path: Path) -> Path:
    """The write-ahead log of a history: beside the file itself, wherever a link to it lies."""
    file = _behind_links(path)
    return file.with_name(file.name + "-wal")


@contextmanager
def telling_faults(path: Path) -> Iterator[None]:
    """Turn what SQLite says into one line that names the file and what to do.

    Raises
    ------
    MeasurementError
        If the disk is full or fails, or another program holds the file.
    InputError
        If the file may not be read or written.
    FileFormatError
        If the file is damaged or is no database.
    """
    try:
        yield
    except (DBAPIError, sqlite3.Error) as error:
        raise _plain(path, error) from error
    except MemoryError as error:
        raise FileFormatError(
            f"{path}: takes more memory than a history can; restore a copy"
        ) from error
    except UnicodeDecodeError as error:
        # SQLite quotes damaged text in its complaint, which then cannot be decoded.
        raise FileFormatError(f"{path}: is damaged (text that is not UTF-8)") from error


def _behind_links(path: Path) -> Path:
    # Unlike `Path.resolve`, this leaves links that go in a circle to whoever opens them.
    return Path(os.path.realpath(path))


def _plain(path: Path, error: DBAPIError | sqlite3.Error) -> LashbenchError:
    origin = error.orig if isinstance(error, DBAPIError) else error
    # The low byte of the extended code is the kind of fault.
    code = (getattr(origin, "sqlite_errorcode", None) or 0) & 0xFF
    cause = " ".join(str(origin).split())
    if code in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR):
        return MeasurementError(
            f"{path}: the disk refused the data ({cause}); what was committed is kept, make room"
        )
    if code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
        return MeasurementError(
            f"{path}: held by another program for more than {_BUSY_S:g} s; close that one"
        )
    if code in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM):
        return InputError(f"{path}: may not be opened or written here ({cause})")
    if code in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB):
        return FileFormatError(f"{path}: is damaged ({cause}); restore a copy, nothing was changed")
    return FileFormatError(f"{path}: does not hold what a history must ({cause})")


def _check_place(path: Path, *, create: bool, read_only: bool) -> bool:
    if os.path.isdir(path):
        raise InputError(f"{path}: is a directory; give the file of a history")
    try:
        if os.path.exists(path) and not os.path.isfile(path):
            raise InputError(f"{path}: is not a regular file; give the file of a history")
        if is_open(os.path.realpath(path)):
            return True
        if os.path.isfile(path) and path.stat().st_size > 0:
            with path.open("rb") as file:
                if file.read(len(_MAGIC)) != _MAGIC:
                    raise FileFormatError(f"{path}: is not a history (no SQLite file)")
            if not read_only:
                with path.open("r+b"):
                    pass
            return True
    except OSError as error:
        raise InputError(f"{path}: may not be used ({error.strerror or error})") from error
    if not create:
        raise InputError(f"{path}: there is no history; measure first, or give its file")
    if not os.path.isdir(path.parent):
        raise InputError(f"{path}: there is no directory {path.parent}; make it first")
    return False


def _mode(path: Path, exists: bool, read_only: bool) -> str:
    if not read_only:
        return "mode=rw" if exists else "mode=rwc"
    # A log beside the file must be taken into account, which needs the shared
    # memory file; without a log the file alone is the whole truth, and can be
    # read even where nothing may be written.
    try:
        logged = log_of(path).stat().st_size > 0
    except FileNotFoundError:
        # Asked once only: whoever wrote may close the file, and remove its log, at any moment.
        logged = False
    return "mode=ro" if logged else "mode=ro&immutable=1"


def _check_content(engine: sa.Engine, path: Path, *, create: bool, read_only: bool) -> int:
    """Version of the layout; that of this program, unless the file may only be read."""
    with engine.connect() as connection:
        # First: a check evaluates what the layout says.
        version = schema_version(connection, str(path))
        if not os.path.exists(path) or path.stat().st_size <= _CHECKED_BYTES:
            fault = connection.exec_driver_sql("PRAGMA quick_check(1)").scalar_one()
        else:
            fault = _length_fault(connection, path)
        if fault != "ok":
            first = " ".join(fault.split())
            raise FileFormatError(
                f"{path}: is damaged ({first}); restore a copy, nothing was changed"
            )
    if not read_only and (version or create):
        # Only now: it alters the file, which must be ours.
        with closing(engine.raw_connection()) as raw, closing(raw.cursor()) as cursor:
            cursor.execute("PRAGMA journal_mode = WAL")
    if version == 0 and not create:
        raise FileFormatError(f"{path}: is empty, no history")
    if version == SCHEMA_VERSION or read_only:
        return version
    with engine.execution_options(**{WRITES: True}).begin() as connection:
        # Asked again under the lock: another program may have been first.
        migrate(connection, schema_version(connection, str(path)))
    return SCHEMA_VERSION


def _length_fault(connection: sa.Connection, path: Path) -> str:
    """Whether a file without a log ends before its last page, as one that was cut does."""
    pages, size = (
        int(connection.exec_driver_sql(f"PRAGMA {name}").scalar_one())
        for name in ("page_count", "page_size")
    )
    if not os.path.exists(log_of(path)) and path.stat().st_size < pages * size:
        return f"{path.stat().st_size} bytes of {pages * size}"
    return "ok"


_Stored = str | bytes | int | float | None
"""What SQLite keeps."""


def _lower(value: _Stored) -> _Stored:
    """Text in small letters; anything else, which a damaged file may hold, as it is."""
    return value.lower() if isinstance(value, str) else value
