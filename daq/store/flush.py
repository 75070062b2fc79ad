"""Bringing what was committed onto the disk itself, beside the work and not in its way.

Owns one thread per history that is written. A commit is in the hands of the
operating system when it returns, so that no death of a program can undo it; a
power cut can, until the disk has it. Waiting for the disk at every point would
cost the sweep its pace wherever the machine is busy, so the thread asks for it
as soon as a point is committed, while the next one is being measured.
"""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path

from daq.errors import MeasurementError

__all__ = ["Flusher"]

_SLOW_S = 30.0
"""A disk that takes longer for one flush is told: what is committed meanwhile is in memory only."""


class Flusher:
    """Flushes one file, soon or now; its thread starts with the first use.

    Parameters
    ----------
    path
        The file; while it does not exist there is nothing to flush.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._wanted = threading.Event()
        self._closing = False
        self._fault: OSError | None = None
        self._since_s: float | None = None
        self._thread: threading.Thread | None = None

    def soon(self) -> None:
        """Ask for a flush and return at once.

        Raises
        ------
        MeasurementError
            If an earlier flush failed, or does not return.
        """
        self._complain()
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="flush", daemon=True)
            self._thread.start()
        self._wanted.set()

    def now(self) -> None:
        """Flush and return when the disk has everything; raises as `soon` does."""
        self._flush()
        self._complain()

    def close(self) -> None:
        """End the thread; what was asked for is flushed first. May be called twice."""
        thread, self._thread = self._thread, None
        if thread is not None:
            self._closing = True
            self._wanted.set()
            thread.join()
            self._closing = False

    def _work(self) -> None:
        while True:
            self._wanted.wait()
            self._wanted.clear()
            # Read before the flush: what comes during it needs another.
            is_last = self._closing
            self._since_s = time.monotonic()
            self._flush()
            self._since_s = None
            if is_last:
                return

    def _flush(self) -> None:
        try:
            # Any handle will do: it is the file that is flushed.
            handle = os.open(self._path, os.O_RDONLY)
        except FileNotFoundError:
            return
        except OSError as error:
            self._fault = error
            return
        try:
            os.fsync(handle)
        except OSError as error:
            self._fault = error
        finally:
            os.close(handle)

    def _complain(self) -> None:
        since_s = self._since_s
        if since_s is not None and time.monotonic() - since_s > _SLOW_S:
            raise MeasurementError(
                f"{self._path}: the disk has not confirmed data for {_SLOW_S:g} s; what was "
                "committed meanwhile may not outlive a power cut, look at its disk or network"
            )
        if self._fault is not None:
            raise MeasurementError(
                f"{self._path}: the disk refused the data ({self._fault.strerror}); what was "
                "committed may not outlive a power cut, look at the disk"
            ) from self._fault
