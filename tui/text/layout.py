"""Text laid out for a terminal of 80 columns: lines that wrap, and tables whose cells do.

Owns how many columns a text takes, and where it breaks. Nothing is cut: what finds no room on a
line goes on on the next one. It prints nothing.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence

from daq.untrusted.visible_text import visible

__all__ = ["WIDTH", "columns_of", "table_lines", "wrapped"]

WIDTH = 80
_GAP = "  "
_LEAST = 8
"""Columns that a column which may wrap keeps, however little room there is."""


def columns_of(text: str) -> int:
    """Columns that a terminal takes for a text: two for an ideograph, none for a combining mark."""
    return len(text) if text.isascii() else sum(map(_columns, text))


def _columns(sign: str) -> int:
    if unicodedata.combining(sign):
        return 0
    return 2 if unicodedata.east_asian_width(sign) in "WF" else 1


def wrapped(text: str, width: int = WIDTH, indent: str = "") -> list[str]:
    """A text in lines of up to so many columns, broken between words, or in one too long for any.

    Parameters
    ----------
    indent
        What every line but the first begins with.
    """
    lines, line = [], ""
    for word in visible(" ".join(text.split())).split(" "):
        start = f"{line} " if line.strip() else line
        if columns_of(start + word) > width and line.strip():
            lines.append(line)
            start = indent
        line = start
        for sign in word:
            if columns_of(line) + _columns(sign) > width:
                lines.append(line)
                line = indent
            line += sign
    return [*lines, line]


def table_lines(
    headers: Sequence[str],
    rows: Sequence[Sequence[str]],
    may_wrap: Sequence[int] = (),
    width: int = WIDTH,
) -> list[str]:
    """A table under its headers.

    Parameters
    ----------
    may_wrap
        Places of the columns whose cells wrap where a line would be too long, widest first.
    """
    cells = [[visible(" ".join(cell.split())) for cell in row] for row in (headers, *rows)]
    widths = [max(columns_of(row[at]) for row in cells) for at in range(len(headers))]
    room = width - len(_GAP) * (len(widths) - 1)
    while sum(widths) > room:
        widest = max(may_wrap, key=lambda at: widths[at], default=None)
        if widest is None or widths[widest] <= _LEAST:
            break
        widths[widest] -= 1
    ruled = [cells[0], ["-" * width for width in widths], *cells[1:]]
    return [line for row in ruled for line in _row_lines(row, widths)]


def _row_lines(row: Sequence[str], widths: Sequence[int]) -> list[str]:
    columns = [wrapped(cell, width) for cell, width in zip(row, widths, strict=True)]
    height = max(map(len, columns))
    filled = [lines + [""] * (height - len(lines)) for lines in columns]
    return [
        _GAP.join(
            part + " " * (width - columns_of(part))
            for part, width in zip(parts, widths, strict=True)
        ).rstrip()
        for parts in zip(*filled, strict=True)
    ]
