"""A unit file asked for value by value, in the units that catalogues use.

Owns the questions, made from the lines of a commented template, and what an answer may be. It
writes no file and converts nothing itself.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from textwrap import wrap

from daq.errors import InputError
from sim.datasheet import (
    SENSOR_GAINS,
    impossible_among,
    parse_quantity,
    shown_symbol,
    units_of,
    unusual_among,
)

__all__ = ["HELP", "ask_for_values", "ask_stages"]

HELP = """\
Give each value as the catalogue prints it, with its unit: 3.6 V/krpm, 86 gcm2.
Without a unit, the first one listed is meant. A ratio may be teeth: 72/12.
Further answers: - takes the example, < goes back one question.
"""
_VALUE = re.compile(r"^(?P<symbol>\w+) = (?P<value>[\d.eE+-]+)(?P<gap> +)# (?P<comment>.*)$")
_FILTER = ("filter_numerator", "filter_denominator")
_SKIPPED = ("schema", *_FILTER, "default")
_MAY_BE_ZERO = ("B_m", "T_f_m", "T_f_L", "b_t_deg", "b3_deg", "source_offset_v", "c_cm", "c_cL",
                "delay_s", "computing_s")  # fmt: skip
_CORNER, _DAMPING = "corner_hz", "damping"


@dataclass(frozen=True, slots=True)
class _Question:
    symbol: str
    meaning: str
    example: str
    quantity: str
    """What its units are known by: the symbol, but for the gain of a sensor in a tachometer's
    place."""


Say = Callable[[str], None]
Read = Callable[[], str]
"""The next line of input with its end; empty where the input ends."""


def ask_stages(say: Say, read: Read) -> int:
    """How many gear stages the drive has, 1 to 3."""
    while True:
        answer = _line(say, read, "gear stages between motor and load [1 / 2 / 3]: ")
        if answer in ("1", "2", "3"):
            return int(answer)
        say(f"{answer!r} is neither 1, 2 nor 3\n")


def ask_for_values(template: str, say: Say, read: Read) -> str:
    """The template with the values that a person gives.

    An answer that is no number, or cannot be beside what was given before, is asked for again.

    Parameters
    ----------
    template
        Text of a unit file, each value with a comment.
    say
        Prints text, leaving the line open.
    read
        Gives the next line.

    Raises
    ------
    InputError
        If the input ends before the last answer.
    """
    questions = _questions(template)
    values: dict[str, float] = {}
    told: dict[str, str] = {}
    place = 0
    while place < len(questions):
        question = questions[place]
        symbol = question.quantity
        answer = _line(say, read, _text(question))
        if answer == "<":
            place = max(0, place - 1)
            continue
        values.pop(symbol, None)
        told.pop(symbol, None)
        if answer != "-":
            try:
                value, unit = parse_quantity(symbol, answer)
                faults = _faults(symbol, value, values)
            except ValueError as error:
                faults = [str(error)]
            if faults:
                say("".join(f"  {fault}\n" for fault in faults))
                continue
            for text in unusual_among({symbol: value}):
                say(f"  warning: {text}\n")
            values[symbol], told[symbol] = value, answer
            if unit.name != units_of(symbol)[0].name or not unit.name:
                say(f"  = {value:.6g} {units_of(symbol)[0].name}".rstrip() + "\n")
        place += 1
    shown = {question.quantity: question.symbol for question in questions}
    return _filled(
        template,
        {shown[quantity]: value for quantity, value in values.items()},
        {shown[quantity]: answer for quantity, answer in told.items()},
    )


def _faults(symbol: str, value: float, before: dict[str, float]) -> list[str]:
    """What is wrong with an answer, alone or beside those before."""
    zero_is_allowed = symbol in _MAY_BE_ZERO
    if value < 0.0 or (value == 0.0 and not zero_is_allowed):
        return [f"{shown_symbol(symbol)} must be {'0 or more' if zero_is_allowed else 'above 0'}"]
    faults = list(impossible_among({**before, symbol: value}))
    return [*faults, "give it again, or < for the one before"] if faults else []


def _line(say: Say, read: Read, prompt: str) -> str:
    say(prompt)
    line = read()
    if not line:
        say("\n")
        raise InputError("the input ended before the last answer; nothing was written")
    return line.strip()


def _text(question: _Question) -> str:
    units = ", ".join(unit.name for unit in units_of(question.quantity) if unit.name)
    texts = [f"{question.symbol}: {question.meaning}", *([f"in {units}"] if units else [])]
    lines = [line for text in texts for line in wrap(text, 76, subsequent_indent="  ")]
    return "\n  ".join([*lines, f"(example {question.example}): "])


def _questions(template: str) -> list[_Question]:
    """One for each value, in the order of the file; the filter's as corner and damping."""
    found = []
    for line in template.splitlines():
        match = _VALUE.match(line)
        if line.startswith(_FILTER[0]):
            found += [
                _Question(_CORNER, "corner of the filter behind the tachometer", "158 Hz", _CORNER),
                _Question(_DAMPING, "damping ratio of that filter", "0.71", _DAMPING),
            ]
        elif match and match["symbol"] not in _SKIPPED:
            # After the unit, which stands first in the comment.
            parts, symbol = re.split(r"  +", match["comment"], maxsplit=1), match["symbol"]
            quantity = SENSOR_GAINS.get(parts[0], symbol) if symbol == "k_ts" else symbol
            found.append(_Question(symbol, parts[-1], match["value"], quantity))
    return found


def _filled(template: str, values: dict[str, float], told: dict[str, str]) -> str:
    values = dict(values)
    lines = []
    corner, damping = values.pop(_CORNER, None), values.pop(_DAMPING, None)
    for line in template.splitlines():
        match = _VALUE.match(line)
        symbol = match["symbol"] if match else ""
        if match and symbol in values:
            start = f"{symbol} = {_toml(values[symbol])}"
            width = len(line) - len(match["comment"]) - 2
            given = told[symbol]
            source = "" if _is_plain(given) else f"; given as {given}"
            line = f"{start:<{width - 1}} # {match['comment']}{source}"
        lines.append(line)
    text = "\n".join(lines) + "\n"
    if corner is None and damping is None:
        return text
    omega = 2.0 * math.pi * (158.0 if corner is None else corner)
    zeta = 0.71 if damping is None else damping
    square = _toml(omega**2)
    hertz = f"{omega / (2.0 * math.pi):.6g} Hz"
    written = f"{_FILTER[0]} = {square}  # 1/s^2    omega^2 of the filter, {hertz}"
    text = re.sub(rf"(?m)^{_FILTER[0]} = .*$", written, text)
    coefficients = f"[1.0, {_toml(2.0 * zeta * omega)}, {square}]"
    written = f"{_FILTER[1]} = {coefficients}  # s^2 + 2 zeta omega s + omega^2, zeta = {zeta:.6g}"
    return re.sub(rf"(?m)^{_FILTER[1]} = .*$", written, text)


def _is_plain(answer: str) -> bool:
    try:
        float(answer)
    except ValueError:
        return False
    return True


def _toml(value: float) -> str:
    text = f"{value:.9g}"
    return text if "." in text or "e" in text else f"{text}.0"
