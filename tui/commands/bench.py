"""``lashbench`` without a verb, or ``lashbench bench``: the bench screen.

Owns the options of the screen and what is said when it cannot be opened.
"""

from __future__ import annotations

import sys

from daq.errors import InputError
from tui.judging import limits_to_judge_by
from tui.options import HistoryOption, JudgeBy
from tui.places import history_path, look_at_caches
from tui.text.output import Injected

__all__ = ["bench", "is_terminal", "require_terminal"]


def bench(
    *,
    db: HistoryOption = None,
    bench: str = "default",
    judge: JudgeBy = None,
    console: Injected,
) -> int:
    """Open the bench screen: from a unit to a report, guided, by keyboard or mouse.

    Parameters
    ----------
    db
        The bench's history, a file or postgresql://USER@HOST/DATABASE; yours, if left out.
    bench
        Bench file, by name or path: limits, slew, input ranges.
    """
    from daq.limits import load_bench

    load_bench(bench)
    limits_to_judge_by(judge)
    require_terminal("bench")
    from tui.app.application import BenchApp
    from tui.logs import logging_to_file

    with logging_to_file() as log:
        if log is None:
            console.note("the log file cannot be written; going on without")
        look_at_caches()
        app = BenchApp(history_path(db, create=True), log=log, bench=bench, judge=judge or "")
        code = app.run()
    return code if code is not None else app.return_code or 0


def require_terminal(verb: str) -> None:
    """Insist on a terminal.

    Raises
    ------
    InputError
        If there is none to draw on or to press keys at.
    """
    if not is_terminal():
        raise InputError(f"{verb} needs a terminal; scripts use measure, see lashbench --help")


def is_terminal() -> bool:
    """Whether somebody can see and press keys; the screen is drawn on stderr."""
    return sys.stdin.isatty() and sys.stdout.isatty() and sys.stderr.isatty()
