"""The SR785's language: lines into commands, numbers with units, and what is refused.

Owns syntax alone: four letters, an optional question mark, arguments between commas; blanks may
stand anywhere between them. It executes nothing.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

__all__ = ["Command", "CommandFault", "ExecutionFault", "number", "parse_command", "whole"]

_COMMAND = re.compile(r"\s*(\*[A-Z]{3}|[A-Z][A-Z0-9][A-Z]{2})\s*(\?)?\s*(.*?)\s*", re.IGNORECASE)
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:E[+-]?\d{1,3})?)\s*([A-Z/%].*)?", re.IGNORECASE)


class CommandFault(Exception):
    """What cannot be read as a command: bit 5 of the standard event word."""


class ExecutionFault(Exception):
    """What can be read and cannot be done: bit 4."""


@dataclass(frozen=True, slots=True)
class Command:
    """One command: mnemonic in capitals, whether it asks, and its arguments."""

    name: str
    asks: bool
    arguments: tuple[str, ...]


def parse_command(text: str) -> Command:
    """Read one command; raises `CommandFault`."""
    match = _COMMAND.fullmatch(text)
    if match is None:
        raise CommandFault(text)
    name, mark, rest = match.groups()
    arguments = tuple(part.strip() for part in rest.split(",")) if rest else ()
    if "" in arguments:
        raise CommandFault(text)
    return Command(name.upper(), mark is not None, arguments)


def number(text: str, units: tuple[tuple[str, float], ...] = ()) -> tuple[float, int]:
    """A number and the index of its unit, whose factor is multiplied in.

    Parameters
    ----------
    units
        Names with factors to the first of them; a beginning is enough, and the first unit that
        begins so is meant. A factor of nan stands for decibels and leaves the number as it is.
    """
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise CommandFault(text)
    value, unit = float(match.group(1)), (match.group(2) or "").strip().lower()
    if not math.isfinite(value):
        raise CommandFault(text)
    if not unit:
        return value, 0
    for index, (name, factor) in enumerate(units):
        if name.lower().startswith(unit):
            return value if math.isnan(factor) else value * factor, index
    raise CommandFault(text)


def whole(text: str, low: int, high: int) -> int:
    """A whole number within bounds, in any form of number."""
    value, _ = number(text)
    if value != round(value) or not low <= value <= high:
        raise ExecutionFault(text)
    return int(value)
