"""Figures of a diagnosis: what the plain and the extended model leave of a measurement.

Owns their look. It computes nothing that is not in the diagnosis and opens no
window.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.diagnosis.diagnose import Diagnosis
from analysis.drawing.palette import BLUE, VERMILION
from analysis.drawing.picture import save_picture
from analysis.observation.observation import Observation
from analysis.selection.verdict import Judged
from daq.formats.atomic import file_stem
from daq.frf import DB_PER_NEPER
from daq.untrusted.visible_text import visible_line

__all__ = ["draw_diagnosis", "probability_figure", "residual_figure"]

_PLAIN, _EXTENDED, _INK = VERMILION, BLUE, "#333333"
_CHANNELS = ((0, DB_PER_NEPER, "gain (dB)"), (1, 180.0 / np.pi, "phase (deg)"))
_NARROWEST_SHARE = 1e-3


def draw_diagnosis(diagnosis: Diagnosis, folder: Path) -> list[Path]:
    """Write every figure as PNG into a folder, made if missing, and return the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, figure in (
        ("residuals", residual_figure(diagnosis)),
        ("probabilities", probability_figure(diagnosis)),
    ):
        path = folder / f"{file_stem(diagnosis.unit)}-diagnosis-{name}.png"
        save_picture(figure, path)
        written.append(path)
    return written


def residual_figure(diagnosis: Diagnosis) -> Figure:
    """Measured minus predicted, level by level, each level predicted from the others.

    The band is one standard deviation of reading and simulated scatter.
    """
    observation, verdict = diagnosis.observation, diagnosis.verdict
    blocks = observation.blocks
    figure = Figure(figsize=(3.2 * max(len(blocks), 2) + 1.0, 5.6), layout="constrained")
    panels = figure.subplots(2, len(blocks), sharex=True, sharey="row", squeeze=False)
    # Where nothing is named, what the best of the refused leaves is where to go on from.
    best = None if verdict.best is verdict.baseline else verdict.best
    label = "extended" if diagnosis.causes else "what comes nearest"
    for column, block in enumerate(blocks):
        panels[0, column].set_title(_swept(observation, block))
        panels[1, column].set_xlabel("frequency (Hz)")
        for (channel, factor, _), axes in zip(_CHANNELS, panels[:, column], strict=True):
            axes.axhline(0.0, color=_INK, linewidth=0.7)
            axes.grid(alpha=0.3)
            frequency = observation.frequency_hz[block]
            _draw(axes, frequency, verdict.baseline, channel, block, factor, _PLAIN, "plain model")
            if best is not None:
                _draw(axes, frequency, best, channel, block, factor, _EXTENDED, label)
    for (_, _, label), axes in zip(_CHANNELS, panels[:, 0], strict=True):
        axes.set_ylabel(f"measured - predicted,\n{label}")
    panels[0, 0].legend(fontsize=8)
    names = " + ".join(cause.effect for cause in diagnosis.causes) or "nothing named"
    if best is not None and not diagnosis.causes:
        names += f"; {' + '.join(best.effects)} comes nearest"
    title = f"{visible_line(diagnosis.unit)}: {verdict.word}, {names}"
    figure.suptitle(title, fontsize=11, parse_math=False)
    return figure


def _swept(observation: Observation, block: slice) -> str:
    """Level of a block, and how it was swept where others were swept in another way."""
    ways = [(plan.direction, plan.dc_offset_v) for plan, _ in observation.plans]
    (here,) = (i for i, (_, rows) in enumerate(observation.plans) if block.start in rows)
    direction, offset_v = ways[here]
    words = [f"{observation.source_vpk[block.start]:g} V peak"]
    if len({way[0] for way in ways}) > 1:
        words.append(direction)
    if offset_v:
        words.append(f"offset {offset_v:g} V")
    return ", ".join(words)


def _draw(
    axes: Axes,
    frequency: np.ndarray,
    one: Judged,
    channel: int,
    block: slice,
    factor: float,
    colour: str,
    label: str,
) -> None:
    residual = factor * one.held_out.residual[channel, block]
    std = factor * one.held_out.std[channel, block]
    axes.fill_between(frequency, -std, std, color=colour, alpha=0.15, linewidth=0.0)
    marker = "o" if colour == _EXTENDED else "x"
    axes.plot(frequency, residual, color=colour, linewidth=0.7, marker=marker, markersize=3.0,
              label=label)  # fmt: skip


def probability_figure(diagnosis: Diagnosis) -> Figure:
    """The sets that were judged, by probability; hatched where one does not look like its runs."""
    judged = diagnosis.verdict.judged
    figure = Figure(figsize=(7.0, 0.4 * len(judged) + 1.2), layout="constrained")
    axes = figure.subplots()
    names = [" + ".join(one.effects) or "nothing hidden" for one in judged]
    for row, one in enumerate(judged):
        axes.barh(
            row,
            max(one.probability, _NARROWEST_SHARE),
            color=_EXTENDED if one is diagnosis.verdict.best else "#999999",
            hatch="///" if one.refused else None,
        )
        axes.text(1.02, row, f"{one.probability:.3f}", va="center", fontsize=8)
    axes.set_yticks(range(len(judged)), names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.15)
    axes.set_xlabel("probability among the sets judged (hatched: no explanation)")
    axes.set_title(f"{diagnosis.unit}: {diagnosis.verdict.word}", fontsize=11)
    return figure
