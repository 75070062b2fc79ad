"""Figures 2, 3 and 4(e) of the paper, drawn from the reproduction.

Owns their look. It computes nothing but medians and bands, opens no window and
leaves matplotlib's settings as they were.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.paper.published import UnitName
from analysis.paper.result import ReproductionNumbers
from analysis.paper.table2 import Compared, ReproducedRow
from daq.formats.atomic import replacing

__all__ = ["draw"]

_STYLE: Any = {
    "font.family": "serif",
    "font.serif": ["STIXGeneral", "DejaVu Serif"],
    "mathtext.fontset": "stix",
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.linewidth": 0.7,
    "lines.linewidth": 1.1,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "legend.title_fontsize": 8.5,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.minor.visible": True,
    "ytick.minor.visible": True,
    "savefig.dpi": 200,
}
_RATIO_COLOURS = {0: "#440154", 25: "#3b528b", 50: "#21918c", 75: "#5ec962", 100: "#e69f00"}
_INK, _PAPER, _EXACT, _MEASURED = "#000000", "#0072b2", "#d55e00", "#7f7f7f"
_GAIN = r"gain $|V_o/V_i|$ (dB)"
_FREQUENCY = "frequency (Hz)"
_RUNS = "lines: median of single runs, bands: 16 to 84 % of them"
_RATIO = "contribution ratio of stage 1 (%)"


def draw(result: ReproductionNumbers, directory: Path) -> list[Path]:
    """Write every figure as PNG into a directory, made if missing, and return the paths."""
    figures: dict[str, Callable[[ReproductionNumbers], Figure]] = {
        "fig2-simulated-responses": _figure_2,
        "fig3-features-against-ratio": _figure_3,
        "fig4e-measured-and-simulated": _figure_4e,
    }
    directory.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, make in figures.items():
        paths.append(directory / f"{name}.png")
        with rc_context(_STYLE), replacing(paths[-1]) as stream:
            make(result).savefig(stream, format="png")
    return paths


def _units(result: ReproductionNumbers) -> list[UnitName]:
    return [curve.unit for curve in result.index]


def _figure_2(result: ReproductionNumbers) -> Figure:
    """Simulated responses at every ratio, by the paper's scheme and by the exact engine."""
    units = _units(result)
    figure = Figure(figsize=(7.2, 5.6), layout="constrained")
    grid = figure.subplots(2, len(units), sharex="col", sharey="col", squeeze=False)
    for column, unit in enumerate(units):
        for row in result.of_unit(unit):
            colour = _RATIO_COLOURS[row.published.ratio_percent]
            for axes, runs in ((grid[0][column], row.gain_db), (grid[1][column], row.exact_db)):
                _band(axes, row, runs, colour, f"{row.published.ratio_percent} %")
            _published_points(grid[0][column], row, colour)
        grid[0][column].set_title(unit)
        grid[1][column].set_xlabel(_FREQUENCY)
    for axes, what in ((grid[0][0], "paper's scheme"), (grid[1][0], "exact engine")):
        axes.set_ylabel(f"{what}\n{_GAIN}")
    handles, labels = grid[1][0].get_legend_handles_labels()
    handles.append(
        Line2D([], [], linestyle="none", marker="o", markerfacecolor="white", color=_INK)
    )
    figure.legend(
        handles,
        [*labels, "printed ARF, RF"],
        title="contribution ratio of stage 1; " + _RUNS,
        loc="outside lower center",
        ncols=len(handles),
    )
    return figure


def _band(axes: Axes, row: ReproducedRow, runs: Any, colour: str, label: str) -> None:
    low, middle, high = np.percentile(runs, [16, 50, 84], axis=0)
    axes.fill_between(row.frequency_hz, low, high, color=colour, alpha=0.18, linewidth=0.0)
    axes.plot(row.frequency_hz, middle, color=colour, label=label)
    axes.margins(x=0.025)


def _published_points(axes: Axes, row: ReproducedRow, colour: str) -> None:
    for feature in (row.arf, row.rf):
        axes.plot(
            feature.published_hz,
            feature.published_db,
            marker="o",
            markersize=5.0,
            markerfacecolor="white",
            markeredgecolor=colour,
            markeredgewidth=1.2,
            zorder=5,
        )


def _figure_3(result: ReproductionNumbers) -> Figure:
    """ARF, RF, their difference and the error index against the ratio."""
    units = _units(result)
    figure = Figure(figsize=(7.2, 8.0), layout="constrained")
    grid = figure.subplots(4, len(units), sharex=True, squeeze=False)
    for column, unit in enumerate(units):
        rows, measured = result.of_unit(unit), result.paper.measured_row(unit)
        _feature_panel(grid[0][column], [row.arf for row in rows], rows, measured.arf_hz)
        _feature_panel(grid[1][column], [row.rf for row in rows], rows, measured.rf_hz)
        _difference_panel(grid[2][column], rows, measured.rf_hz - measured.arf_hz)
        _index_panel(grid[3][column], result, column)
        for axes in grid[:, column]:
            axes.axvline(measured.ratio_percent, color=_MEASURED, linewidth=0.8, linestyle=":")
        grid[0][column].set_title(unit)
        grid[3][column].set_xlabel(_RATIO)
        grid[3][column].set_xlim(-6, 106)
        grid[3][column].set_ylim(bottom=0.0)
    names = ("ARF (Hz)", "RF (Hz)", r"$f_D$ = RF $-$ ARF (Hz)", "error index (Hz)")
    for axes, name in zip(grid[:, 0], names, strict=True):
        axes.set_ylabel(name)
    handles, labels = grid[1][0].get_legend_handles_labels()
    handles.append(Line2D([], [], color=_MEASURED, linewidth=0.8, linestyle=":"))
    figure.legend(
        handles,
        [*labels, "ratio seen by microscope"],
        title="bars: one standard deviation of single runs",
        loc="outside lower center",
        ncols=3,
    )
    return figure


