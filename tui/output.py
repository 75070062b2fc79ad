"""Where everything that a verb says goes: data to stdout, narration to stderr.

Owns both streams of the command line and knows nothing of what it prints; no
other module writes to them.
"""

from __future__ import annotations

import io
import json
import logging
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from cyclopts import Parameter

__all__ = ["Console", "Injected", "as_json"]

_LOG = logging.getLogger("lashbench.console")


@dataclass(frozen=True, slots=True)
class Console:
    """The two streams of a run.

    Parameters
    ----------
    quiet
        Leave out narration and progress; data and errors remain.
    """

    quiet: bool = False

    def __post_init__(self) -> None:
        # A terminal that lacks a character (the ± of a plain C locale) shows
        # another in its place; it is no reason to lose the result.
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="replace")

    def data(self, text: str) -> None:
        """Print a line or block of the result to stdout."""
        self._clear()
        print(text, flush=True)  # noqa: T201

    def document(self, content: Mapping[str, Any]) -> None:
        """Print the one JSON document of a run to stdout."""
        self.data(as_json(content))

    def note(self, text: str) -> None:
        """Print a line of narration to stderr."""
        _LOG.info("%s", text)
        if not self.quiet:
            self._clear()
            print(text, file=sys.stderr, flush=True)  # noqa: T201

    def error(self, text: str) -> None:
        """Print an error to stderr, as one line whatever it holds."""
        _LOG.error("%s", " ".join(text.split()))
        self._clear()
        print(f"error: {' '.join(text.split())}", file=sys.stderr, flush=True)  # noqa: T201

    def progress(self, fraction: float, text: str = "") -> None:
        """Show how far the work is, in place; only where somebody watches a terminal."""
        _LOG.debug("%3.0f %% %s", 100.0 * fraction, text)
        if not self.quiet and sys.stderr.isatty():
            line = f"{100 * min(max(fraction, 0.0), 1.0):3.0f} %  {text}"
            print(f"\r\x1b[K{line[:78]}", end="", file=sys.stderr, flush=True)  # noqa: T201

    def _clear(self) -> None:
        if not self.quiet and sys.stderr.isatty():
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)  # noqa: T201


Injected = Annotated[Console, Parameter(parse=False, show=False)]
"""A parameter of a verb that `tui.cli` fills in; it is no option."""


def as_json(content: Mapping[str, Any]) -> str:
    """A JSON document; what is not a finite number becomes null."""
    return json.dumps(_plain(content), indent=1, allow_nan=False)


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
