"""Reading the traces of the HP 35670A: axis, complex response, variances, and what is missing.

Owns the rules that no length and no filling of a display is assumed, that
fillers are recognised, and that the byte order is proven on a ramp before any
datum is believed (programming guide, chapters 8, 18 and 23).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.driving.replies import is_filler
from daq.driving.scpi_connection import Dialogue
from daq.errors import ProtocolError
from daq.hp35670a.settings import GRID_HZ

__all__ = ["Picture", "nearest_row", "prove_byte_order", "read_axis", "read_picture"]

_REGISTER = "D1"
"""Data register that each picture is copied to, so that Y and X belong together."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """The displayed points at one moment; all arrays have shape (displayed,).

    `response` is NaN where nothing was measured yet; a normalised variance is
    NaN where the instrument gave none.
    """

    frequency_hz: NDArray[np.float64]
    response: NDArray[np.complex128]
    variance_1: NDArray[np.float64]
    variance_2: NDArray[np.float64]

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Which displayed points hold a value, shape (displayed,)."""
        return ~np.isnan(self.response)


def read_axis(dialogue: Dialogue, trace: str = "TRAC1") -> NDArray[np.float64]:
    """The X axis of a trace or register, shape (displayed,), Hz."""
    return dialogue.ask_reals(f"TRAC:X? {trace}")


def prove_byte_order(axis_hz: NDArray[np.float64], start_hz: float, stop_hz: float) -> None:
    """Check a freshly read X axis, whose values are known beforehand.

    Parameters
    ----------
    axis_hz
        As decoded big-endian, shape (displayed,).
    start_hz, stop_hz
        The band as read back.

    Raises
    ------
    ProtocolError
        If the axis is not an ascending ramp within the band; says whether the
        other byte order would make it one.
    """
    if _is_ramp(axis_hz, start_hz, stop_hz):
        return
    swapped = axis_hz.byteswap()
    hint = (
        "read little-endian they are such a ramp, so an adapter or a program in between swaps bytes"
        if _is_ramp(swapped, start_hz, stop_hz)
        else f"the first is {axis_hz[0]!r}"
        if len(axis_hz)
        else "there are none"
    )
    raise ProtocolError(
        f"the {len(axis_hz)} points of the X axis are no ramp from {start_hz:g} to {stop_hz:g} Hz "
        f"({hint}); no data are read"
    )


def _is_ramp(axis_hz: NDArray[np.float64], start_hz: float, stop_hz: float) -> bool:
    if len(axis_hz) < 2 or not np.all(np.isfinite(axis_hz)):
        return False
    if not 0.0 < start_hz < stop_hz:  # as where another program left swept sine
        return False
    # The axis may leave out its last point; with log spacing the last step is the widest.
    widest_hz = max(stop_hz - start_hz, stop_hz * math.log(stop_hz / start_hz))
    step = widest_hz / (len(axis_hz) - 1) + GRID_HZ
    return bool(
        np.all(np.diff(axis_hz) > 0)
        and abs(axis_hz[0] - start_hz) <= step
        and abs(axis_hz[-1] - stop_hz) <= step
    )


def read_picture(dialogue: Dialogue, axis_hz: NDArray[np.float64]) -> Picture:
    """Read response and variances of all displayed points.

    Parameters
    ----------
    axis_hz
        The axis as last read; it is read again if the lengths no longer agree.

    Raises
    ------
    ProtocolError
        If the lengths of the traces do not agree.
    """
    dialogue.send(f"TRAC {_REGISTER},TRAC1")
    pairs = dialogue.ask_reals(f"TRAC? {_REGISTER}")
    if len(pairs) != 2 * len(axis_hz):
        axis_hz = read_axis(dialogue, _REGISTER)
    variances = [dialogue.ask_reals(f"CALC{trace}:DATA?") for trace in (2, 3)]
    shown = len(axis_hz)
    lengths = [len(pairs), *(len(variance) for variance in variances)]
    if lengths != [2 * shown, shown, shown]:
        raise ProtocolError(
            f"the axis has {shown} points, the response {lengths[0]} numbers (two a point), the "
            f"variances {lengths[1]} and {lengths[2]}; these belong to different pictures"
        )
    return Picture(axis_hz, _response(pairs), *(_variance(values) for values in variances))


def nearest_row(axis_hz: NDArray[np.float64], frequency_hz: float) -> int | None:
    """The displayed point that stands for a frequency, None if none is as near as one step.

    The axis may end one whole step before the stop, which is then a point like
    any other; the frequency's own grid is added, so that no rounding decides.
    """
    row = int(np.argmin(np.abs(axis_hz - frequency_hz)))
    low, high = axis_hz[max(row - 1, 0)], axis_hz[min(row + 1, len(axis_hz) - 1)]
    reach = max(high - axis_hz[row], axis_hz[row] - low, GRID_HZ)
    return row if abs(axis_hz[row] - frequency_hz) <= reach + GRID_HZ else None


def _response(pairs: NDArray[np.float64]) -> NDArray[np.complex128]:
    real, imaginary = pairs[0::2], pairs[1::2]
    # In linear coordinates a point not measured yet is an exact zero.
    missing = is_filler(real) | is_filler(imaginary) | ((real == 0) & (imaginary == 0))
    response = np.where(missing, np.nan, real) + 1j * np.where(missing, np.nan, imaginary)
    return response.astype(np.complex128)


def _variance(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(is_filler(values) | (values < 0), np.nan, values)
