"""Where everything that a verb says goes: data to stdout, narration to stderr.

Owns both streams of the command line and knows nothing of what it prints; no
other module writes to them.
"""

from __future__ import annotations

import io
import json
import logging
import math
import os
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Annotated, Any, TextIO

from cyclopts import Parameter

from analysis.execution.pace import Pace, duration
from daq.errors import LashbenchError
from daq.untrusted.visible_text import visible, visible_line
from tui.computations import Computations
from tui.text.narrator import Narrator

__all__ = ["Console", "Injected", "as_json", "hush", "readers_may_leave"]

_LOG = logging.getLogger("lashbench.console")


@dataclass(slots=True)
class _Live:
    """What stands on the terminal for a moment only: lines of a picture above the progress."""

    lines: int = 0
    pace: Pace = field(default_factory=Pace)
    narrator: Narrator | None = None
    told_s: float | None = None


_TELLING_S = 15.0
"""How often long work says how far it is where it cannot draw in place."""

_PIECE = 1 << 16
_PATIENCE_S = 2.0
"""How long is waited for a terminal to take what is left, when nothing drives any more."""


@dataclass(frozen=True, slots=True)
class Console:
    """The two streams of a run.

    Parameters
    ----------
    quiet
        Leave out narration and progress; data and errors remain.
    compute
        What a verb that has this console computes with.
    """

    quiet: bool = False
    compute: Computations = field(default_factory=Computations, repr=False, compare=False)
    _live: _Live = field(default_factory=_Live, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # A terminal that lacks a character (the ± of a plain C locale) shows
        # another in its place; it is no reason to lose the result.
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="replace")

    def data(self, text: str) -> None:
        """Print a line or block of the result to stdout."""
        self._print([text])

    def data_from(self, file: TextIO) -> None:
        """Print what is left of a text file to stdout, piece by piece, and an end of line."""
        self._print(iter(lambda: file.read(_PIECE), ""))

    def _print(self, pieces: Iterable[str]) -> None:
        if sys.stdout is None:
            raise LashbenchError("there is no stdout to write the result to; leave it open")
        self._clear()
        try:
            for piece in pieces:
                print(visible(piece), end="")  # noqa: T201
            print(flush=True)  # noqa: T201
        except BrokenPipeError:
            raise
        except OSError as error:
            hush(sys.stdout)
            raise LashbenchError(
                f"the output could not be written ({error.strerror}); send it where there is room"
            ) from error

    def document(self, content: Mapping[str, Any]) -> None:
        """Print the one JSON document of a run to stdout."""
        self.data(as_json(content))

    def note(self, text: str) -> None:
        """Print a line of narration to stderr."""
        _LOG.info("%s", text)
        if not self.quiet:
            self._clear()
            self._narrate(f"{visible(text)}\n")

    def error(self, text: str) -> None:
        """Print an error to stderr, as one line whatever it holds."""
        _LOG.error("%s", " ".join(text.split()))
        self._clear()
        self._narrate(f"error: {visible(' '.join(text.split()))}\n")

    @contextmanager
    def unhurried(self) -> Iterator[None]:
        """Narrate without ever waiting for whoever reads it; no data, meanwhile.

        Nor afterwards, if it is not read by then.
        """
        try:
            self._live.narrator = narrator = Narrator(sys.stderr)
        except (AttributeError, OSError, ValueError):
            # No file is behind it, which could make anybody wait.
            yield
            return
        try:
            yield
        finally:
            if narrator.has_said_all(_PATIENCE_S):
                self._live.narrator = None
                narrator.end()

    @property
    def watched(self) -> bool:
        """Whether somebody sees what is drawn in place."""
        return not self.quiet and sys.stderr.isatty()

    def progress(self, fraction: float, text: str = "", remaining_s: float | None = None) -> None:
        """Show how far the work is, in place; where stderr is no terminal, a line now and then.

        Parameters
        ----------
        fraction
            Done so far, 0 to 1; one that is smaller than before begins another job.
        remaining_s
            Time left; estimated from the pace so far, if left out.
        """
        _LOG.debug("%3.0f %% %s", 100.0 * fraction, text)
        fraction = min(max(fraction, 0.0), 1.0)
        if not self.watched:
            self._tell_now_and_then(f"{100 * fraction:3.0f} %  {text}")
            return
        if remaining_s is None:
            remaining_s = self._live.pace.remaining_s(fraction)
        left = "" if remaining_s is None else f"{duration(remaining_s)} left  "
        line = f"{100 * fraction:3.0f} %  {left}{visible_line(text)}"
        self._narrate(f"\r\x1b[K{line[:78]}", fleeting=True)

    def _tell_now_and_then(self, line: str) -> None:
        now_s = time.monotonic()
        if self._live.told_s is None:
            self._live.told_s = now_s
        if not self.quiet and now_s - self._live.told_s >= _TELLING_S:
            self._live.told_s = now_s
            self._narrate(f"{line}\n")

    def picture(self, lines: Sequence[str]) -> None:
        """Draw lines in place of those drawn before; only where they fit on a terminal."""
        if not self.watched or self._height() < len(lines) + 2:
            return
        drawn = "".join(f"{visible_line(line)}\n" for line in lines)
        self._narrate(f"{self._erasure()}{drawn}")
        self._live.lines = len(lines)

    def ask(self, question: str) -> str | None:
        """What a person answers; None where there is nobody to ask."""
        if not (self.watched and sys.stdin.isatty()):
            return None
        self.prompt(question)
        return sys.stdin.readline().strip()

    def prompt(self, text: str) -> None:
        """Print a question to stderr, also where quiet, and leave its line open for the answer."""
        self._clear()
        self._narrate(visible(text))

    def _height(self) -> int:
        """Lines of the terminal; the usual 24 where it does not say."""
        try:
            return os.get_terminal_size(sys.stderr.fileno()).lines or 24
        except OSError:
            return 24

    def _clear(self) -> None:
        if self.watched:
            self._narrate(self._erasure())
            self._live.lines = 0

    def _narrate(self, text: str, fleeting: bool = False) -> None:
        """Write to stderr; whoever stopped listening there does not stop the work."""
        if self._live.narrator is not None:
            self._live.narrator.say(text, fleeting)
            return
        try:
            print(text, end="", file=sys.stderr, flush=True)  # noqa: T201
        except OSError:
            hush(sys.stderr)

    def _erasure(self) -> str:
        """What takes picture and progress off the terminal."""
        up = f"\x1b[{self._live.lines}A" if self._live.lines else ""
        return f"\r{up}\x1b[J"


Injected = Annotated[Console, Parameter(parse=False, show=False)]
"""A parameter of a verb that `tui.cli` fills in; it is no option."""


def hush(stream: TextIO) -> None:
    """Send what is left for a stream nowhere: Python would complain of it once more at its end."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


@contextmanager
def readers_may_leave() -> Iterator[None]:
    """Print where the exit code says something, too: it counts, whether or not all was read.

    Elsewhere a reader who has seen enough ends a verb, and that is no failure (`tui.cli`).
    """
    try:
        yield
    except BrokenPipeError:
        hush(sys.stdout)


def as_json(content: Mapping[str, Any], indent: int | None = 1) -> str:
    """A JSON document, in one line without an indent; what is not a finite number becomes null."""
    return json.dumps(_plain(content), indent=indent, allow_nan=False)


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    return value
