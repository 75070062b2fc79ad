"""Where a history is: a file, or a database on a server.

Owns the address of a server and its form without the password, which is the only one that is ever
shown, logged or handed to another program's command line. It connects to nothing.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import SplitResult, unquote, urlsplit, urlunsplit

from daq.errors import InputError

__all__ = [
    "FORM",
    "HistoryPlace",
    "HistoryServer",
    "files_of",
    "is_there",
    "parse_place",
    "whole_name",
]

FORM = "postgresql://USER@HOST:PORT/DATABASE"
_SCHEMES = ("postgresql", "postgres")


@dataclass(frozen=True, slots=True)
class HistoryServer:
    """A database on a PostgreSQL server.

    Parameters
    ----------
    shown
        Address without a password.
    password
        As it was given; None where libpq's own places are asked (PGPASSWORD, ~/.pgpass).
    """

    shown: str
    password: str | None = field(default=None, repr=False, compare=False)

    def __str__(self) -> str:
        return self.shown


HistoryPlace = Path | HistoryServer
"""A history's file, or its server."""


def parse_place(text: str) -> HistoryPlace:
    """Read what ``--db`` names.

    Raises
    ------
    InputError
        If it is an address of a server that cannot be read; no part of it is repeated.
    """
    scheme, separator, _ = text.partition("://")
    if not separator or "/" in scheme or os.path.exists(text):
        return Path(text)
    if scheme not in _SCHEMES:
        raise InputError(f"--db {scheme}://... is no history; give a file or {FORM}")
    try:
        parts = urlsplit(text)
        port = parts.port
    except ValueError:
        parts, port = SplitResult("", "", "", "", ""), None
    name = parts.path.removeprefix("/")
    if not name or "/" in name or parts.fragment or not text.isprintable() or port == 0:
        raise InputError(
            f"--db {scheme}://... names no database; give {FORM}; in a password @ is %40, "
            ": is %3A, / is %2F"
        )
    if "password=" in parts.query.lower():
        raise InputError("--db with a password behind '?'; put it before the host, or in ~/.pgpass")
    place = parts.netloc.rpartition("@")
    user, _, secret = place[0].partition(":")
    netloc = f"{user}@{place[2]}" if user else place[2]
    shown = urlunsplit(("postgresql", netloc, parts.path, parts.query, ""))
    return HistoryServer(shown, unquote(secret) if secret else None)


def is_there(place: HistoryPlace) -> bool:
    """Whether there is such a file; of a server only a connection tells."""
    return isinstance(place, HistoryServer) or os.path.exists(place)


def files_of(place: HistoryPlace | None) -> list[Path]:
    """Files of it that must not be written over; a server has none here."""
    return [place] if isinstance(place, Path) else []


def whole_name(place: HistoryPlace) -> str:
    """One name of a history, wherever it is told from."""
    return str(place) if isinstance(place, HistoryServer) else str(place.resolve())
