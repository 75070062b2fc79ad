"""Where a user's own files lie, by the XDG convention.

Owns the places of history, profiles, cache and log; the environment variables
XDG_DATA_HOME, XDG_CACHE_HOME, XDG_CONFIG_HOME and XDG_STATE_HOME move them. Nothing is made
before it is needed.
"""

from __future__ import annotations

import os
from pathlib import Path

from daq.errors import InputError
from daq.servers.place import HistoryPlace, HistoryServer

__all__ = [
    "cache_folder",
    "history_path",
    "line_path",
    "log_path",
    "look_at_caches",
    "measurement_number",
    "profiles_folder",
]

_MOST_DIGITS = 18
"""What an identifier in a history can have."""


def history_path(given: HistoryPlace | None, *, create: bool = False) -> HistoryPlace:
    """The history that is meant: the one given, else the user's own.

    Parameters
    ----------
    create
        Make the folder of the user's own, for a program that is about to write.

    Raises
    ------
    InputError
        If that folder cannot be made, or that of the one given is not there.
    """
    from platformdirs import user_data_path

    if isinstance(given, HistoryServer):
        return given
    if isinstance(given, HistoryServer):
        return given
    if given is not None:
        if create and not os.path.isdir(given.parent):
            raise InputError(f"{given}: there is no directory {given.parent}; make it first")
        return given
    folder = user_data_path("lashbench", appauthor=False)
    if create:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{folder}: cannot be made ({error.strerror or error}); give --db FILE"
            ) from error
    return folder / "lashbench.db"


def line_path(history: HistoryPlace) -> Path:
    """Where the results of a production line go unless told otherwise: beside the history."""
    from platformdirs import user_data_path

    if isinstance(history, HistoryServer):
        return user_data_path("lashbench", appauthor=False, ensure_exists=True) / "line.jsonl"
    return history.with_suffix(".line.jsonl")


def measurement_number(source: str, db: HistoryPlace | None) -> int | None:
    """The identifier of a measurement that is meant by FILE_OR_ID; None if it names a file.

    Digits are an identifier, unless no history is named and there is such a file.
    """
    if not (source.isascii() and source.isdecimal() and len(source) <= _MOST_DIGITS):
        return None
    return int(source) if db is not None or not Path(source).is_file() else None


def profiles_folder() -> Path:
    """Where a user's own profiles of foreign files are kept; it may not be there yet."""
    from platformdirs import user_config_path

    return user_config_path("lashbench", appauthor=False) / "profiles"


def cache_folder() -> Path:
    """Where what can be computed again is kept."""
    from platformdirs import user_cache_path

    return user_cache_path("lashbench", appauthor=False)


def log_path() -> Path:
    """The log file; it may not be there yet."""
    from platformdirs import user_state_path

    return user_state_path("lashbench", appauthor=False) / "lashbench.log"


def look_at_caches() -> None:
    """Log at once what will not be used of the caches, for a screen that cannot be written over."""
    from daq.untrusted.trust import distrust, own_folder, pass_over

    own_folder(cache_folder())
    numba = os.environ.get("NUMBA_CACHE_DIR")
    if numba and os.path.exists(numba) and (fault := distrust(Path(numba))) is not None:
        pass_over(fault)
