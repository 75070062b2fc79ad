"""Several responses in one Bode figure: by level, by file, with error bands and their models.

Owns colours, markers and the legend of that figure. It must never join readings across one that
is spoilt, nor show an error that was not stated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, NullFormatter, ScalarFormatter
from numpy.typing import NDArray

from analysis.drawing.palette import LEVEL_COLOURS
from analysis.drawing.picture import save_picture
from analysis.plots.traces import Trace, level_traces, on_one_branch
from daq.errors import InputError
from daq.frf import FrequencyResponse
from daq.untrusted.visible_text import visible_line

if TYPE_CHECKING:
    from analysis.estimate.datasheet_band import DatasheetBand, LevelBand

__all__ = ["MOST_CURVES", "Curve", "draw_overlay", "save_overlay"]

_COLOURS = (*LEVEL_COLOURS, "#000000")
_MARKERS = "osD^vPX<>*hd"
_DASHES = ("-", (0, (1, 1)), (0, (5, 1, 1, 1)), (0, (3, 1, 1, 1, 1, 1)))
MOST_CURVES = len(_COLOURS) * len(_DASHES)
"""Responses that can be told apart in one figure."""

_WIDTH_IN, _HEIGHT_IN = 9.0, 6.5
_LETTER_IN, _HANDLE_IN, _ROW_IN = 0.066, 0.55, 0.17
_LONGEST_NAME = 44
_MOST_LEVELS = 28
_MODEL = (0, (4, 2))
_SHARP, _BAND = 3.0, 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A response to draw, the name it has in the legend, and what a model gives for its sweep.

    `band`: where units of the datasheet read; its median stands for a model that is not given.
    """

    name: str
    response: FrequencyResponse
    model: tuple[FrequencyResponse, ...] = ()
    band: DatasheetBand | None = None


