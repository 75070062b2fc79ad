"""The picture of the diagnosis from the paper's numbers.

Owns its look. It computes nothing that is not in the diagnosis and opens no
window.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from analysis.drawing.palette import BLUE, GREEN, VERMILION
from analysis.drawing.picture import save_picture
from analysis.paper_diagnosis.posterior import Belief, Judged
from analysis.paper_diagnosis.result import PaperFindings
from daq.formats.atomic import file_stem

__all__ = ["draw", "paper_diagnosis_figure"]

_PLAIN, _DAMPED, _BEST, _INK = VERMILION, GREEN, BLUE, "#111111"
_TITLES = {"ratio-free": "ratio unknown", "ratio-as-measured": "ratio as measured"}
_FEATURES = (("ARF", 0, "v"), ("RF", 2, "^"))
_BARS = 8


def draw(diagnosis: PaperFindings, directory: Path) -> list[Path]:
    """Write the figure of one unit as PNG into a directory, made if missing."""
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / f"{file_stem(diagnosis.unit)}-paper-diagnosis.png"
    save_picture(paper_diagnosis_figure([diagnosis]), path)
    return [path]


def paper_diagnosis_figure(diagnoses: Sequence[PaperFindings]) -> Figure:
    """Two rows a unit: features measured and simulated, and the sets by probability.

    Ellipses hold one standard deviation of single runs at the likeliest place.
    """
    columns = max(len(one.beliefs) for one in diagnoses)
    figure = Figure(figsize=(5.6 * columns, 6.4 * len(diagnoses)), layout="constrained")
    panels = figure.subplots(2 * len(diagnoses), columns, squeeze=False)
    for row, diagnosis in enumerate(diagnoses):
        for column, (name, belief) in enumerate(diagnosis.beliefs.items()):
            features, sets = panels[2 * row : 2 * row + 2, column]
            features.set_title(f"{diagnosis.unit}, {_TITLES[name]}: {belief.word}", fontsize=11)
            _draw_features(features, belief)
            _draw_sets(sets, belief)
        for column in range(len(diagnosis.beliefs), columns):
            for axes in panels[2 * row : 2 * row + 2, column]:
                axes.set_axis_off()
    return figure


def _draw_features(axes: Axes, belief: Belief) -> None:
    reading = belief.best.agreement.reading
    alone = belief.damping_alone
    shown: list[tuple[Judged, str, str]] = [(belief.baseline, _PLAIN, "plain model")]
    if alone is not None and alone is not belief.best:
        shown.append((alone, _DAMPED, f"damping alone: {_name(alone)}"))
    if belief.best is not belief.baseline:
        shown.append((belief.best, _BEST, f"best: {_name(belief.best)}"))
    for judged, colour, label in shown:
        mean, std = judged.agreement.at_best
        for title, k, marker in _FEATURES:
            axes.add_patch(
                Ellipse(
                    (mean[k], mean[k + 1]), 2.0 * std[k], 2.0 * std[k + 1],
                    facecolor=colour, alpha=0.18, edgecolor=colour,
                )
            )  # fmt: skip
            axes.plot(
                mean[k], mean[k + 1], marker, color=colour, markersize=6.0,
                label=label if title == "ARF" else None,
            )  # fmt: skip
    for title, k, marker in _FEATURES:
        axes.plot(
            reading.values[k], reading.values[k + 1], marker, color=_INK, markersize=9.0,
            label="measured" if title == "ARF" else None,
        )  # fmt: skip
        axes.annotate(
            title, (reading.values[k], reading.values[k + 1]), textcoords="offset points",
            xytext=(7, 7), fontsize=9,
        )  # fmt: skip
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel("gain (dB)")
    axes.grid(alpha=0.3)
    axes.margins(0.2)
    axes.legend(fontsize=8, loc="lower right")  # below and beyond both features


def _draw_sets(axes: Axes, belief: Belief) -> None:
    judged = belief.judged[:_BARS]
    for row, one in enumerate(judged):
        axes.barh(
            row,
            one.probability,
            color=_BEST if one is belief.best else "#999999",
            hatch=None if one.adequate else "///",
        )
        axes.text(one.probability + 0.01, row, f"{one.probability:.2f}", va="center", fontsize=8)
    axes.set_yticks(np.arange(len(judged)), [_name(one) for one in judged], fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel("probability (hatched: unlike its own runs)")


def _name(judged: Judged) -> str:
    return "\n+ ".join(judged.effects) or "nothing hidden"
