"""One session at a time on one bench: a lock beside the history's file.

Owns the lock, which the system lets go of when its holders are gone, however
they ended. A session shares it with its watchdog, so that the next session
waits until the watchdog of a killed one has made the source safe.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from types import TracebackType
from typing import Self

from daq.errors import InputError, MeasurementError

__all__ = ["BenchLock"]

_LOOK_S = 0.1


class BenchLock:
    """Held from construction to `release`; use it as a context manager.

    Parameters
    ----------
    history
        File of the bench's history, or a link to it; the lock is a file beside the file itself.
    patience_s
        How long to wait where the session that holds it is gone already and
        only its watchdog is still at work, s.

    Raises
    ------
    MeasurementError
        If another session is running, or the watchdog takes too long.
    InputError
        If the lock's file cannot be made.
    """

    def __init__(self, history: Path, patience_s: float = 45.0) -> None:
        # Beside the file itself: all the links to it lead to one bench.
        file = Path(os.path.realpath(history))
        self._path = file.with_name(file.name + "-lock")
        self._file = -1
        deadline_s = time.monotonic() + patience_s
        while not self._taken():
            owner = self._owner()
            if owner is not None and _alive(owner):
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
            self._path.unlink(missing_ok=True)
            os.close(self._file)
            self._file = -1

    def _taken(self) -> bool:
        try:
            file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise InputError(
                f"{self._path}: the bench's lock cannot be made ({error.strerror})"
            ) from error
        if not _lock(file) or not _is_at(file, self._path):
            os.close(file)
            return False
        os.ftruncate(file, 0)
        os.write(file, f"{os.getpid()}\n".encode("ascii"))
        self._file = file
        return True

    def _owner(self) -> int | None:
        try:
            return int(self._path.read_text(encoding="ascii"))
        except (OSError, ValueError):
            return None


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


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
