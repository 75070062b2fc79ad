"""The cells of the history's table, for wide and for narrow terminals.

Owns columns, widths and what stands in them. It reads no history.
"""

from __future__ import annotations

from typing import Any

from tui.app.judged_words import SHORT

__all__ = ["NARROW", "ROOM", "WIDE", "narrow_cells", "wide_cells"]

_ANSWERS = {"r": 11, "b1/deg": 13, "b2/deg": 13}
WIDE = {
    "": 3, "#": 6, "started": 12, "unit": 26, "state": 12, "points": 10, "judged": 10, **_ANSWERS,
}  # fmt: skip
NARROW = {"#": 7, "started": 12, "serial": 9, "state": 10, **_ANSWERS}
"""Columns with their widths, a gap included."""

ROOM = sum(WIDE.values()) + 2
"""Columns that the wide table and its scroll bar take."""

_SHORT = 8
"""Characters of a serial number on a narrow screen; the words below have all of it."""


def wide_cells(row: dict[str, Any], mark: str, in_view: bool, verdict: str = "") -> list[str]:
    """A session as the wide table shows it.

    Parameters
    ----------
    mark
        That of its curves in an overlay; empty for none.
    verdict
        What limits say of it; empty where nobody judges.
    """

    def shown(name: str, digits: int) -> str:
        number = row[name]
        if number:
            return f"{number['value']:.{digits}f}+-{number['std'] or 0.0:.{digits}f}"
        return row["answer"]["state"] if said and name == "contribution_ratio" else "-"

    said = row["estimate"] is not None or row["diagnosis"] is not None
    return [
        mark + ">" * in_view,
        str(row["id"]),
        row["started"][5:16].replace("T", " "),
        f"{row['unit']} {row['serial']}".strip() + (" SIM." if row["simulated"] else ""),
        row["state"],
        f"{row['points']}/{row['planned']}",
        verdict or "-",
        shown("contribution_ratio", 2),
        shown("b1_deg", 3),
        shown("b2_deg", 3),
    ]


def narrow_cells(
    row: dict[str, Any], mark: str, in_view: bool, verdict: str, every_unit: bool
) -> list[str]:
    """The same on 80 columns: nothing that was measured is cut.

    Its state is the verdict of a complete session, else how many points there are.
    """
    signs, number, started, unit, state, points, _, *answer = wide_cells(row, mark, in_view)
    state = SHORT.get(verdict, state) if state == "complete" else points
    name = row["serial"] if row["serial"] and not every_unit else unit
    simulated = "S" if row["simulated"] else ""
    return [f"{signs}{simulated}{number}", started, _short(name), state, *answer]


def _short(text: str) -> str:
    return text if len(text) <= _SHORT else f"{text[: _SHORT - 1]}\u2026"
