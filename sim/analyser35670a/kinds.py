"""Kinds of settings: how a value is read from arguments and shown in a reply.

Owns numbers, switches, choices and texts, with their ranges, bounds and
steps, and the instrument's way of printing. It keeps no value and knows no
command by name.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from sim.analyser35670a.commands.tokens import Argument
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.units import NONE, Quantity, UnitTable

__all__ = [
    "Expression",
    "Kind",
    "Number",
    "Pick",
    "Quoted",
    "Switch",
    "Text",
    "Whole",
    "one_argument",
    "show_integer",
    "show_real",
]


def show_real(value: float, digits: int = 12) -> str:
    """A real as the instrument prints it: signed, with a signed three-digit exponent."""
    if not math.isfinite(value):
        value = 9.91e37 if math.isnan(value) else math.copysign(9.9e37, value)
    # Zero prints with a plus sign whatever its sign bit says.
    mantissa, exponent = f"{value + 0.0:+.{digits - 1}E}".split("E")
    return f"{mantissa}E{int(exponent):+04d}"


def show_integer(value: int) -> str:
    """An integer as the instrument prints it."""
    return f"{value:+d}"


def one_argument(arguments: Sequence[Argument]) -> Argument:
    """The only argument.

    Raises
    ------
    ScpiError
        -109 if there is none, -104 if there are more.
    """
    if not arguments:
        raise ScpiError(-109)
    if len(arguments) > 1:
        raise ScpiError(-104)
    return arguments[0]


class Kind(Protocol):
    """How one setting is read and shown."""

    def read(self, arguments: Sequence[Argument], kept: Any) -> Any:
        """The new value, given the old one."""
        ...

    def show(self, value: Any) -> str:
        """The value as a reply."""
        ...


@dataclass(frozen=True, slots=True)
class Switch:
    """On or off."""

    def read(self, arguments: Sequence[Argument], kept: Any) -> bool:
        """OFF, ON or a number."""
        argument = one_argument(arguments)
        if argument.kind == "number":
            if argument.suffix:
                raise ScpiError(-131)
            return abs(argument.number) >= 0.5
        if argument.kind != "word":
            raise ScpiError(-120)
        if argument.text not in ("ON", "OFF"):
            raise ScpiError(-141)
        return argument.text == "ON"

    def show(self, value: Any) -> str:
        """+0 or +1."""
        return show_integer(int(value))


@dataclass(frozen=True, slots=True)
class Pick:
    """One of a few words, each with a short form in capitals."""

    words: tuple[str, ...]

    def read(self, arguments: Sequence[Argument], kept: Any) -> str:
        """The short form of the word sent."""
        argument = one_argument(arguments)
        if argument.kind == "number" and "OFF" in self.words and argument.number == 0:
            return "OFF"
        if argument.kind not in ("word", "number"):
            raise ScpiError(-120)
        for word in self.words:
            short = "".join(part for part in word if not part.islower())
            if argument.text in (short, word.upper()):
                return short
        raise ScpiError(-141)

    def show(self, value: Any) -> str:
        """The short form."""
        return str(value)


@dataclass(frozen=True, slots=True)
class Quoted:
    """One of a few words, sent and shown between quotes."""

    words: tuple[str, ...]

    def read(self, arguments: Sequence[Argument], kept: Any) -> str:
        """The word, in any case."""
        argument = one_argument(arguments)
        word = argument.text.strip().upper()
        if argument.kind != "string" or word not in self.words:
            raise ScpiError(-151)
        return word

    def show(self, value: Any) -> str:
        """In double quotes."""
        return f'"{value}"'


_TERMS = re.compile(
    r"(?:AWEIGHT|BWEIGHT|CWEIGHT|CONJ|DIFF|DJOM|EXP|FFT|IFFT|INTEG|IMAG|LN|MAG|PSD|REAL|SQRT|XJOM"
    r"|ACORR[1-4]?|CDF[1-4]?|COH(?:21|31|41|43)?|CPOW[1-4]?|CSPEC(?:21|31|41|43)?"
    r"|FRES(?:21|31|41|43)?|HIST[1-4]?|LSPEC[1-4]?|NVAR[1-4]?|PDF[1-4]?|PSPEC[1-4]?|RPM"
    r"|TIME[1-4]?|TRACK[1-5][1-4]|WTIME[1-4]?|XCORR(?:21|31|41|43)?|D[1-8]|F[1-5]|K[1-5]"
    r"|[-+*/()\s])*"
)


@dataclass(frozen=True, slots=True)
class Expression:
    """A function of trace data between parentheses; kept as it was sent."""

    longest: int = 270

    def read(self, arguments: Sequence[Argument], kept: Any) -> str:
        """What was sent, if it consists of operations and operands."""
        argument = one_argument(arguments)
        if argument.kind != "expression" or len(argument.text) > self.longest:
            raise ScpiError(-120)
        if not _TERMS.fullmatch(argument.text):
            raise ScpiError(-120)
        return argument.text

    def show(self, value: Any) -> str:
        """In double quotes."""
        return f'"{value}"'


@dataclass(frozen=True, slots=True)
class Text:
    """A quoted string."""

    longest: int = 80

    def read(self, arguments: Sequence[Argument], kept: Any) -> str:
        """What stands between the quotes."""
        argument = one_argument(arguments)
        if argument.kind != "string" or len(argument.text) > self.longest:
            raise ScpiError(-151)
        return argument.text

    def show(self, value: Any) -> str:
        """In double quotes, inner ones doubled."""
        return '"' + str(value).replace('"', '""') + '"'


@dataclass(frozen=True, slots=True)
class Number:
    """A real with a unit.

    Parameters
    ----------
    low, high
        Range in the bare unit, or by unit in `ranges`.
    units
        Suffixes accepted.
    step
        What UP and DOWN change, in the unit kept.
    ranges
        Range by unit, for units that do not convert into each other.
    """

    low: float
    high: float
    units: UnitTable = NONE
    step: float = 1.0
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)

    def read(self, arguments: Sequence[Argument], kept: Any) -> Quantity:
        """The number sent, a bound, or the next step."""
        quantity = self.read_free(arguments, kept)
        low, high = self.ranges.get(quantity.unit, (self.low, self.high))
        if not low <= quantity.value <= high:
            raise ScpiError(-222, "Out of range: value not changed.")
        return quantity

    def read_free(self, arguments: Sequence[Argument], kept: Quantity) -> Quantity:
        """As `read`, without looking at the range."""
        argument = one_argument(arguments)
        if argument.kind == "word":
            return self._bound_or_step(argument.text, kept)
        if argument.kind != "number":
            raise ScpiError(-120)
        return self.units.read(argument.number, argument.suffix, kept.unit)

    def _bound_or_step(self, word: str, kept: Quantity) -> Quantity:
        low, high = self.ranges.get(kept.unit, (self.low, self.high))
        match word:
            case "MIN" | "MINIMUM":
                return Quantity(low, kept.unit)
            case "MAX" | "MAXIMUM":
                return Quantity(high, kept.unit)
            case "UP":
                return Quantity(min(kept.value + self.step, high), kept.unit)
            case "DOWN":
                return Quantity(max(kept.value - self.step, low), kept.unit)
        raise ScpiError(-141)

    def show(self, value: Any) -> str:
        """The value in the unit kept."""
        return show_real(value.value)


@dataclass(frozen=True, slots=True)
class Whole:
    """A whole number without unit."""

    low: int
    high: int

    def read(self, arguments: Sequence[Argument], kept: Any) -> int:
        """The number sent, rounded, a bound, or the next step."""
        number = Number(self.low, self.high)
        value = number.read_free(arguments, Quantity(float(kept))).value
        # Beyond any range, and round() would raise on an infinity.
        if not abs(value) < 1e15 or not self.low <= round(value) <= self.high:
            raise ScpiError(-222, "Out of range: value not changed.")
        return round(value)

    def show(self, value: Any) -> str:
        """Signed."""
        return show_integer(value)
