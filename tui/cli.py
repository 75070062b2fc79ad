"""The command line: which verbs there are, and what becomes of their errors.

Owns the entry point, the table of verbs and the exit codes. A verb lives in
its own module under `tui.commands` and is imported when it is called, so that
help costs none of the scientific libraries. Nothing here computes.
"""

from __future__ import annotations

if __name__ == "__main__":
    # Before anything is loaded that a file in the working directory could stand in for.
    import runpy

    runpy.run_module("tui", run_name="__main__")

import errno
import logging
import os
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version

from cyclopts import App, CycloptsError, MissingArgumentError, Parameter

from daq.errors import InputError, LashbenchError
from tui.commands.bench import is_terminal
from tui.computations import Computations
from tui.exit_codes import INTERRUPTED
from tui.logs import LEVELS, logging_to_file, silence, telling_what_is_passed_over
from tui.text.output import Console, hush
from tui.verbs import EPILOGUE, FRONT_PAGES, SUMMARY, VERBS, front_page

__all__ = ["VERBS", "build_app", "main"]

TRUST_EFFECTS = "LASHBENCH_TRUST_EFFECTS"
"""As `sim.own_effects.TRUST`, which takes time to import."""

_USAGE = 2
_OF_THE_SYSTEM = {
    errno.ENAMETOOLONG: ("give a shorter name", _USAGE),
    errno.ENOSPC: ("make room", 1),
    errno.EDQUOT: ("make room", 1),
    errno.EFBIG: ("make room", 1),
    errno.EROFS: ("give a place that can be written", _USAGE),
    errno.EIO: ("the disk fails; look at the system's log", 1),
}
"""What to do, and the exit code, where the system refuses something to do with a file."""

_LOG = logging.getLogger("lashbench.command")


def build_app() -> App:
    """Build the parser with all verbs, none of them imported."""
    app = App(
        name="lashbench",
        help=SUMMARY,
        help_epilogue=EPILOGUE,
        version=lambda: version("lashbench"),
        default_parameter=Parameter(negative=()),
        help_format="plaintext",
        result_action="return_value",
    )
    for name, (target, summary) in VERBS.items():
        app.command(target, name=name, help=summary, help_format="markdown")
    return app


def main(arguments: Sequence[str] | None = None, compute: Computations | None = None) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    arguments
        Words after the program's name; those of the process if left out.
    compute
        What verbs compute with; the real analyses if left out.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    debug, words = _switch("--debug", words)
    quiet, words = _switch("--quiet", words)
    trusts, words = _switch("--trust-effects", words)
    console = Console(quiet, compute or Computations())
    silence()
    with _trusting_effects(trusts):
        return _logged(words, console, debug)


@contextmanager
def _trusting_effects(trusts: bool) -> Iterator[None]:
    """Let effect files of unit files be executed, here and in processes that are started."""
    before = os.environ.get(TRUST_EFFECTS)
    if trusts:
        os.environ[TRUST_EFFECTS] = "1"
    try:
        yield
    finally:
        if trusts:
            os.environ.pop(TRUST_EFFECTS)
            os.environ.update({} if before is None else {TRUST_EFFECTS: before})


def _logged(words: list[str], console: Console, debug: bool) -> int:
    """Run a command, with a log file if one is asked for."""
    try:
        level, words = _log_level(words)
    except LashbenchError as error:
        console.error(str(error))
        return error.exit_code
    if not words and is_terminal():
        words = ["bench"]
    if level is None:
        return _guarded(words, console, debug)
    with logging_to_file(level) as path:
        console.note(f"log: {path or 'cannot be written; going on without'}")
        _LOG.info("lashbench %s", " ".join(words))
        code = _guarded(words, console, debug)
        _LOG.info("exit code %d", code)
    return code


def _guarded(words: list[str], console: Console, debug: bool) -> int:
    """Run a command; whatever it raises becomes one line and an exit code."""
    try:
        with telling_what_is_passed_over(console.note):
            return _run(words, console)
    except BrokenPipeError:
        # Whoever read our output has seen enough.
        hush(sys.stdout)
        return 0
    except (KeyboardInterrupt, Exception) as error:
        if debug:
            traceback.print_exc()
        _LOG.debug("ended by", exc_info=error)
        message, code = _verdict(error, words)
        console.error(message)
        return code


def _run(words: list[str], console: Console) -> int:
    if not words or words in FRONT_PAGES:
        sys.stdout.write(front_page(words))
        return 0
    command, bound, injected = build_app().parse_args(
        words, exit_on_error=False, print_error=False, help_on_error=False
    )
    for name in injected:
        bound.arguments[name] = console
    code = command(*bound.args, **bound.kwargs)
    return code if isinstance(code, int) else 0


def _switch(name: str, words: list[str]) -> tuple[bool, list[str]]:
    # Taken out before parsing, so that it may stand anywhere on the line.
    return name in words, [word for word in words if word != name]


def _log_level(words: list[str]) -> tuple[str | None, list[str]]:
    """Take ``--log-level LEVEL`` out of the line, wherever it stands."""
    for place, word in enumerate(words):
        name, equals, level = word.partition("=")
        if name != "--log-level":
            continue
        rest = words[place + 1 :]
        if not equals:
            level, rest = (rest[0], rest[1:]) if rest else ("", [])
        if level not in LEVELS:
            raise InputError(f"--log-level {level!r} is not one of {', '.join(LEVELS)}")
        return level, words[:place] + rest
    return None, words


def _verdict(error: BaseException, words: list[str]) -> tuple[str, int]:
    """The line and the exit code that an error means."""
    if _is_interrupted(error):
        return "interrupted", INTERRUPTED
    if isinstance(error, LashbenchError):
        return str(error), error.exit_code
    if isinstance(error, CycloptsError):
        verb = f"{words[0]} " if words and words[0] in VERBS else ""
        return f"{_usage(error).rstrip('. ')}; see lashbench {verb}--help", _USAGE
    if isinstance(error, OSError) and error.errno in _OF_THE_SYSTEM:
        # Whatever a floor below did not expect of files: the disk, or a name.
        remedy, code = _OF_THE_SYSTEM[error.errno]
        place = f"{error.filename}: " if error.filename else ""
        return f"{place}{error.strerror}; {remedy}", code
    return f"internal error: {type(error).__name__}: {error}; run with --debug and report it", 1


def _is_interrupted(error: BaseException | None) -> bool:
    """Whether it is an interrupt, or what compiled code makes of one that meets it.

    What else went wrong on the way out of one is told: it may be that the source is not off.
    """
    while isinstance(error, SystemError):
        error = error.__cause__ or error.__context__
    return isinstance(error, KeyboardInterrupt)


def _usage(error: CycloptsError) -> str:
    # A list of commands that is cut short is of less use than the help that is pointed to.
    text = str(error).partition(" Available commands")[0]
    if not isinstance(error, MissingArgumentError) or not error.argument or "Did you mean" in text:
        return text
    given = error.keyword is not None or error.argument.tokens
    return f"{error.argument.name} {'has no value' if given else 'is missing'}"
