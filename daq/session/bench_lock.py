"""One session at a time on one bench: a lock beside the history's file.

Owns the lock, which the system lets go of when its holders are gone, however
they ended. A session shares it with its watchdog, so that the next session
waits until the watchdog of a killed one has made the source safe. It never
writes into a file that is not such a lock.
"""

from __future__ import annotations

import os
import re
import stat
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from daq.errors import InputError, MeasurementError
from daq.servers.place import HistoryPlace, HistoryServer
from daq.session.instrument_claim import claim, is_alive, is_held, own_lock

__all__ = ["BenchLock"]

_LOOK_S = 0.1
_CONTENT = re.compile(rb"(\d{1,19}\n)?")
"""Of a lock's file: the number of the process that holds it or left it; nothing at its birth."""


class BenchLock:
    """Held from construction to `release`; use it as a context manager.

    Parameters
    ----------
    history
        File of the bench's history, or a link to it; the lock is a file beside the file itself.
    patience_s
        How long to wait where the session that holds it is gone already and
        only its watchdog is still at work, s.
    instrument
        Address of the instrument that the session will use: no session with another history
        may use it meanwhile. None for no instrument.

    Raises
    ------
    MeasurementError
        If another session is running, the watchdog takes too long, or the disk is full.
    InputError
        If the lock's file cannot be made, or something else is in its place.
    """

    def __init__(
        self, history: HistoryPlace, patience_s: float = 45.0, instrument: str | None = None
    ) -> None:
        # Beside the file itself: all the links to it lead to one bench.
        self._path = _lock_of(history)
        self._file = -1
        deadline_s = time.monotonic() + patience_s
        while not self._taken():
            owner = self._owner()
            if owner is not None and is_alive(owner):
                raise MeasurementError(
                    f"{history}: another session (process {owner}) is measuring on this bench; "
                    "wait for it to end, or stop it"
                )
            if time.monotonic() > deadline_s:
                raise MeasurementError(
                    f"{history}: the watchdog of a session that was killed is still at work "
                    f"after {patience_s:g} s; look at the instrument"
                )
            time.sleep(_LOOK_S)
        if instrument is not None:
            try:
                claim(instrument, self._path, max(deadline_s - time.monotonic(), 0.0))
            except BaseException:
                self.release()
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.release()

    @property
    def descriptor(self) -> int:
        """File descriptor to hand down to a watchdog, which then holds the lock as well."""
        return self._file

    def release(self) -> None:
        """Let go; may be called twice."""
        if self._file >= 0:
            # Removed while it is held: whoever waits on it finds another file
            # under the name and starts again.
            with suppress(OSError):
                self._path.unlink()
            os.close(self._file)
            self._file = -1

    def _taken(self) -> bool:
        file = self._opened()
        try:
            self._check(file)
            if not _lock(file) or not _is_at(file, self._path):
                os.close(file)
                return False
            # Whoever had it may have written meanwhile.
            self._check(file)
            os.ftruncate(file, 0)
            os.pwrite(file, f"{os.getpid()}\n".encode("ascii"), 0)
        except OSError as error:
            with suppress(OSError):
                self._path.unlink()
            os.close(file)
            raise MeasurementError(
                f"{self._path}: the bench's lock cannot be written ({error.strerror}); make room"
            ) from error
        except InputError:
            os.close(file)
            raise
        self._file = file
        return True

    def _opened(self) -> int:
        flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC
        # Neither through a link, nor waiting for whoever reads a pipe.
        flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
        try:
            return os.open(self._path, flags, 0o644)
        except OSError as error:
            if os.path.islink(self._path):
                raise self._not_ours("is a link") from error
            if os.path.isdir(self._path):
                raise self._not_ours("is a directory") from error
            if isinstance(error, PermissionError) and is_held(self._path):
                raise MeasurementError(
                    f"{self._path}: another user's session (process {self._owner()}) is measuring "
                    "on this bench; wait for it to end"
                ) from error
            raise InputError(
                f"{self._path}: the bench's lock cannot be made ({error.strerror})"
            ) from error

    def _check(self, file: int) -> None:
        """Refuse a file that no session made: nothing is written into it."""
        found = os.fstat(file)
        if not stat.S_ISREG(found.st_mode):
            raise self._not_ours("is not a regular file")
        if found.st_nlink > 1:
            raise self._not_ours("has another name, too, a hard link")
        if not _CONTENT.fullmatch(os.pread(file, 32, 0)):
            raise self._not_ours("holds something else")

    def _not_ours(self, what: str) -> InputError:
        return InputError(
            f"{self._path}: {what}, and is no lock of lashbench; nothing was written into it, "
            "move it away"
        )

    def _owner(self) -> int | None:
        try:
            return int(self._path.read_text(encoding="ascii"))
        except (OSError, ValueError):
            return None


def _lock_of(history: HistoryPlace) -> Path:
    if isinstance(history, HistoryServer):
        # Other machines are kept from the same instrument and measurement, not from the server.
        return own_lock(str(history))
    file = Path(os.path.realpath(history))
    return file.with_name(file.name + "-lock")


def _lock(file: int) -> bool:
    try:
        import fcntl
    except ImportError:  # a system without it has exclusive ports at least
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _is_at(file: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(file), path.stat())
    except OSError:
        return False
