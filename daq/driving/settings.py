"""Settings of an instrument as declarative lines: header, unit, range, the instrument's rounding.

A driver is mostly a table of these. A value out of range is refused, never
clipped; a unit is always sent; every setting knows which read-backs still
mean what was asked for. Nothing here talks to a wire.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from daq.driving.replies import parse_integer, parse_number, parse_string, to_volts_peak
from daq.errors import LimitError, ProtocolError

__all__ = [
    "Band",
    "Choice",
    "Number",
    "Setting",
    "Switch",
    "down_to",
    "exactly",
    "near",
    "up_to",
]

_PRINTING = 1e-9
"""Relative difference that twelve printed digits may leave."""

Band = Callable[[float], tuple[float, float]]
"""How an instrument rounds: from the value asked for, the lowest and highest read-back that
still mean it."""


def exactly(value: float) -> tuple[float, float]:
    """No rounding but that of the printed digits."""
    return value, value


def down_to(step: float) -> Band:
    """Rounded down to a grid of `step`."""
    return lambda value: (value - step, value)


def up_to(step: float) -> Band:
    """Rounded up to a grid of `step`."""
    return lambda value: (value, value + step)


def near(step: float) -> Band:
    """Moved by at most one step either way."""
    return lambda value: (value - step, value + step)


class Setting(Protocol):
    """One thing that can be set and read back."""

    @property
    def name(self) -> str:
        """What it is called in messages and records, unit included."""
        ...

    @property
    def header(self) -> str:
        """The command, without parameter."""
        ...

    @property
    def asks_unit(self) -> bool:
        """Whether the unit of the read-back must be asked for."""
        ...

    def command(self, value: Any) -> str:
        """The line that sets it; raises `LimitError` for a value it cannot take."""
        ...

    def accepts(self, asked: Any, reply: str, unit: str | None = None) -> bool:
        """Whether a read-back means the value asked for; raises `ProtocolError` if unreadable."""
        ...

    def shown(self, reply: str, unit: str | None = None) -> str:
        """The read-back as it is recorded."""
        ...


@dataclass(frozen=True, slots=True)
class Number:
    """A setting that takes a number in a stated unit.

    Parameters
    ----------
    name, header
        See `Setting`.
    unit
        Suffix always sent with the value; empty for plain numbers.
    low, high
        What the instrument accepts, in `unit`; anything else is refused here.
    rounding
        Read-backs that still mean the value asked for.
    reply_units
        Other units in which the instrument may answer, all convertible to V
        peak. With `asks_unit` and none of them, the unit must be `unit`.
    asks_unit
        See `Setting`.
    """

    name: str
    header: str
    unit: str
    low: float
    high: float
    rounding: Band = exactly
    reply_units: tuple[str, ...] = ()
    asks_unit: bool = False

    def command(self, value: Any) -> str:
        """The line that sets it; raises `LimitError` unless finite and within the range."""
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not math.isfinite(value)
        ):
            raise LimitError(f"{self.name} {value!r} is not a finite number; nothing was sent")
        if not self.low <= value <= self.high:
            raise LimitError(
                f"{self.name} {value:g} is outside the instrument's {self.low:g} to "
                f"{self.high:g}; nothing was sent"
            )
        return f"{self.header} {value:.12g}" + (f" {self.unit}" if self.unit else "")

    def value_of(self, reply: str, unit: str | None = None) -> float:
        """The read-back in `self.unit`.

        Raises
        ------
        ProtocolError
            If it is no number, or in a unit that does not fit the setting.
        """
        value = parse_number(reply)
        if unit is None or unit.upper() == self.unit:
            return value
        if unit.upper() not in self.reply_units:
            raise ProtocolError(f"{self.header}? answers in {unit!r}; {self.unit} was due")
        return to_volts_peak(value, unit)

    def accepts(self, asked: Any, reply: str, unit: str | None = None) -> bool:
        """Whether the read-back lies where the instrument's rounding may put the value."""
        low, high = self.rounding(asked)
        slack = _PRINTING * max(1.0, abs(asked))
        return low - slack <= self.value_of(reply, unit) <= high + slack

    def shown(self, reply: str, unit: str | None = None) -> str:
        """The read-back in `unit`, then the unit."""
        return f"{self.value_of(reply, unit):.12g} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True)
class Choice:
    """A setting that takes one of a few words, quoted where the instrument wants a string.

    `long_words` are the longer forms in which the instrument may answer, in
    the order of `words`.
    """

    name: str
    header: str
    words: tuple[str, ...]
    long_words: tuple[str, ...] = ()
    quoted: bool = False

    @property
    def asks_unit(self) -> bool:
        """Words have no unit."""
        return False

    def command(self, value: Any) -> str:
        """The line that sets it; raises `LimitError` for a word that is not on the list."""
        if value not in self.words:
            raise LimitError(
                f"{self.name} {value!r} is not one of {', '.join(self.words)}; nothing was sent"
            )
        return f"{self.header} '{value}'" if self.quoted else f"{self.header} {value}"

    def accepts(self, asked: Any, reply: str, unit: str | None = None) -> bool:
        """Whether the read-back is the word asked for in either form, blanks and case aside."""
        forms = {_plain(asked)}
        if self.long_words:
            forms.add(_plain(self.long_words[self.words.index(asked)]))
        return _plain(parse_string(reply)) in forms

    def shown(self, reply: str, unit: str | None = None) -> str:
        """The read-back, blanks and case aside."""
        return _plain(parse_string(reply))


@dataclass(frozen=True, slots=True)
class Switch:
    """A setting that is on or off."""

    name: str
    header: str

    @property
    def asks_unit(self) -> bool:
        """A switch has no unit."""
        return False

    def command(self, value: Any) -> str:
        """The line that sets it; raises `LimitError` for anything but True and False."""
        if not isinstance(value, bool):
            raise LimitError(f"{self.name} {value!r} is neither True nor False; nothing was sent")
        return f"{self.header} {'ON' if value else 'OFF'}"

    def accepts(self, asked: Any, reply: str, unit: str | None = None) -> bool:
        """Whether the read-back is the state asked for."""
        return parse_integer(reply) == int(asked)

    def shown(self, reply: str, unit: str | None = None) -> str:
        """The read-back as on or off."""
        return "on" if parse_integer(reply) else "off"


def _plain(text: str) -> str:
    return "".join(text.split()).upper()
