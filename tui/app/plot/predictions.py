"""What plots draw of a diagnosis or a datasheet: predictions, residuals, distributions.

Owns that reading. A document of an earlier version may lack them: then there is nothing to draw.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tui.app.plot.chart import Chart, Drawing
from tui.app.plot.layers import Array, Band, Curve, Layer, Line, Marks
from tui.app.plot.scales import frequency_scale, linear_scale
from tui.app.plot.traces import LEVEL_MARKS, Prediction

if TYPE_CHECKING:
    from analysis.estimate.datasheet_band import DatasheetBand

__all__ = [
    "MODEL_NAMES",
    "Which",
    "band_predictions",
    "predictions_of",
    "ratio_drawing",
    "residual_drawing",
]

Which = Literal["baseline", "extended"]

MODEL_NAMES: Mapping[Which, str] = {"baseline": "plain model", "extended": "model with the cause"}

_SIGMA = 2.0
"""Standard deviations on either side that hold 95 % of readings."""

_MOST_SIGMA = 12.0
"""Departures beyond do not widen the axis of residuals."""

_APART = (8, 16)


def predictions_of(document: Mapping[str, Any], which: Which) -> list[Prediction]:
    """What a model says of each level of the first sweep; none where it is not told."""
    told = document.get("prediction")
    if not told or not told.get(which):
        return []
    levels, hertz, first = _rows(told)
    part = {name: _numbers(values) for name, values in told[which].items()}
    found = []
    for index, level in enumerate(np.unique(levels[first])):
        at = np.flatnonzero(first & (levels == level))
        at = at[np.argsort(hertz[at], kind="stable")]
        found.append(
            Prediction(
                MODEL_NAMES[which],
                hertz[at],
                part["gain_db"][at],
                _about(part["gain_db"][at], part["gain_std_db"][at]),
                part["phase_deg"][at],
                _about(part["phase_deg"][at], part["phase_std_deg"][at]),
                index,
            )
        )
    return found


def band_predictions(band: DatasheetBand) -> list[Prediction]:
    """What units of the datasheet read at each level, in the sweep that was made first."""
    found: dict[float, Prediction] = {}
    for one in band.levels:
        index = len(found)
        low, middle, high = one.gain_db
        phase_low, phase, phase_high = one.phase_deg
        prediction = Prediction(
            band.name, one.frequency_hz, middle, np.stack([low, high]),
            phase, np.stack([phase_low, phase_high]), index,
        )  # fmt: skip
        found.setdefault(one.source_vpk, prediction)
    return list(found.values())


def residual_drawing(chart: Chart, document: Mapping[str, Any], which: Which) -> Drawing | None:
    """Measured less predicted gain of each level, in standard deviations, over frequency."""
    told = document.get("prediction")
    if not told or not told.get(which):
        return None
    levels, hertz, _ = _rows(told)
    part = told[which]
    with np.errstate(divide="ignore", invalid="ignore"):
        left = _numbers(told["gain_db"]) - _numbers(part["gain_db"])
        left = left / _numbers(part["gain_std_db"])
    known = np.abs(left[np.isfinite(left)])
    if not len(known):
        return None
    palette, (width, height) = chart.palette, chart.inner
    most = float(np.clip(known.max(), 1.5 * _SIGMA, _MOST_SIGMA))
    ends = np.array([hertz.min(), hertz.max()])
    layers: list[Layer] = [
        Band(ends, np.full(2, -_SIGMA), np.full(2, _SIGMA), palette.tint(4)),
        Line(0.0, palette.ink, upright=False),
    ]
    sweeps = np.array(told["sweep"])
    for index, level in enumerate(np.unique(levels)):
        colour, mark = palette.colour(index), LEVEL_MARKS[index % len(LEVEL_MARKS)]
        for sweep in np.unique(sweeps):
            at = np.flatnonzero((levels == level) & (sweeps == sweep))
            at = at[np.argsort(hertz[at], kind="stable")]
            shown = np.clip(left[at], -most, most)
            layers.append(Curve(hertz[at], shown, colour))
            if 2 * len(at) <= width:
                layers.append(Marks(hertz[at], shown, [mark] * len(at), [colour] * len(at)))
    title = f"measured - {MODEL_NAMES[which]}, gain, sigma; shaded: 95 % of readings"
    return Drawing(
        title, "Hz", frequency_scale(float(ends[0]), float(ends[1]), width),
        linear_scale(-most, most, height), layers,
    )  # fmt: skip


def ratio_drawing(chart: Chart, document: Mapping[str, Any]) -> Drawing | None:
    """The contribution ratio by the plain and by the named model, as two distributions."""
    ratios = document.get("contribution_ratio") or {}
    named = bool(document.get("causes"))
    palette, (width, height) = chart.palette, chart.inner
    grid = np.linspace(0.0, 1.0, 8 * width)
    layers: list[Layer] = []
    labels: list[Layer] = []
    for which, number, dashed in (("baseline", 1, True), ("extended", 0, False)):
        part = ratios.get(which) or {}
        value, std = part.get("value"), part.get("std")
        if value is None or not std or (which == "extended" and not named):
            continue
        shape = np.exp(-0.5 * ((grid - value) / std) ** 2)
        layers.append(Band(grid, np.zeros(len(grid)), shape, palette.tint(number)))
        layers.append(Curve(grid, shape, palette.colour(number), dashed=dashed))
        word = "before" if which == "baseline" else "after"
        labels.append(Line(float(value), palette.colour(number), word))
    if not layers:
        return None
    title = "ratio r: before (plain model)" + (", after (with the cause)" * named)
    return Drawing(
        title, "r", linear_scale(0.0, 1.0, width, _APART),
        linear_scale(0.0, 1.0, height, (2, max(3, height)), [0.5, 1.0]), [*layers, *labels],
    )  # fmt: skip


def _rows(told: Mapping[str, Any]) -> tuple[Array, Array, Any]:
    """Level and frequency of each reading, and which belong to the first sweep."""
    sweeps = np.array(told["sweep"])
    return _numbers(told["source_vpk"]), _numbers(told["frequency_hz"]), sweeps == 0


def _about(middle: Array, std: Array) -> Array:
    """A band of one standard deviation of a single reading."""
    return np.stack([middle - std, middle + std])


def _numbers(values: Sequence[float | None]) -> Array:
    return np.array([np.nan if value is None else value for value in values], float)
