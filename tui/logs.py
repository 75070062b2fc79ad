"""The log file, where everything goes that no operator should have to see.

Owns the handler that writes it, and that there is one only. It writes into a regular file of this
user, not through a link.
"""

from __future__ import annotations

import io
import logging
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from logging.handlers import RotatingFileHandler
from pathlib import Path

from daq.untrusted.visible_text import visible, visible_line
from tui.places import log_path

__all__ = ["LEVELS", "logging_to_file", "silence", "telling_what_is_passed_over"]

LEVELS = ("debug", "info", "warning", "error")
"""What ``--log-level`` takes, from most to least that is written."""

_BYTES = 1_000_000
_WARNINGS = "py.warnings"
"""Where Python puts what it and libraries warn of."""


class _Seen(logging.Formatter):
    """Writes an entry as it may be shown: a line for the message, whatever others put into it."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802
        return visible_line(super().formatMessage(record))

    def format(self, record: logging.LogRecord) -> str:
        return visible(super().format(record))


def silence() -> None:
    """Let nothing of the log reach stderr where no file is written, nor what libraries warn of."""
    logging.captureWarnings(True)
    for name in ("lashbench", _WARNINGS):
        logger = logging.getLogger(name)
        if not logger.handlers:
            logger.addHandler(logging.NullHandler())


@contextmanager
def logging_to_file(level: str = "info") -> Iterator[Path | None]:
    """Write the log to its file until the block ends; yields None where it cannot be written.

    Inside of another such block nothing changes: the outer one knows its level.
    """
    path, logger = log_path(), logging.getLogger("lashbench")
    if any(isinstance(handler, RotatingFileHandler) for handler in logger.handlers):
        yield path
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handler = _OwnFile(path, maxBytes=_BYTES, backupCount=1, encoding="utf-8")
    except OSError:
        yield None
        return
    handler.setFormatter(_Seen("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    logger.addHandler(handler)
    warned = logging.getLogger(_WARNINGS)
    warned.addHandler(handler)
    before = logger.level
    logger.setLevel(level.upper())
    try:
        yield path
    finally:
        logger.setLevel(before)
        logger.removeHandler(handler)
        warned.removeHandler(handler)
        handler.close()


@contextmanager
def telling_what_is_passed_over(tell: Callable[[str], None]) -> Iterator[None]:
    """Say what is not used because others could write it, as `daq.untrusted.trust` logs."""

    class Teller(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            tell(f"note: {record.getMessage()}")

    logger, handler = logging.getLogger("lashbench.trust"), Teller(logging.WARNING)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


class _OwnFile(RotatingFileHandler):
    """A handler that opens no file but one of this user, and follows no link to it."""

    def _open(self) -> io.TextIOWrapper:
        return open(self.baseFilename, "a", encoding=self.encoding, opener=_own)  # noqa: SIM115


def _own(name: str, flags: int) -> int:
    flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    handle = os.open(name, flags, 0o600)
    found = os.fstat(handle)
    owner = os.getuid() if hasattr(os, "getuid") else found.st_uid
    if stat.S_ISREG(found.st_mode) and found.st_nlink == 1 and found.st_uid == owner:
        return handle
    os.close(handle)
    raise OSError(f"{name} is no log of lashbench")
