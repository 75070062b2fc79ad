"""Checks of the surroundings: the terminal, and the folders for history, cache and log.

Owns what the bench screen asks of a terminal. It makes no folder.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

from daq.untrusted.trust import distrust
from tui.checkup.finding import Finding, failed, noted, passed
from tui.places import cache_folder, history_path, log_path

__all__ = ["check_folders", "check_terminal"]

_COLUMNS, _LINES = 80, 24


def check_terminal() -> Iterator[Finding]:
    """Whether the bench screen can be shown here."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        yield noted("terminal", "none", "run lashbench in a terminal to have the bench screen")
        return
    term, size = os.environ.get("TERM", ""), shutil.get_terminal_size()
    coding = (sys.stdout.encoding or "ascii").lower()
    colours = "full" if os.environ.get("COLORTERM") in ("truecolor", "24bit") else "256 or fewer"
    found = f"{term or 'TERM unset'}, {size.columns} x {size.lines}, {coding}, {colours} colours"
    faults = []
    if term in ("", "dumb"):
        faults.append("set TERM to the terminal's kind, for instance xterm-256color")
    if size.columns < _COLUMNS or size.lines < _LINES:
        faults.append(f"make the window at least {_COLUMNS} x {_LINES}")
    if not coding.startswith("utf"):
        faults.append("set LANG to a UTF-8 locale, for instance C.UTF-8")
    yield noted("terminal", found, "; ".join(faults)) if faults else passed("terminal", found)


def check_folders() -> Iterator[Finding]:
    """Whether history, cache and log can be written where they belong."""
    history = history_path(None)
    assert isinstance(history, Path)
    if (fault := _fault(history)) is None:
        yield passed("history", str(history))
    else:
        yield failed("history", fault, "set XDG_DATA_HOME to a folder of yours, or give --db FILE")
    places = {
        "cache": (cache_folder(), "XDG_CACHE_HOME", "a diagnosis simulates everything anew"),
        "log": (log_path(), "XDG_STATE_HOME", "the bench screen keeps no log"),
    }
    for name, (place, variable, loss) in places.items():
        fault = _fault(place)
        if fault is None and name == "cache" and os.path.exists(place):
            fault = distrust(place)
        if fault is None:
            yield passed(name, str(place))
        else:
            yield noted(name, f"{fault}: {loss}", f"set {variable} to a folder of yours")


def _fault(place: Path) -> str | None:
    """Why a file or folder cannot be written, or made; None where it can."""
    standing = place
    while not os.path.exists(standing) and standing != standing.parent:
        standing = standing.parent
    if standing != place and not os.path.isdir(standing):
        return f"{place}: {standing} is a file"
    needed = os.W_OK | (os.X_OK if standing.is_dir() else os.R_OK)
    if not os.access(standing, needed):
        return f"{place}: you cannot write to {standing}"
    return None