def draw_overlay(curves: Sequence[Curve]) -> Figure:
    """Draw gain (dB re 1 V/V) and phase (degrees, without jumps of 360) over frequency.

    One response has a colour per level. Several have a colour each and a marker per level. Bands
    are one standard error where it is stated. A model is dashed and has no markers. A spoilt
    reading is hollow and breaks the line. The frequency axis is logarithmic from a decade on.

    Raises
    ------
    InputError
        If there is nothing to draw, or more than `MOST_CURVES` responses.
    """
    if not any(len(curve.response) for curve in curves):
        raise InputError("there is no reading to draw")
    if len(curves) > MOST_CURVES:
        raise InputError(
            f"{len(curves)} responses cannot be told apart in one picture; give up to {MOST_CURVES}"
        )
    drawn = [(i, trace) for i, one in enumerate(curves) for trace in level_traces(one.response)]
    models = [
        (i, trace)
        for i, one in enumerate(curves)
        for response in one.model
        for trace in level_traces(response)
    ]
    bands = [(i, one) for i, curve in enumerate(curves) if curve.band for one in curve.band.levels]
    middles = [(i, _median(one)) for i, one in bands]
    models += [(i, trace) for i, trace in middles if not curves[i].model]
    placed = on_one_branch([trace for _, trace in (*drawn, *models, *middles)])
    levels = _levels([trace for _, trace in drawn])
    styles = _Styles(levels, len(curves))
    entries = _entries(curves, levels, styles, bool(models))
    columns = _columns([entry.get_label() for entry in entries])
    rows = math.ceil(len(entries) / columns) + 1
    figure = Figure(figsize=(_WIDTH_IN, _HEIGHT_IN + _ROW_IN * rows), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    both = (*drawn, *models)
    for place, ((curve, _), trace) in enumerate(zip(both, placed[: len(both)], strict=True)):
        style = styles.of(curve, trace.source_vpk, model=place >= len(drawn))
        _line(gain, trace.frequency_hz, trace.gain_db, trace.gain_std_db, style)
        _line(phase, trace.frequency_hz, trace.phase_deg, trace.phase_std_deg, style)
        if np.isfinite(trace.spoilt_db).any():
            hollow = style | {"linestyle": "none", "markerfacecolor": "none"}
            gain.plot(trace.frequency_hz, trace.spoilt_db, **hollow)
    for (curve, one), middle in zip(bands, placed[len(drawn) + len(models) :], strict=True):
        colour = styles.of(curve, one.source_vpk)["color"]
        turned = middle.phase_deg - one.phase_deg[1]
        for axes, edges in ((gain, one.gain_db), (phase, one.phase_deg + turned)):
            axes.fill_between(
                one.frequency_hz, edges[0], edges[2], color=colour, alpha=_BAND, linewidth=0.0
            )
    _dress(gain, phase, curves, placed)
    figure.legend(
        handles=entries, title=_legend_title(placed, bool(models), curves), title_fontsize=8,
        fontsize=8, loc="outside upper center", ncols=columns,
    )  # fmt: skip
    return figure


def save_overlay(curves: Sequence[Curve], path: Path) -> None:
    """Write `draw_overlay` as a picture; the suffix names its kind.

    Raises
    ------
    LashbenchError
        As `draw_overlay` and `analysis.plots.save_picture`.
    """
    save_picture(draw_overlay(curves), path)


class _Styles:
    """What a line looks like, by response and level."""

    def __init__(self, levels: Sequence[float | None], curves: int) -> None:
        self._levels, self._many = list(levels), curves > 1
        count = len(levels)
        # Levels are in order: where there are many, so are their colours.
        scale = colormaps["cividis"](np.linspace(0.0, 0.9, count))
        self._level_colours = _COLOURS[:count] if count <= len(_COLOURS) else list(scale)

    def of(self, curve: int, source_vpk: float, model: bool = False) -> dict[str, Any]:
        level = self._levels.index(_key(source_vpk))
        style: dict[str, Any] = {"linewidth": 0.9}
        if self._many:
            style["color"] = _COLOURS[curve % len(_COLOURS)]
            style["linestyle"] = _DASHES[curve // len(_COLOURS)]
        else:
            style |= {"color": self._level_colours[level], "linestyle": "-"}
        if model:
            return style | {"linewidth": 1.4, "linestyle": _MODEL, "alpha": 0.8}
        return style | {"marker": _MARKERS[level % len(_MARKERS)], "markersize": _SHARP}


def _key(source_vpk: float) -> float | None:
    return source_vpk if math.isfinite(source_vpk) else None


def _levels(traces: Sequence[Trace]) -> list[float | None]:
    stated = sorted({t.source_vpk for t in traces if math.isfinite(t.source_vpk)})
    return [*stated, *([None] if any(math.isnan(t.source_vpk) for t in traces) else [])]


def _line(
    axes: Axes,
    frequency: NDArray[np.float64],
    values: NDArray[np.float64],
    std: NDArray[np.float64],
    style: dict[str, Any],
) -> None:
    axes.plot(frequency, values, **style)
    if np.isfinite(values + std).any():
        axes.fill_between(
            frequency, values - std, values + std, color=style["color"], alpha=_BAND, linewidth=0.0
        )


def _entries(
    curves: Sequence[Curve], levels: Sequence[float | None], styles: _Styles, model: bool
) -> list[Line2D]:
    """Handles of the legend: levels of one response, else responses and then levels."""
    shown = levels[:_MOST_LEVELS]
    entries = []
    if len(curves) > 1:
        for place, curve in enumerate(curves):
            style = styles.of(place, _number(levels[0])) | {"marker": "none", "linewidth": 2.0}
            entries.append(_handle(_name(curve), style))
        black = {"color": "#000000", "linestyle": "none"}
        entries += [
            _handle(_volts(v), styles.of(0, _number(v)) | black | {"markersize": 4.0})
            for v in shown
        ]
    else:
        entries += [_handle(_volts(v), styles.of(0, _number(v))) for v in shown]
    if len(levels) > len(shown):
        entries.append(_handle(f"and {len(levels) - len(shown)} more levels", {"alpha": 0.0}))
    if model:
        entries.append(_handle("model", {"color": "#000000", "linestyle": _MODEL}))
    return entries


def _handle(label: str, style: dict[str, Any]) -> Line2D:
    # A name is no formula, and one that begins with an underscore is shown, too.
    label = label.replace("$", r"\$")
    return Line2D([], [], label=f"\N{ZERO WIDTH SPACE}{label}" if label[:1] == "_" else label,
                  **style)  # fmt: skip


def _number(level: float | None) -> float:
    return math.nan if level is None else level


def _volts(level: float | None) -> str:
    return "level not stated" if level is None else f"{level:g} V peak"


def _name(curve: Curve) -> str:
    simulated = curve.response.provenance.get("kind") == "simulated"
    name = visible_line(curve.name)
    if len(name) > _LONGEST_NAME:
        # The ends of names tell them apart: numbers and dates stand there.
        head = _LONGEST_NAME // 2 - 1
        name = f"{name[:head]}…{name[head + 1 - _LONGEST_NAME :]}"
    return name + (", SIMULATED" if simulated else "")


def _columns(labels: Sequence[Any]) -> int:
    widest = max(len(str(label)) for label in labels) * _LETTER_IN + _HANDLE_IN
    return max(1, min(len(labels), int(_WIDTH_IN / widest), 6))


def _median(one: LevelBand) -> Trace:
    """The middle of a band, as a trace without errors."""
    unknown = np.full(len(one.frequency_hz), np.nan)
    return Trace(
        one.source_vpk,
        one.frequency_hz,
        one.gain_db[1],
        unknown,
        one.phase_deg[1],
        unknown,
        unknown,
    )


def _legend_title(traces: Sequence[Trace], model: bool, curves: Sequence[Curve]) -> str:
    parts = []
    if any(np.isfinite(t.gain_std_db).any() or np.isfinite(t.phase_std_deg).any() for t in traces):
        parts.append("bands along the line: ± one standard error, as stated")
    if any(np.isfinite(t.spoilt_db).any() for t in traces):
        parts.append("hollow: spoilt readings")
    if model:
        parts.append("dashed: model")
    title = "; ".join(parts)
    for words in dict.fromkeys(curve.band.words for curve in curves if curve.band):
        title += f"\n{words}"
    return title


def _dress(gain: Axes, phase: Axes, curves: Sequence[Curve], traces: Sequence[Trace]) -> None:
    units = list(dict.fromkeys(visible_line(curve.response.unit) for curve in curves))
    title = ", ".join(units[:3]) + (f" and {len(units) - 3} more" if len(units) > 3 else "")
    if len(curves) == 1:
        title = f"{title}: {_name(curves[0])}"
    # A name is no formula, whatever dollars stand in it.
    gain.set_title(title, parse_math=False, fontsize=11)
    gain.set_ylabel("gain V_o/V_i (dB re 1 V/V)")
    phase.set_ylabel("phase (deg)")
    phase.set_xlabel("frequency (Hz)")
    if not any(np.isfinite(trace.phase_deg).any() for trace in traces):
        phase.text(0.5, 0.5, "no phase is stated", ha="center", transform=phase.transAxes)
    phase.yaxis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 1.5, 3, 4.5, 9, 10]))
    frequencies = np.concatenate([trace.frequency_hz for trace in traces])
    low, high = frequencies[frequencies > 0.0].min(initial=np.inf), frequencies.max()
    if high >= 10.0 * low and (frequencies > 0.0).all():
        phase.set_xscale("log")
        phase.xaxis.set_major_formatter(ScalarFormatter())
        phase.xaxis.set_minor_formatter(NullFormatter())
    for axes in (gain, phase):
        axes.grid(alpha=0.3, which="both")
