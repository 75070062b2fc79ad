"""A Bode plot as plain text: gain over phase on log frequency, one mark for each source level.

Owns the drawing. It prints nothing, knows no colour, and uses letters that any
terminal, log file or mail has.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

__all__ = ["MARKS", "bode_lines"]

MARKS = "ox+*#@"
"""Marks of the levels, lowest level first; they begin anew where there are more."""

_LEFT = 7
_PHASE_DEG = (-180.0, 180.0)

Point = tuple[float, complex]
"""Frequency in Hz and V_o/V_i."""


def bode_lines(
    levels: Mapping[float, Sequence[Point]],
    span_hz: tuple[float, float],
    *,
    width: int = 78,
    rows: tuple[int, int] = (11, 5),
) -> list[str]:
    """Draw what has been measured so far.

    Parameters
    ----------
    levels
        Points by source level in V peak; points that are no number are left out.
    span_hz
        Ends of the frequency axis, whatever has been measured of it.
    width
        Characters of a line, at least 40.
    rows
        Lines of gain and of phase.

    Returns
    -------
    list of str
        Always as many lines, so that one picture can be drawn over another.
    """
    columns = max(width, 40) - _LEFT - 1
    gain: dict[str, list[tuple[float, float]]] = {}
    phase: dict[str, list[tuple[float, float]]] = {}
    marks = {level: MARKS[at % len(MARKS)] for at, level in enumerate(sorted(levels))}
    for level, points in levels.items():
        sound = [(hertz, h) for hertz, h in points if math.isfinite(abs(h)) and abs(h) > 0.0]
        across = [(_share(hertz, span_hz), h) for hertz, h in sound]
        gain[marks[level]] = [(x, 20.0 * math.log10(abs(h))) for x, h in across]
        phase[marks[level]] = [(x, math.degrees(math.atan2(h.imag, h.real))) for x, h in across]
    legend = "   ".join(f"{mark} {level:g} V peak" for level, mark in sorted(marks.items()))
    return [
        f"{'gain, dB':<{_LEFT + columns // 2 - 4}}{legend}"[:width].rstrip(),
        *_panel(gain, _limits(gain), rows[0], columns),
        "phase, degrees",
        *_panel(phase, _PHASE_DEG, rows[1], columns),
        *_frequency_axis(span_hz, columns),
    ]


def _share(hertz: float, span_hz: tuple[float, float]) -> float:
    low, high = span_hz
    return math.log(hertz / low) / math.log(high / low) if high > low else 0.5


def _limits(marks: Mapping[str, Sequence[tuple[float, float]]]) -> tuple[float, float]:
    """Whole steps of 5 around all values; 10 wide at least, so that noise fills no panel."""
    values = [value for points in marks.values() for _, value in points] or [0.0]
    low, high = 5.0 * math.floor(min(values) / 5.0), 5.0 * math.ceil(max(values) / 5.0)
    return low, max(high, low + 10.0)


def _panel(
    marks: Mapping[str, Sequence[tuple[float, float]]],
    limits: tuple[float, float],
    rows: int,
    columns: int,
) -> list[str]:
    cells = [[" "] * columns for _ in range(rows)]
    low, high = limits
    for mark, points in marks.items():
        for x, value in points:
            row = round((high - value) / (high - low) * (rows - 1))
            column = round(x * (columns - 1))
            if 0 <= row < rows and 0 <= column < columns:
                cells[row][column] = mark
    labels = {0: f"{high:g}", rows - 1: f"{low:g}"}
    if rows % 2:
        labels[rows // 2] = f"{(low + high) / 2:g}"
    return [
        f"{labels.get(row, ''):>{_LEFT - 1}} |{''.join(line).rstrip()}"
        for row, line in enumerate(cells)
    ]


def _frequency_axis(span_hz: tuple[float, float], columns: int) -> list[str]:
    """A line with ticks and a line with what they stand at."""
    low, high = span_hz
    rule, text = ["-"] * columns, [" "] * columns
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        at = round(share * (columns - 1))
        rule[at] = "+"
        label = f"{low * (high / low) ** share:.4g}"
        begin = min(max(at - len(label) // 2, 0), columns - len(label))
        text[begin : begin + len(label)] = label
    return [f"{'':>{_LEFT}}{''.join(rule)}", f"{'Hz':>{_LEFT - 1}} {''.join(text).rstrip()}"]
