"""What is asked and told between the units of a line, by keyboard, scanner or screen alike.

Owns the order: what was left is taken up, a serial number is taken, its unit is measured, its
result is kept before it is told. It draws nothing: words go to a console, answers come from a
scanner.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, Protocol

from daq.errors import InputError, LashbenchError, MeasurementError
from daq.servers.place import is_there, whole_name
from tui.exit_codes import INTERRUPTED
from tui.text.layout import wrapped
from tui.text.output import Console, readers_may_leave

if TYPE_CHECKING:
    from tui.line.hook import Hook
    from tui.line.results import Result, Results
    from tui.line.unit import Line, Pending

__all__ = ["Dialogue", "Duplicates", "Lines"]

_MOST_UNFIT = 3
"""Units in a row whose trial point is implausible: then it is rather the bench."""
_TALLY, _END = "?", "."

Duplicates = Literal["ask", "retest", "skip"]


class Lines(Protocol):
    """Where serial numbers and answers come from."""

    def line(self) -> str | None:
        """The next line without its end; None where nothing more comes."""
        ...


class Dialogue:
    """One sitting at a line.

    Parameters
    ----------
    belt, results, hook
        What measures and judges, where results go, and the command that gets each.
    scanner, console
        Where lines come from, and words go.
    duplicates
        What to do with a serial number that has a result.
    is_watched
        Whether somebody can be asked.
    began, kept
        Told the serial number of each unit that is measured, and each result once it is kept.
    """

    def __init__(
        self,
        belt: Line,
        results: Results,
        hook: Hook | None,
        scanner: Lines,
        duplicates: Duplicates,
        console: Console,
        is_watched: bool,
        began: Callable[[str], None] = lambda serial: None,
        kept: Callable[[Result], None] = lambda result: None,
    ) -> None:
        self._belt = belt
        self._results = results
        self._hook = hook
        self._scanner = scanner
        self._duplicates = duplicates
        self._console = console
        self._is_terminal = is_watched
        self._began, self._kept = began, kept
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
        self._began(serial)
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
        self._kept(result)
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
