"""The ``lashbench`` commands that do what a step of the screen does.

Owns their wording. Each is printed so that a shell takes it back; what no command can say is said
in words.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq.errors import LashbenchError
from tui.text.shell_quote import pasted

if TYPE_CHECKING:
    from daq.plan import SweepPlan
    from tui.app.state.desk import Desk

__all__ = ["commands_of"]

_NO_FILE = "# the unit comes from the history: write its file first, with --unit FILE"


def commands_of(step: int, desk: Desk) -> list[str]:
    """Lines for a shell, those of words after a #; reads files, so it runs beside the screen.

    Parameters
    ----------
    step
        From 1.
    """
    lines = [] if desk.unit_text is None else [_NO_FILE]
    if step == 1:
        place = ["--db", str(desk.db), "--unit", _unit_name(desk)]
        return [*lines, _line("history", *place, *_judged(desk))]
    if step == 2:
        return ["# instruments of this machine:", _line("doctor")]
    if step in (3, 4):
        try:
            measured = _measure(desk)
        except LashbenchError as error:
            return [*lines, f"# {error}"]
        if step == 3:
            lines += _best(desk)
            return [*lines, f"{measured} --dry-run", "# the checks come first in:", measured]
        return [*lines, measured]
    place, judged = ["--db", str(desk.db)], _judged(desk)
    if step == 7:
        lines += _overlay(desk)
    if desk.measurement is None:
        return lines if step == 7 and desk.marked else ["# no measurement yet"]
    number, unit = str(desk.measurement), ["--unit", desk.unit_name]
    file = f"measurement-{number}.csv"
    export = _line("export", number, "--db", str(desk.db), "--out", file)
    as_is = ["--as-is"] if desk.results.as_is else []
    if step == 5:
        estimate = _line("estimate", file, *unit, *as_is, *judged)
        return [*lines, export, _line("extract", file), estimate]
    if step == 6:
        return [*lines, export, _line("diagnose", file, *unit, *as_is, *judged)]
    return [
        *lines,
        _line("report", number, *place, *unit, "--out", f"report-{number}.html"),
        _line("history", *place, "--unit", _unit_name(desk), *judged),
    ]


def _best(desk: Desk) -> list[str]:
    """How the sweep that tells most is found, where that was asked for."""
    if desk.plan_minutes is None:
        return []
    bench = [] if desk.bench == "default" else ["--bench", desk.bench]
    return [_line("plan", "--unit", desk.unit_name, "--minutes", f"{desk.plan_minutes:g}", *bench)]


def _judged(desk: Desk) -> list[str]:
    """The limits in force, as an option; none where no file can be named."""
    try:
        found = desk.limits_choice.read()
    except LashbenchError:
        return []
    return ["--judge", found.named] if found is not None and found.named else []


def _overlay(desk: Desk) -> list[str]:
    """The picture of the sessions that are marked, where an overlay is one."""
    numbers = [str(number) for number in desk.marked]
    out = f"overlay-{'-'.join(numbers)}.png"
    line = _line("plot", *numbers, "--db", str(desk.db), "--out", out)
    return [line] if len(numbers) > 1 else []


def _line(*words: str) -> str:
    return pasted(["lashbench", *words])


def _unit_name(desk: Desk) -> str:
    return "" if desk.unit is None else desk.unit.name


def _measure(desk: Desk) -> str:
    words = ["measure", "--unit", desk.unit_name, "--instrument", desk.url, "--db", str(desk.db)]
    words += [] if desk.bench == "default" else ["--bench", desk.bench]
    words += _judged(desk)
    if desk.resume is not None:
        return _line(*words, "--resume", str(desk.resume))
    plan, spacing = desk.plan(), desk.options.spacing
    if desk.given_plan is None and desk.recipe is not None:
        words += ["--recipe", desk.recipe]
    words += _sweep(plan, spacing or _spacing_of(plan))
    words += ["--adaptive"] if desk.options.adaptive else []
    for name in ("serial", "operator", "notes"):
        value = getattr(desk, name)
        words += [f"--{name}", value] if value else []
    return _line(*words)


def _sweep(plan: SweepPlan, spacing: str) -> list[str]:
    words: list[str] = []
    for level in plan.levels_vpk:
        words += ["--level", f"{level!r}"]
    words += ["--start", f"{plan.frequencies_hz[0]!r}", "--stop", f"{plan.frequencies_hz[-1]!r}"]
    words += ["--points", str(len(plan.frequencies_hz)), "--spacing", spacing]
    words += ["--direction", plan.direction, "--settle-cycles", str(plan.settle_cycles)]
    words += ["--integrate-cycles", str(plan.integrate_cycles)]
    return [*words, "--offset", f"{plan.dc_offset_v!r}"] if plan.dc_offset_v else words


def _spacing_of(plan: SweepPlan) -> str:
    """How a plan is spaced.

    Raises
    ------
    InputError
        If no command line can say its frequencies.
    """
    import math

    from daq.errors import InputError
    from daq.plan import spaced_frequencies

    hertz = plan.frequencies_hz
    for spacing in ("lin", "log"):
        grid = spaced_frequencies(hertz[0], hertz[-1], len(hertz), spacing)
        if all(math.isclose(a, b, rel_tol=1e-9) for a, b in zip(grid, hertz, strict=True)):
            return spacing
    raise InputError("the frequencies of this plan are uneven; no command line can say them")
