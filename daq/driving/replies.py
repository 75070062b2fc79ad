"""The reading of SCPI replies: numbers, strings, blocks of reals, error-queue entries.

Strict parsers only: a reply that is not exactly of its kind is an error,
never a guess. It talks to no wire and knows no instrument.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.errors import ProtocolError

__all__ = [
    "QueueEntry",
    "decode_reals",
    "is_filler",
    "parse_error",
    "parse_integer",
    "parse_number",
    "parse_string",
    "to_volts_peak",
]

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(E[+-]?\d{1,3})?", re.IGNORECASE | re.ASCII)
_INTEGER = re.compile(r"[+-]?\d{1,18}", re.ASCII)
_ERROR = re.compile(r'([+-]?\d{1,18})\s*,\s*"((?:[^"]|"")*)"', re.ASCII)
_BLANK = " \t\r\n"
"""What may stand around a reply; `str.strip` alone takes control characters, too."""


def parse_number(text: str) -> float:
    """A real as the instrument prints it, such as ``+1.02400000000E+005``.

    Raises
    ------
    ProtocolError
        If the text is anything but one number.
    """
    stripped = text.strip(_BLANK)
    if not _NUMBER.fullmatch(stripped):
        raise ProtocolError(f"a number was due, but {text!r} came")
    value = float(stripped)
    if not math.isfinite(value):
        raise ProtocolError(f"a number was due, but {text!r} is too large to be one")
    return value


def parse_integer(text: str) -> int:
    """A signed integer such as ``+256``.

    Raises
    ------
    ProtocolError
        If the text is anything but one integer.
    """
    stripped = text.strip(_BLANK)
    if not _INTEGER.fullmatch(stripped):
        raise ProtocolError(f"an integer was due, but {text!r} came")
    return int(stripped)


def parse_string(text: str) -> str:
    """The content of a quoted string; bare words pass unchanged.

    Raises
    ------
    ProtocolError
        If a quote is not closed.
    """
    stripped = text.strip(_BLANK)
    if stripped[:1] not in ("'", '"'):
        return stripped
    quote = stripped[0]
    inner = stripped[1:-1]
    if len(stripped) < 2 or stripped[-1] != quote or quote in inner.replace(quote * 2, ""):
        raise ProtocolError(f"a quoted string was due, but {text!r} came")
    return inner.replace(quote * 2, quote)


@dataclass(frozen=True, slots=True)
class QueueEntry:
    """One entry of the instrument's error queue."""

    number: int
    text: str

    def __str__(self) -> str:
        return f"{self.number} {self.text}"


def parse_error(text: str) -> QueueEntry:
    """An answer to ``SYST:ERR?``: number, comma, quoted text.

    Raises
    ------
    ProtocolError
        If it has any other form.
    """
    match = _ERROR.fullmatch(text.strip(_BLANK))
    if match is None:
        raise ProtocolError(f"an error-queue entry was due, but {text!r} came")
    return QueueEntry(int(match.group(1)), match.group(2).replace('""', '"'))


def is_filler(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Where the instrument put a stand-in for "no value", shape as given.

    9.9e37 and 9.91e37 are SCPI's infinity and not-a-number; 3.4e38 is the log
    of zero. Zeros are not judged here: whether 0 can be a reading depends on
    the quantity.
    """
    return ~np.isfinite(values) | (np.abs(values) >= 9.89e37)


def decode_reals(payload: bytes) -> NDArray[np.float64]:
    """The numbers of a ``REAL,64`` block: big-endian IEEE doubles.

    Raises
    ------
    ProtocolError
        If the length is no multiple of eight.
    """
    if len(payload) % 8:
        raise ProtocolError(
            f"a block of {len(payload)} bytes holds no whole number of 8-byte reals; "
            "is the format REAL,64?"
        )
    return np.frombuffer(payload, dtype=">f8").astype(np.float64)


def to_volts_peak(value: float, unit: str) -> float:
    """A sine's amplitude in V peak from the unit that the instrument says it used.

    Raises
    ------
    ProtocolError
        If the unit is none of VPK, VRMS, DBVPK and DBVRMS. A bare V or DBV
        does not say peak or r.m.s., so it is not guessed.
    """
    match unit.upper():
        case "VPK":
            return value
        case "VRMS":
            return value * math.sqrt(2.0)
        case "DBVPK":
            return 10.0 ** (value / 20.0)
        case "DBVRMS" | "DBVR":
            return 10.0 ** (value / 20.0) * math.sqrt(2.0)
    raise ProtocolError(f"amplitude {value} came in {unit!r}; VPK, VRMS, DBVPK or DBVRMS was due")
