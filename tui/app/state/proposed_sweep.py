"""The sweep that the screen proposes where the operator has not said anything.

Owns the levels and the band of that proposal. It checks no limit: the session's request does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tui.measure_options import PlanOptions

if TYPE_CHECKING:
    from daq.limits import Limits

__all__ = ["LEVELS", "propose"]

LEVELS = 3
"""Source levels of a proposed sweep: a diagnosis fits some and predicts the others."""

_SHARES = (0.5, 0.73, 1.0)
"""Of the highest level; neighbours are far enough apart for a diagnosis."""

_ABOVE = 1.2
"""The highest level in multiples of a recipe's only one, where the limits allow it."""

_WITHOUT_RECIPE = PlanOptions((2.0,), 50.0, 250.0, 81)
"""The sweep of a unit without a recipe, as far as its limits allow."""


def propose(
    levels_vpk: Sequence[float] | None, limits: Limits, offset_v: float = 0.0
) -> PlanOptions:
    """Three levels where a recipe has fewer, and a whole sweep where there is no recipe.

    Parameters
    ----------
    levels_vpk
        Levels of the recipe, V peak; None without a recipe.
    limits
        What bench, unit and recipe allow together.
    offset_v
        Magnitude of the recipe's DC offset, V.
    """
    if levels_vpk is None:
        preset = _WITHOUT_RECIPE
        low = max(preset.start_hz or 0.0, limits.start_hz)
        high = min(preset.stop_hz or 0.0, limits.stop_hz)
        if high <= low:
            low, high = limits.start_hz, limits.stop_hz
        highest = min(max(preset.levels_vpk), limits.source_vpk, limits.source_peak_v)
        return PlanOptions(_levels(highest), low, high, preset.points)
    if len(levels_vpk) >= LEVELS:
        return PlanOptions()
    most = min(limits.source_vpk, limits.source_peak_v - offset_v)
    return PlanOptions(_levels(min(_ABOVE * max(levels_vpk), most)))


def _levels(highest_vpk: float) -> tuple[float, ...]:
    # The highest is not rounded: it must not pass a limit by its last digit.
    return tuple(float(f"{share * highest_vpk:.2g}") for share in _SHARES[:-1]) + (highest_vpk,)
