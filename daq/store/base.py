"""An open history file: transactions, and what goes wrong in them.

Owns how a connection is used: one transaction for each act, each fault in one line,
the disk asked for what was committed. It knows no record of the program.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import sqlalchemy as sa
from sqlalchemy.dialects import sqlite
from sqlalchemy.exc import DBAPIError

from daq.errors import FileFormatError, InputError
from daq.servers.place import HistoryPlace, HistoryServer, parse_place
from daq.store import tables as table
from daq.store.file import WRITES, log_of, open_engine, telling_faults
from daq.store.flush import Flusher
from daq.store.rows import whole
from daq.store_records import LONGEST_NAME, LONGEST_TEXT

__all__ = ["StoreFile", "check_length", "inserted", "now", "shared"]


class StoreFile:
    """An open history, as `daq.store.store.Store` describes it."""

    def __init__(
        self, path: str | HistoryPlace, *, create: bool = False, read_only: bool = False
    ) -> None:
        self.path = parse_place(path) if isinstance(path, str) else path
        self._flusher: Flusher | None = None
        self._claims: dict[int, sa.Connection] = {}
        if isinstance(self.path, HistoryServer):
            from daq.servers.postgres import open_server

            # A server has what it committed on its disk.
            self._engine = open_server(self.path, create=create, read_only=read_only)
            self._writer = self._engine
            return
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

    @property
    def name(self) -> str:
        """Name of the file, or address of the server."""
        return self.path.name if isinstance(self.path, Path) else str(self.path)

    def close(self) -> None:
        """Let go of the file, which is on the disk then; may be called twice."""
        if self._flusher is not None:
            self._flusher.close()
        while self._claims:
            with suppress(DBAPIError):
                self._claims.popitem()[1].invalidate()
        self._engine.dispose()

    def _claim(self, measurement: int) -> None:
        """Keep other benches from going on with a measurement, where they share the history."""
        if isinstance(self.path, HistoryServer) and measurement not in self._claims:
            from daq.servers.postgres import claim_measurement

            claim = claim_measurement(self.path, self._engine, measurement)
            self._claims[measurement] = claim

    def _faults(self) -> AbstractContextManager[None]:
        if isinstance(self.path, HistoryServer):
            from daq.servers.postgres import telling_server_faults

            return telling_server_faults(self.path)
        return telling_faults(self.path)

    @contextmanager
    def _writing(self) -> Iterator[sa.Connection]:
        with self._faults(), self._writer.begin() as connection:
            yield connection
        if self._flusher is not None:
            self._flusher.soon()

    @contextmanager
    def _reading(self) -> Iterator[sa.Connection]:
        with self._faults(), self._engine.begin() as connection, self._legible():
            yield connection

    @contextmanager
    def _legible(self) -> Iterator[None]:
        """Say in one line that a record is none that this program wrote."""
        try:
            yield
        except (ValueError, TypeError, KeyError, OverflowError) as error:
            # What was stored may stand in it, line ends and all.
            told = " ".join(str(error).split())
            raise FileFormatError(
                f"{self.path}: holds a record that cannot be read ({told[:200]}); restore a copy"
            ) from error

    def _update(self, connection: sa.Connection, measurement: int, **values: Any) -> None:
        columns = table.measurements.c
        done = connection.execute(
            sa.update(table.measurements).where(columns.id == measurement).values(values)
        )
        if done.rowcount != 1:
            raise self._unknown(measurement)

    def _unknown(self, measurement: int) -> InputError:
        return InputError(
            f"measurement {measurement} is not in {self.path}; `history` lists those that are"
        )

    @staticmethod
    def _versions(connection: sa.Connection, measurements: Sequence[int]) -> dict[int, int]:
        columns = table.measurements.c
        query = sa.select(columns.id, columns.points_version).where(columns.id.in_(measurements))
        return {row.id: whole(row.points_version) for row in connection.execute(query)}


def now() -> str:
    """The present moment, ISO 8601, UTC."""
    return datetime.now(UTC).isoformat(timespec="microseconds")


def inserted(connection: sa.Connection, where: sa.Table, row: Mapping[str, Any]) -> int:
    """Add a row; its key."""
    key = connection.execute(sa.insert(where).values(row)).inserted_primary_key
    assert key is not None
    return int(key[0])


def shared(
    connection: sa.Connection, where: sa.Table, row: Mapping[str, Any], by: str | None = None
) -> int:
    """The key of a row that others refer to, too; it is added if it is not there.

    Parameters
    ----------
    by
        The column by which it is told from others; all that are given, if left out.
    """
    # Written before it is read: a transaction that reads first could lose the
    # race for the write lock to another program.
    insert: Any = sqlite.insert
    if connection.dialect.name == "postgresql":
        from sqlalchemy.dialects import postgresql

        insert = postgresql.insert
    connection.execute(insert(where).values(row).on_conflict_do_nothing())
    names = row if by is None else (by,)
    same = [where.c[name] == row[name] for name in names]
    return int(connection.execute(sa.select(where.c.id).where(*same)).scalar_one())


def check_length(name: str, value: str) -> None:
    """Raise an InputError if a text is longer than a history holds."""
    longest = LONGEST_TEXT if name == "notes" else LONGEST_NAME
    if len(value) > longest:
        raise InputError(f"{name} has {len(value)} characters; a history holds up to {longest}")
