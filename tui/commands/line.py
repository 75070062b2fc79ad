"""``lashbench line``: unit after unit by serial number, each measured and judged.

Owns the options of the verb and the dialogue with the operator and the scanner. A unit's session
and judgement are `tui.line.unit`'s, its result is `tui.line.results`'.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from daq.errors import InputError, LashbenchError, MeasurementError
from daq.servers.place import files_of, is_there, whole_name
from tui.exit_codes import INTERRUPTED
from tui.judging import limits_to_judge_by
from tui.options import HistoryOption, JudgeBy
from tui.places import history_path, line_path
from tui.session_words import confirm_driving
from tui.text.layout import wrapped
from tui.text.output import Console, Injected, readers_may_leave

if TYPE_CHECKING:
    from daq.limits import Bench
    from daq.recipe import Recipe
    from tui.line.hook import Hook
    from tui.line.results import Result, Results
    from tui.line.scanner import Scanner
    from tui.line.unit import Line, Pending

__all__ = ["line"]

_MOST_UNFIT = 3
"""Units in a row whose trial point is implausible: then it is rather the bench."""
_TALLY, _END = "?", "."

Duplicates = Literal["ask", "retest", "skip"]


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
    yes
        Drive hardware without asking; needed where there is no terminal.
    """
    from daq.limits import load_bench
    from daq.recipe import load_recipe
    from tui.line.hook import Hook
    from tui.line.results import Results
    from tui.line.scanner import Scanner
    from tui.line.unit import Line
    from tui.signals import waiting
    from tui.unit_under_test import read_unit

    place, way, limits = load_bench(bench), load_recipe(recipe), limits_to_judge_by(judge)
    name = unit or _unit_of(way)
    hook = None if on_result is None else Hook(on_result)
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
    dialogue = _Dialogue(belt, results, hook, Scanner(sys.stdin), duplicates, console)
    try:
        with waiting(console.note):
            return dialogue.run()
    finally:
        dialogue.tally()


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


