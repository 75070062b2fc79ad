"""Reading the SR785's displays: bins one by one, whole traces in binary or ASCII, the axis.

Owns the rules that lengths are asked and never assumed, that a bin may hold no datum, and that
binary is believed only where it agrees with ASCII. Displays are only read here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from daq.driving.replies import parse_number
from daq.errors import ProtocolError
from daq.sr785.dialogue import RS232, Dialogue

__all__ = ["read_axis", "read_bin", "read_length", "read_trace", "response_of"]

_NOTHING = -3.4e38
"""What lies below this is the smallest number there is, which fills bins without a datum."""
_AGREES = 1e-5
_CHARACTERS = 16
"""Of one number in ASCII, comma included."""
_MARGIN = 1.5
_WITNESSES = 3
"""Bins whose binary value is compared with the one in ASCII."""


def _known(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bins that hold the filler become nan."""
    return np.where(values <= _NOTHING, np.nan, values)


def response_of(
    real: NDArray[np.float64], imaginary: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """A response from its two parts, nan where there is no datum: the filler, or an exact zero."""
    empty = np.isnan(real) | np.isnan(imaginary) | ((real == 0.0) & (imaginary == 0.0))
    return np.where(empty, complex(np.nan, np.nan), real + 1j * imaginary)


def read_length(dialogue: Dialogue, points: int) -> None:
    """Ask how many bins each display has: one more than points, the last of which is none.

    Raises
    ------
    ProtocolError
        If a display has another length.
    """
    for display in (0, 1):
        length = dialogue.ask_integer(f"DSPN? {display}")
        if length != points + 1:
            raise ProtocolError(
                f"{dialogue.transport.address}: display {'AB'[display]} has {length} bins, "
                f"{points + 1} were due for a sweep of {points} points"
            )


def read_axis(dialogue: Dialogue, rows: NDArray[np.int_]) -> NDArray[np.float64]:
    """Frequency of bins, Hz, shape of `rows`; one question each, there is no other way."""
    return np.array([dialogue.ask_number(f"DBIN? 0,{row}") for row in rows])


def read_bin(dialogue: Dialogue, display: int, row: int) -> float:
    """One bin of a display, nan if it holds the filler."""
    value = dialogue.ask_number(f"DSPY? {display},{row}")
    return float(_known(np.array([value]))[0])


def read_trace(dialogue: Dialogue, display: int, points: int) -> NDArray[np.float64]:
    """All bins of a display but the last, shape (points,), nan where it holds the filler.

    Raises
    ------
    ProtocolError
        If the trace has another length, or its bytes do not mean what single bins say.
    """
    if dialogue.interface == RS232:
        values = _in_ascii(dialogue, display, points + 1)
    else:
        values = dialogue.ask_floats(f"DSPB? {display}", points + 1)
        dialogue.finish(f"DSPB? {display}", dialogue.reply_s)
        _prove_bytes(dialogue, display, values)
    return _known(values[:points])


def _in_ascii(dialogue: Dialogue, display: int, count: int) -> NDArray[np.float64]:
    line = f"DSPY? {display}"

    def numbers(text: str) -> NDArray[np.float64]:
        values = np.array([parse_number(part) for part in text.split(",")])
        if len(values) != count:
            raise ProtocolError(f"{len(values)} numbers came, {count} were due")
        return values

    bound_s = dialogue.block_s + _MARGIN * count * _CHARACTERS * dialogue.character_s
    return dialogue.parsed(line, numbers, bound_s)


def _prove_bytes(dialogue: Dialogue, display: int, values: NDArray[np.float64]) -> None:
    rows = np.unique(np.linspace(0, len(values) - 2, _WITNESSES).astype(int))
    told = np.array([dialogue.ask_number(f"DSPY? {display},{row}") for row in rows])
    if _same(values[rows], told):
        return
    swapped = values.astype("<f4").byteswap().astype(np.float64)
    hint = (
        "with swapped bytes they agree, so an adapter or a program in between swaps them"
        if _same(swapped[rows], told)
        else f"the first is {values[rows[0]]:.7g}, and DSPY? says {told[0]:.7g}"
    )
    raise ProtocolError(
        f"{dialogue.transport.address}: DSPB? {display} does not agree with DSPY? ({hint}); "
        "no data are read"
    )


def _same(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    return bool(np.all(np.abs(one - other) <= _AGREES * np.abs(other)))
