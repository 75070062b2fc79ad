"""A judgement in the words of the screens: the verdict first, then what it rests on.

Owns their order. `analysis.acceptance` decides and words each limit; nothing here does.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from analysis.acceptance import Judgement
    from tui.app.state.desk import Results

__all__ = ["STAGES", "SHORT", "headline", "item_lines", "progress_lines"]

STAGES = ("b1_deg", "b2_deg")
"""Quantities that the lines of the stages tell."""

SHORT = {"PASS": "PASS", "FAIL": "FAIL", "UNDECIDED": "UNDEC."}
"""Verdicts where a table has little room."""

_ORDER = ("FAIL", "UNDECIDED", "PASS")


def headline(judgement: Judgement | None) -> list[str]:
    """The verdict and what it rests on; nothing where nobody judges."""
    return [] if judgement is None else [judgement.headline]


def item_lines(judgement: Judgement | None, but: Collection[str] = ()) -> list[str]:
    """A line for each limit, with its reason: those that fail first.

    Parameters
    ----------
    but
        Quantities that are told elsewhere.
    """
    if judgement is None:
        return []
    items = sorted(judgement.items, key=lambda item: _ORDER.index(item.verdict))
    return [item.line for item in items if item.quantity not in but]


def progress_lines(results: Results, progress: tuple[float, str] | None) -> list[str]:
    """Why nothing is judged, or what is estimated for it."""
    if "judgement" in results.faults:
        return [f"NOT JUDGED: {results.faults['judgement']}"]
    if progress is not None and progress[0] > 0.0:
        return [f"judging: estimating the total backlash, too, {100 * progress[0]:.0f} %"]
    return []
