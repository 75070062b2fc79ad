"""What a Bode plot draws of traces and predictions: layers of gain and phase, and their span.

Owns which layer lies above which, and when marks give way to dots. It draws nothing itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from tui.app.plot.layers import Band, Bars, Curve, Layer, Marks
from tui.app.plot.palette import Palette
from tui.app.plot.traces import LEVEL_MARKS, Prediction, Trace, continuous_phase

__all__ = ["gain_layers", "phase_layers"]

_CROWDED = 1.5
"""Columns a point below which most clean points are dots of the line."""

_MARKED = 8
"""Columns from one mark to the next then: the shape tells a trace also without colour."""

_LONGEST_BAR_DB = 20.0
"""Bars that are longer do not widen the axis."""

Span = tuple[float, float] | None
Array = NDArray[np.float64]


def gain_layers(
    traces: Sequence[Trace],
    predictions: Sequence[Prediction],
    band_hz: tuple[float, float],
    palette: Palette,
    columns: int,
) -> tuple[list[Layer], Span]:
    """Layers of the gain, dB, the last on top, and the span of what lies in a band.

    Parameters
    ----------
    columns
        Width of the plot, in cells.
    """
    bands: list[Layer] = []
    curves: list[Layer] = []
    seen: list[Array] = []
    for one in predictions:
        low, high = one.gain_band_db
        bands.append(Band(one.frequency_hz, low, high, palette.tint(one.colour)))
        curves.append(Curve(one.frequency_hz, one.gain_db, palette.colour(one.colour), dashed=True))
        seen += [part[_within(one.frequency_hz, band_hz)] for part in (low, high)]
    marks: list[Layer] = []
    for trace in traces:
        gain = np.where(trace.usable, trace.gain_db, np.nan)
        bars = np.minimum(trace.bars_db, _LONGEST_BAR_DB)
        here = _within(trace.frequency_hz, band_hz)
        seen += [(gain - bars)[here], (gain + bars)[here]]
        if trace.reference:
            curves.insert(0, Curve(trace.frequency_hz, gain, palette.ink))
            continue
        colour = palette.colour(trace.colour)
        if predictions:
            marks.append(Bars(trace.frequency_hz, gain - bars, gain + bars, colour))
        else:
            bands.append(
                Band(trace.frequency_hz, gain - bars, gain + bars, palette.tint(trace.colour))
            )
            curves.append(Curve(trace.frequency_hz, gain, colour))
        marks += _marks(trace, trace.gain_db, here, palette, columns)
    return [*bands, *curves, *marks], _span(seen)


def phase_layers(
    traces: Sequence[Trace],
    predictions: Sequence[Prediction],
    band_hz: tuple[float, float],
    palette: Palette,
    columns: int,
) -> tuple[list[Layer], Span]:
    """The same of the phase, degrees, without jumps of 360 degrees."""
    known = [np.where(trace.usable, trace.phase_deg, np.nan) for trace in traces]
    smooth = continuous_phase([*known, *(one.phase_deg for one in predictions)])
    bands: list[Layer] = []
    curves: list[Layer] = []
    marks: list[Layer] = []
    seen: list[Array] = []
    for one, phase in zip(predictions, smooth[len(traces) :], strict=True):
        low, high = one.phase_band_deg + (phase - one.phase_deg)
        bands.append(Band(one.frequency_hz, low, high, palette.tint(one.colour)))
        curves.append(Curve(one.frequency_hz, phase, palette.colour(one.colour), dashed=True))
        seen.append(phase[_within(one.frequency_hz, band_hz)])
    for trace, phase in zip(traces, smooth[: len(traces)], strict=True):
        here = _within(trace.frequency_hz, band_hz)
        seen.append(phase[here])
        if trace.reference:
            curves.insert(0, Curve(trace.frequency_hz, phase, palette.ink))
            continue
        if not predictions:
            curves.append(Curve(trace.frequency_hz, phase, palette.colour(trace.colour)))
        marks += _marks(trace, phase, here, palette, columns)
    return [*bands, *curves, *marks], _span(seen)


def _marks(
    trace: Trace, values: Array, here: NDArray[np.bool_], palette: Palette, columns: int
) -> list[Layer]:
    """The points of a trace; flagged ones always by their own mark."""
    signs = np.array(trace.marks, dtype="<U1")
    flagged = signs != trace.mark
    colour = palette.colour(trace.colour)
    # Sessions laid over each other crowd each other.
    crowded = bool(trace.series) or here.sum() * _CROWDED > columns
    # Traces of the same frequencies have their marks at different ones.
    apart = max(1, math.ceil(_MARKED * here.sum() / max(1, columns))) if crowded else 1
    first = apart * trace.colour // len(LEVEL_MARKS)
    shown = flagged | (np.arange(len(signs)) % apart == first % apart)
    layers: list[Layer] = []
    if crowded:
        clean = np.where(flagged, np.nan, values)
        # Single dots: a NaN between any two points ends the line.
        layers.append(Curve(np.repeat(trace.frequency_hz, 2), _apart(clean), colour))
    colours = [palette.alert if odd else colour for odd in flagged[shown]]
    layers.append(Marks(trace.frequency_hz[shown], values[shown], signs[shown].tolist(), colours))
    return layers


def _apart(values: Array) -> Array:
    spread = np.full(2 * len(values), np.nan)
    spread[::2] = values
    return spread


def _within(frequency_hz: Array, band_hz: tuple[float, float]) -> NDArray[np.bool_]:
    low, high = band_hz
    edge = 1e-9 * high
    return (frequency_hz >= low - edge) & (frequency_hz <= high + edge)


def _span(parts: Iterable[Array]) -> Span:
    values = np.concatenate([np.zeros(0), *parts])
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if len(values) else None
