"""What a command is: its header, what it does, and in which modes it exists.

Owns the declaration of commands that are more than a kept value, and the
three forms of an answer. The commands themselves stand in the tables of
`commands_*`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sim.analyser35670a.commands.tokens import Argument
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.settings import ALL_MODES, MODE_CONFLICT, Mode

__all__ = [
    "Act",
    "Answer",
    "Arguments",
    "Ask",
    "Command",
    "Hold",
    "Later",
    "Numbers",
    "no_arguments",
]

Numbers = tuple[int, ...]
Arguments = list[Argument]


@dataclass(frozen=True, slots=True)
class Later:
    """A reply that is not ready: `ready` gives it once it is."""

    ready: Callable[[], str | None]


@dataclass(frozen=True, slots=True)
class Hold:
    """The parser waits until `over`."""

    over: Callable[[], bool]


Answer = str | bytes | Later | Hold | None
Act = Callable[[InstrumentCore, Numbers, Arguments], Answer]
Ask = Callable[[InstrumentCore, Numbers, Arguments], Answer]


@dataclass(frozen=True, slots=True)
class Command:
    """A command, a query, or both.

    Parameters
    ----------
    pattern
        Header, as for `CommandTree`; a common command with its star.
    act, ask
        What the command and the query do; None where there is no such form.
    modes, refusal, option
        As for `Setting`.
    measured
        Whether the command means that a paused measurement cannot go on.
    """

    pattern: str
    act: Act | None = None
    ask: Ask | None = None
    modes: frozenset[Mode] = ALL_MODES
    refusal: tuple[int, str] = MODE_CONFLICT
    option: str = ""
    measured: bool = False


def no_arguments(arguments: Arguments) -> None:
    """Refuse any argument.

    Raises
    ------
    ScpiError
        -104.
    """
    if arguments:
        raise ScpiError(-104)