class _Dialogue:
    """What is asked and told between units."""

    def __init__(
        self,
        belt: Line,
        results: Results,
        hook: Hook | None,
        scanner: Scanner,
        duplicates: Duplicates,
        console: Console,
    ) -> None:
        self._belt = belt
        self._results = results
        self._hook = hook
        self._scanner = scanner
        self._duplicates = duplicates
        self._console = console
        self._is_terminal = sys.stdin.isatty()
        self._unfit = 0
        self._is_ended = False
        """Whether the end was typed where something else was asked for."""
        self._taken_up = ""
        """Serial number of the unit that was gone on with, which may be scanned once more."""

    def run(self) -> int:
        """Take unit after unit; the exit code."""
        self._say_again()
        pending = self._belt.pending(self._results)
        if pending is not None and not self._take_up(pending):
            return INTERRUPTED
        while not self._is_ended and (serial := self._scanned("serial")) is not None:
            if not self._unit(serial):
                return INTERRUPTED
        return 0

    def tally(self) -> None:
        """Print the counts of all results in the file."""
        from tui.line.tally import tally_lines

        with readers_may_leave():
            self._console.data("\n".join(tally_lines(self._results.all)))

    def _say_again(self) -> None:
        """Run the command for the last result, if the program was killed before it was run."""
        if self._hook is None or not self._results.all:
            return
        last = self._results.all[-1]
        if last.history != whole_name(self._belt.db) or not is_there(self._belt.db):
            return
        if not self._belt.noted(last.measurement, "hook"):
            self._tell_hook(last)

    def _take_up(self, pending: Pending) -> bool:
        """Go on with the unit that was on the bench; False if that was ended on request."""
        serial, belt = pending.serial, self._belt
        self._taken_up = serial
        if pending.complete:
            self._console.note(f"{serial}: measured before, not judged yet")
            self._keep(belt.judge(pending))
            return True
        begun = f"{pending.points} of {pending.planned} points"
        if not (self._is_terminal or pending.newest):
            self._taken_up = ""
            self._console.note(
                f"warning: {serial} is not finished ({begun}), and others were measured after it; "
                "scan it again when it is on the bench"
            )
            return True
        if self._is_terminal:
            for text in wrapped(
                f"{serial} is not finished ({begun}). If it is on the bench, press Enter or scan "
                "it; another serial number leaves it"
            ):
                self._console.note(text)
            found = self._scanned("serial", may_be_empty=True)
            if found is None:
                self._is_ended = True
                return True
            if found not in ("", serial):
                self._taken_up = ""
                return self._unit(found)
        else:
            self._console.note(f"going on with {serial} ({begun})")
        return self._measured(serial, pending.attempt, pending.measurement)

    def _scanned(self, prompt: str, may_be_empty: bool = False) -> str | None:
        """The next serial number; None at the end."""
        from tui.line.scanner import clean_serial

        while True:
            if self._is_terminal:
                self._console.prompt(f"{prompt}> ")
            text = self._scanner.line()
            if text is None or text.strip() == _END:
                return None
            if text.strip() == _TALLY:
                self.tally()
                continue
            try:
                serial = clean_serial(text)
            except InputError as error:
                self._console.error(str(error))
                continue
            if serial or may_be_empty:
                return serial
            if self._is_terminal:
                self._console.note(f"scan a serial number; {_TALLY} counts, {_END} ends")

    def _unit(self, serial: str) -> bool:
        """Measure and judge a unit; False if that was ended on request."""
        if serial == self._taken_up:
            self._taken_up = ""
            self._console.note(f"{serial}: done already, it was gone on with")
            return True
        self._taken_up = ""
        before = self._results.of(serial)
        if before:
            last = f"{serial} has {before[-1].verdict} of {before[-1].started[:16]} UTC"
            if self._duplicates == "skip":
                self._console.note(f"{last}; skipped")
                return True
            if self._duplicates == "ask" and self._is_terminal:
                answer = self._answer(f"{last}; measure it again as a retest? [y/N] ")
                if answer.lower() not in ("y", "yes"):
                    return self._unit_after(answer, serial)
            else:
                self._console.note(f"{last}; this is retest {len(before)}")
        return self._measured(serial, len(before) + 1)

    def _answer(self, question: str) -> str:
        """What is typed or scanned in answer; the counts are shown between, and the end is one."""
        while True:
            self._console.prompt(question)
            text = self._scanner.line()
            answer = _END if text is None else text.strip()
            if answer != _TALLY:
                self._is_ended = answer == _END
                return answer
            self.tally()

    def _unit_after(self, answer: str, serial: str) -> bool:
        """What was scanned in place of an answer is the next unit."""
        from tui.line.scanner import clean_serial

        if answer == _END:
            return True
        if answer.lower() in ("", "n", "no"):
            answer = serial
        try:
            found = clean_serial(answer)
        except InputError as error:
            self._console.error(str(error))
            return True
        if found not in ("", serial):
            return self._unit(found)
        self._console.note(f"{serial}: not measured again")
        return True

    def _measured(self, serial: str, attempt: int, resume: int | None = None) -> bool:
        self._console.note(f"{serial}: measuring" if resume is None else f"{serial}: going on")
        result = self._belt.measure(serial, attempt, resume)
        if result is None:
            self._console.note(f"{serial} is not finished; the same command goes on with it")
            return False
        self._keep(result)
        unfit = any(reason.startswith("not measured") for reason in result.reasons)
        self._unfit = self._unfit + 1 if unfit else 0
        if self._unfit >= _MOST_UNFIT:
            raise MeasurementError(
                f"{self._unfit} units in a row could not be measured ({result.reasons[0]}); look "
                "at the bench; the results are kept"
            )
        return True

    def _keep(self, result: Result) -> None:
        """On the disk first, then the label, the table and the command."""
        try:
            self._results.add(result)
        except LashbenchError as error:
            raise type(error)(
                f"{error}; {result.serial} is {result.verdict}, and is judged again at the next "
                "start"
            ) from error
        self._belt.note(result.measurement, "line", f"{result.verdict} for {result.serial}")
        with readers_may_leave():
            self._console.data(result.label)
        try:
            self._results.write_table()
        except LashbenchError as error:
            self._console.note(f"warning: --csv {error}; the result is in {self._results.path}")
        self._tell_hook(result)

    def _tell_hook(self, result: Result) -> None:
        if self._hook is None:
            return
        fault = self._hook.run(result.model_dump_json())
        self._belt.note(result.measurement, "hook", fault or "done")
        if fault:
            self._console.note(
                f"warning: --on-result for {result.serial}: {fault}; the result is kept"
            )
