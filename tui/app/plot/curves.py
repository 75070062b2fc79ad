"""Drawings of single curves: the error index over the ratio, and a trend over sessions.

Owns how they look. The numbers come as documents of the analysis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tui.app.plot.chart import Chart, Drawing
from tui.app.plot.layers import Band, Bars, Curve, Layer, Line, Marks
from tui.app.plot.scales import linear_scale
from tui.app.plot.traces import LEVEL_MARKS

__all__ = ["index_drawing", "trend_drawing"]

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
    count = float(len(ratios))
    return Drawing(
        "contribution ratio r", "session",
        linear_scale(0.5, count + 0.5, width, _APART, [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]),
        linear_scale(0.0, 1.0, height), layers,
    )  # fmt: skip
