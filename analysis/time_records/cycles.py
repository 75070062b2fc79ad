"""Cycles of a sine that steps or glides, and the dwells in which it stays.

Owns where a cycle of the input begins and which cycles have one frequency and level. It knows no
output.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.signal import hilbert

from daq.time_records.record import TimeRecord

__all__ = ["Dwell", "cycle_starts", "find_dwells"]

_TURN = 0.06
"""A cycle that begins this share of a period early or late belongs to another frequency."""
_AMPLITUDE = 0.06
_LEAST_CYCLES = 6
_FIRST = 4
"""Cycles by which a dwell is recognised."""


@dataclass(frozen=True, slots=True)
class Dwell:
    """A stretch of one frequency and level.

    `start_s` is when its first whole cycle begins, of `cycles` cycles. `bend` is by how many
    periods the cycles between run late or early: a sine that glides has it, one that stays not.
    """

    start_s: float
    frequency_hz: float
    cycles: int
    amplitude: float
    bend: float


def cycle_starts(record: TimeRecord) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """When each cycle of the input begins, s, and its amplitude, V peak."""
    analytic = np.asarray(hilbert(record.input_v - np.mean(record.input_v)), dtype=complex)
    size = np.abs(analytic)
    turns = np.maximum.accumulate(np.unwrap(np.angle(analytic))) / (2.0 * np.pi)
    whole = np.arange(np.ceil(turns[0]), np.floor(turns[-1]) + 1.0)
    at = np.searchsorted(turns, whole)
    at = at[(at > 0) & (at < turns.size)]
    whole = whole[-at.size :] if at.size else whole[:0]
    step = turns[at] - turns[at - 1]
    part = np.where(step > 0.0, (whole - turns[at - 1]) / np.where(step > 0.0, step, 1.0), 0.0)
    sums = np.concatenate([[0.0], np.cumsum(size)])
    count = np.maximum(np.diff(at), 1)
    amplitude = (sums[at[1:]] - sums[at[:-1]]) / count
    return (at - 1 + part) / record.rate_hz, amplitude


def find_dwells(record: TimeRecord) -> list[Dwell]:
    """Stretches of one frequency and level, in the order of time."""
    starts, amplitude = cycle_starts(record)
    begins = _where_even(starts)
    found: list[Dwell] = []
    first = 0
    while first + _FIRST < len(amplitude):
        if not begins[first]:
            # Straight to the next cycle at which a dwell may begin.
            onwards = begins[first : len(amplitude) - _FIRST]
            if not onwards.any():
                break
            first += int(np.argmax(onwards))
        last = _end_of_dwell(starts, amplitude, first)
        # The cycles at both ends carry the change.
        cycles = last - first - 2
        if cycles >= _LEAST_CYCLES:
            k = np.arange(first + 1, last)
            period, start = np.polyfit(k - k[0], starts[k], 1)
            curve = float(np.polyfit((k - k[0]) / (k.size - 1), starts[k], 2)[0])
            level = float(np.median(amplitude[k[:-1]]))
            found.append(
                Dwell(float(start), 1.0 / float(period), cycles, level, curve / 4.0 / float(period))
            )
        first = last
    return found


def _where_even(starts: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether the cycles from each one on (cycles - `_FIRST`,) follow one another evenly."""
    if starts.size <= _FIRST:
        return np.zeros(0, dtype=bool)
    window = sliding_window_view(starts, _FIRST + 1)
    k = np.arange(_FIRST + 1) - _FIRST / 2.0
    period = window @ k / np.sum(k * k)
    off = window - window.mean(axis=1)[:, None] - period[:, None] * k
    return np.asarray((period > 0.0) & (np.abs(off).max(axis=1) <= _TURN * period))


def _end_of_dwell(starts: NDArray[np.float64], amplitude: NDArray[np.float64], first: int) -> int:
    """Index one past the last cycle that fits those before it, of a dwell that begins here."""
    t = starts[first : first + _FIRST + 1]
    n = t.size
    k = np.arange(n, dtype=float)
    period = float(np.sum((k - k.mean()) * t) / np.sum((k - k.mean()) ** 2))
    level = float(np.median(amplitude[first + 1 : first + _FIRST]))
    sums = np.array([n, k.sum(), (k * k).sum(), t.sum(), (k * t).sum()])
    strange = 0
    at = first + n
    while at < len(amplitude):
        j = float(at - first)
        slope = (sums[0] * sums[4] - sums[1] * sums[3]) / (sums[0] * sums[2] - sums[1] ** 2)
        offset = (sums[3] - slope * sums[1]) / sums[0]
        late = abs(starts[at] - offset - slope * j) > _TURN * period
        other = abs(amplitude[at] - level) > _AMPLITUDE * level
        strange = strange + 1 if late or other else 0
        if strange == 2:
            return at - 2
        if not late:
            sums += [1.0, j, j * j, starts[at], j * starts[at]]
        at += 1
    return at - strange
