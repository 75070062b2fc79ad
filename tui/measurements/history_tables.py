"""Measurements of a history as tables for a terminal: what was measured, judged, corrected, found.

Owns the lines of ``lashbench history``. It reads the audit trail alone, and judges nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tui.measurements.history_rows import QUANTITIES, answer_words, correction_words, told_groups
from tui.text.layout import WIDTH, table_lines, wrapped

if TYPE_CHECKING:
    from daq.store import Store

__all__ = ["corrected_lines", "estimated_lines", "judged_lines", "measured_table"]

_BAR, _LEAST_BAR = 41, 11
"""Columns from a ratio of 0 to one of 1, and how few of them there may be beside long numbers."""


def measured_table(rows: Sequence[dict[str, Any]]) -> list[str]:
    """What was measured when, and how far; names of units and specimens may be long."""
    return table_lines(
        ("id", "started (UTC)", "unit", "serial", "state", "points"),
        [
            (
                str(row["id"]),
                row["started"][:16].replace("T", " "),
                row["unit"] + (" (SIMULATED)" if row["simulated"] else ""),
                row["serial"] or "-",
                row["state"],
                f"{row['points']}/{row['planned']}",
            )
            for row in rows
        ],
        may_wrap=(2, 3),
    )


def judged_lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """The verdict of each measurement, where there are limits, and what is wrong or open."""
    from analysis.acceptance import reasons

    lines = []
    for row in rows:
        judged = row.get("judgement")
        if judged is not None:
            what = reasons(judged["failed"], judged["undecided"])
            text = f"{judged['verdict']:9}  #{row['id']}  {what}"
            lines += wrapped(text.rstrip(), indent="  ")
    if not lines:
        return []
    first = rows[0]["judgement"]
    return ["", f"by limits {first['limits']['name']}", *lines]


def corrected_lines(store: Store, rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """The audit trail of what is listed."""
    lines = []
    for row in rows:
        for one in store.corrections(row["id"]) if row["corrections"] else ():
            lines += wrapped(f"#{row['id']}: {correction_words(one)}", indent="  ")
    return ["", *lines] if lines else []


def estimated_lines(rows: Sequence[dict[str, Any]]) -> list[str]:
    """What is accepted of each unit, the contribution ratio as a dot with its bar from 0 to 1, too.

    Below each measurement stands what was diagnosed and what there is to be warned of.
    """
    lines = []
    for (unit, serial), group in told_groups(rows).items():
        name = f"{unit} {serial}".strip()
        numbers = [
            tuple(
                _shown(row[name], digits)
                for name, digits in zip(QUANTITIES, (3, 4, 4), strict=True)
            )
            for row in group
        ]
        head = ("r", "b1 / deg", "b2 / deg")
        widths = [max(map(len, column)) for column in zip(head, *numbers, strict=True)]
        left = max(5, *(len(str(row["id"])) for row in group))
        bar = min(_BAR, max(_LEAST_BAR, WIDTH - left - 1 - sum(widths) - 2 * len(widths)))
        title = f"backlash of {name}; contribution ratio r from 0 to 1; one standard error"
        lines += ["", *wrapped(title)]
        pictured = [(str(row["id"]), _bar(row["contribution_ratio"], bar)) for row in group]
        said = [[], *map(answer_words, group)]
        for (key, picture), texts, words in zip(
            [("", f"0{'':{bar - 2}}1"), *pictured], [head, *numbers], said, strict=True
        ):
            cells = (f"{text:<{width}}" for text, width in zip(texts, widths, strict=True))
            lines.append("  ".join((f"{key:>{left}} {picture}", *cells)).rstrip())
            indent = " " * (left + 1)
            for word in words:
                lines += [indent + part for part in wrapped(word, WIDTH - len(indent), "  ")]
    return lines


def _shown(number: Mapping[str, float] | None, digits: int) -> str:
    if not number:
        return "-"
    return f"{number['value']:.{digits}f} +- {number['std'] or 0.0:.{digits}f}"


def _bar(ratio: Mapping[str, float] | None, width: int) -> str:
    if not ratio:
        return " " * width

    def place(value: float) -> int:
        return round(min(max(value, 0.0), 1.0) * (width - 1))

    cells = ["."] * width
    value, std = ratio["value"], ratio["std"] or 0.0
    for cell in range(place(value - std), place(value + std) + 1):
        cells[cell] = "-"
    cells[place(value)] = "o"
    return "".join(cells)
