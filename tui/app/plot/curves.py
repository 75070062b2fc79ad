"""Drawings of single curves: the error index over the ratio, and a trend over sessions.

Owns how they look. The numbers come as documents of the analysis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tui.app.plot.chart import Chart, Drawing
from tui.app.plot.layers import Band, Bars, Curve, Layer, Line, Marks
from tui.app.plot.scales import Scale, linear_scale
from tui.app.plot.traces import LEVEL_MARKS

__all__ = ["index_drawing", "trend_drawing"]

_FEWEST = 5
"""Sessions that an axis has room for, however few there are."""

_APART = (8, 16)
"""Columns between two ticks."""


def index_drawing(chart: Chart, curve: Mapping[str, Any] | None) -> Drawing | None:
    """The error index in Hz over the contribution ratio, its band one standard error."""
    if not curve:
        return None
    ratio, hertz = np.array(curve["ratio"], float), np.array(curve["hz"], float)
    std = np.array([np.nan if v is None else v for v in curve["std_hz"]], float)
    known = np.where(np.isfinite(std), std, 0.0)
    low, high = hertz - known, hertz + known
    seen = np.concatenate([low, high])
    seen = seen[np.isfinite(seen)]
    if not len(seen):
        return None
    palette, (width, height) = chart.palette, chart.inner
    layers: list[Layer] = [
        Band(ratio, low, high, palette.tint(0)),
        Curve(ratio, hertz, palette.colour(0)),
        Line(float(curve["minimum_ratio"]), palette.alert, "least"),
    ]
    if 2 * len(ratio) <= width:
        marks, colours = [LEVEL_MARKS[0]] * len(ratio), [palette.colour(0)] * len(ratio)
        layers.append(Marks(ratio, hertz, marks, colours))
    return Drawing(
        "error index, Hz", "r", linear_scale(0.0, 1.0, width, _APART),
        linear_scale(float(seen.min()), float(seen.max()), height), layers,
    )  # fmt: skip


def _sessions(count: int, width: int) -> Scale:
    """Sessions from 1 on, five at least, with a tick for every one, or for 2, 5, 10 and so on."""
    shown = max(count, _FEWEST)
    steps = (part * ten for ten in (1, 10, 100, 1000) for part in (1, 2, 5))
    step = next((one for one in steps if shown / one * _APART[0] <= width), shown)
    ticks = tuple(float(number) for number in range(step, shown + 1, step))
    return Scale(0.5, shown + 0.5, width, ticks)


def trend_drawing(chart: Chart, ratios: Sequence[Mapping[str, Any]]) -> Drawing | None:
    """Contribution ratios of sessions in order, with bars of one standard error."""
    if not ratios:
        return None
    palette, (width, height) = chart.palette, chart.inner
    place = np.arange(len(ratios), dtype=float) + 1.0
    value = np.array([one["value"] for one in ratios], float)
    std = np.array([one["std"] or 0.0 for one in ratios], float)
    colours = [palette.colour(0)] * len(ratios)
    layers: list[Layer] = [
        Curve(place, value, palette.grid),
        Bars(place, value - std, value + std, palette.colour(0)),
        Marks(place, value, [LEVEL_MARKS[0]] * len(ratios), colours),
    ]
    return Drawing(
        "contribution ratio r", "session", _sessions(len(ratios), width),
        linear_scale(0.0, 1.0, height), layers,
    )  # fmt: skip