_SERIES: tuple[tuple[str, dict[str, Any], float], ...] = (
    (
        "printed",
        {"color": _INK, "marker": "o", "markerfacecolor": "white", "linewidth": 0.0, "zorder": 5},
        0.0,
    ),
    ("paper's scheme, single runs", {"color": _PAPER, "marker": "s", "linewidth": 0.8}, -1.6),
    (
        "exact engine, single runs",
        {"color": _EXACT, "marker": "D", "linewidth": 0.8, "linestyle": "--"},
        1.6,
    ),
)
"""Label, look and sideways shift (percent of ratio, so that bars stay apart) of each series."""


def _series(axes: Axes, ratios: Any, values: list[Any], errors: list[Any]) -> None:
    for (label, look, shift), value, error in zip(_SERIES, values, errors, strict=True):
        axes.errorbar(
            np.asarray(ratios) + shift,
            value,
            yerr=error,
            label=label,
            markersize=4.5,
            capsize=2.0,
            elinewidth=0.8,
            **look,
        )


def _ratios(rows: tuple[ReproducedRow, ...]) -> list[int]:
    return [row.published.ratio_percent for row in rows]


def _feature_panel(
    axes: Axes, features: list[Compared], rows: tuple[ReproducedRow, ...], measured_hz: float
) -> None:
    _series(
        axes,
        _ratios(rows),
        [
            [f.published_hz for f in features],
            [f.value_hz for f in features],
            [f.exact_hz for f in features],
        ],
        [None, [f.std_hz for f in features], [f.exact_std_hz for f in features]],
    )
    axes.axhline(measured_hz, color=_MEASURED, linewidth=0.8, linestyle="-.", label="measured")


def _difference_panel(axes: Axes, rows: tuple[ReproducedRow, ...], measured_hz: float) -> None:
    def differences(name: str) -> list[float]:
        return [getattr(row.rf, name) - getattr(row.arf, name) for row in rows]

    def errors(name: str) -> list[float]:
        return [float(np.hypot(getattr(row.rf, name), getattr(row.arf, name))) for row in rows]

    _series(
        axes,
        _ratios(rows),
        [differences(name) for name in ("published_hz", "value_hz", "exact_hz")],
        [None, errors("std_hz"), errors("exact_std_hz")],
    )
    axes.axhline(measured_hz, color=_MEASURED, linewidth=0.8, linestyle="-.")


def _index_panel(axes: Axes, result: ReproductionNumbers, column: int) -> None:
    curve = result.index[column]
    indices = (curve.published, curve.value, curve.exact)
    _series(
        axes,
        curve.ratio_percent,
        [index.hz for index in indices],
        [None, curve.value.std_hz, curve.exact.std_hz],
    )


def _figure_4e(result: ReproductionNumbers) -> Figure:
    """The simulated response at the ratio of the least index, and the measured features."""
    units = _units(result)
    figure = Figure(figsize=(7.2, 3.5), layout="constrained")
    panels = figure.subplots(1, len(units), squeeze=False)[0]
    for axes, curve in zip(panels, result.index, strict=True):
        ratio, _ = curve.minimum(curve.published)
        row = next(r for r in result.of_unit(curve.unit) if r.published.ratio_percent == ratio)
        _band(axes, row, row.gain_db, _PAPER, "paper's scheme")
        _band(axes, row, row.exact_db, _EXACT, "exact engine")
        _published_points(axes, row, _INK)
        _measured_points(axes, result, curve.unit)
        seen = result.paper.measured_row(curve.unit).ratio_percent
        axes.set_title(f"{curve.unit}: simulated at {ratio} %, {seen} % by microscope")
        axes.set_xlabel(_FREQUENCY)
    panels[0].set_ylabel(_GAIN)
    handles, labels = panels[0].get_legend_handles_labels()
    handles.insert(
        2, Line2D([], [], linestyle="none", marker="o", markerfacecolor="white", color=_INK)
    )
    labels.insert(2, "simulated ARF, RF as printed")
    figure.legend(handles, labels, title=_RUNS, loc="outside lower center", ncols=4)
    return figure


def _measured_points(axes: Axes, result: ReproductionNumbers, unit: UnitName) -> None:
    measured = result.paper.measured_row(unit)
    axes.plot(
        [measured.arf_hz, measured.rf_hz],
        np.array([measured.arf_db, measured.rf_db], dtype=float),
        linestyle="none",
        marker="^",
        markersize=7.0,
        color=_INK,
        label="measured ARF, RF",
        zorder=6,
    )
