"""``lashbench line``: unit after unit by serial number, each measured and judged.

Owns the options of the verb. The dialogue is `tui.line.dialogue`'s, on a terminal or on a screen; a
unit's session and judgement are `tui.line.unit`'s, its result is `tui.line.results`'.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from daq.errors import InputError
from daq.servers.place import files_of
from tui.commands.bench import require_terminal
from tui.judging import limits_to_judge_by
from tui.line.dialogue import Duplicates
from tui.options import HistoryOption, JudgeBy
from tui.places import history_path, line_path
from tui.session_words import confirm_driving
from tui.text.output import Console, Injected

if TYPE_CHECKING:
    from daq.limits import Bench
    from daq.recipe import Recipe
    from tui.line.hook import Hook
    from tui.line.results import Results
    from tui.line.unit import Line

__all__ = ["line"]


def line(
    *,
    recipe: str,
    unit: Annotated[str | None, Parameter(name="--unit")] = None,
    instrument: str | None = None,
    bench: str = "default",
    judge: JudgeBy = None,
    diagnose: Annotated[bool, Parameter(negative=())] = False,
    adaptive: Annotated[bool, Parameter(negative=())] = False,
    db: HistoryOption = None,
    out: Path | None = None,
    csv: Path | None = None,
    on_result: str | None = None,
    duplicates: Duplicates = "ask",
    operator: str = "",
    screen: Annotated[bool, Parameter(negative=())] = False,
    yes: bool = False,
    console: Injected,
) -> int:
    """Measure and judge unit after unit: scan a serial number, and the sweep begins.

    A line that ends with Enter is a serial number. ? shows the counts, . or the end of the input
    ends the line. Each result is on the disk before its label is printed. After a crash the same
    command goes on with the unit that was on the bench.

    The exit code says how the line ended, not what its units are like: 0 if it was ended, else
    that of the fault of the instrument that stopped it.

    Parameters
    ----------
    recipe
        Sweep recipe, by name or path.
    unit
        adss, edss or the path of a unit file; the one that the recipe is named after, if left out.
    instrument
        URL: sim:, prologix:DEVICE, TCPIP::..., ...; that of the bench file, if left out.
    bench
        Bench file, by name or path: limits, instrument, calibration.
    diagnose
        Diagnose each unit where a limit is of causes, which takes a minute or two.
    adaptive
        Go on around anti-resonance and resonance until they are known well.
    db
        The bench's history, a file or postgresql://USER@HOST/DATABASE; yours, if left out.
    out
        File of results, one line of JSON a unit; beside the history, if left out.
    csv
        The same results as a table, written anew after each unit.
    on_result
        Command that gets each result as JSON on its standard input, for labels, mail or a web hook.
    duplicates
        What to do with a serial number that has a result: ask (retest it where there is no
        terminal), retest it, or skip it.
    operator
        Who measures.
    screen
        Show units, results in large letters and counts on a screen of their own.
    yes
        Drive hardware without asking; needed where there is no terminal.
    """
    from daq.limits import load_bench
    from daq.recipe import load_recipe
    from tui.line.dialogue import Dialogue
    from tui.line.hook import Hook
    from tui.line.results import Results
    from tui.line.scanner import Scanner
    from tui.line.unit import Line
    from tui.signals import waiting
    from tui.unit_under_test import read_unit

    place, way, limits = load_bench(bench), load_recipe(recipe), limits_to_judge_by(judge)
    name = unit or _unit_of(way)
    hook = None if on_result is None else Hook(on_result)
    if screen:
        require_terminal("line --screen")
    history = history_path(db, create=True)
    named = [one for one in (recipe, unit, bench, judge) if one is not None]
    results = Results(out or line_path(history), csv, [*files_of(history), *named])
    belt = Line(
        name, read_unit(name, console), instrument or _address(place), recipe, bench, adaptive,
        operator, history, limits, diagnose, results.path, console,
    )  # fmt: skip
    request = belt.request("", 1)  # everything is refused now that would be refused later
    confirm_driving(belt.instrument, request, history, yes)
    _warn_of_calibration(place, console)
    if screen:
        return _on_screen(belt, results, hook, duplicates, console)
    is_watched = sys.stdin.isatty()
    dialogue = Dialogue(belt, results, hook, Scanner(sys.stdin), duplicates, console, is_watched)
    try:
        with waiting(console.note):
            return dialogue.run()
    finally:
        dialogue.tally()


def _on_screen(
    belt: Line, results: Results, hook: Hook | None, duplicates: Duplicates, console: Console
) -> int:
    from tui.app.line.screen import LineApp
    from tui.line.tally import tally_lines
    from tui.logs import logging_to_file

    with logging_to_file():
        code = LineApp(belt, results, hook, duplicates).run_to_end()
    console.data("\n".join(tally_lines(results.all)))
    return code


def _unit_of(recipe: Recipe) -> str:
    from daq.configs import config_names

    if recipe.name.lower() in config_names("units"):
        return recipe.name
    raise InputError(f"--unit is missing: no unit is named as recipe {recipe.name}")


def _address(bench: Bench) -> str:
    if bench.instrument.address is None:
        raise InputError(
            f"--instrument is missing: bench {bench.name} has no address under [instrument]"
        )
    return bench.instrument.address


def _warn_of_calibration(bench: Bench, console: Console) -> None:
    from datetime import UTC, datetime

    due = bench.instrument.calibration_due
    if due is not None and due < datetime.now(UTC).date():
        console.note(f"warning: the calibration of the instrument was due on {due.isoformat()}")
