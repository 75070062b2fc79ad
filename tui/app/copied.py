"""What was copied off a screen, kept in a file for terminals that take nothing.

Owns that file. It runs beside the screen and draws nothing.
"""

from __future__ import annotations

from pathlib import Path

from daq.errors import LashbenchError
from daq.formats.atomic import write_text

__all__ = ["keep_copy"]


def keep_copy(log: Path | None, text: str) -> str:
    """Write down what was copied, beside the log; gives what to say of it."""
    if log is None:
        return "copied"
    path = log.with_name("copied.txt")
    try:
        write_text(path, text + "\n")
    except LashbenchError:
        return "copied"
    return f"copied; also in {path}"
