"""The figures of a report as SVG that stands inside of a page.

Owns the drawing of the estimate and how a figure becomes inline SVG. No text
of an operator gets into a picture, and pictures of one page share no names.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from analysis.answer import span_of
from analysis.diagnosis import Diagnosis
from analysis.diagnosis.figures import probability_figure, residual_figure
from analysis.drawing.palette import BLUE, VERMILION
from analysis.report.html import Markup
from analysis.resonance import LevelFeatures
from analysis.resonance.records import with_error
from analysis.response_figure import draw_response
from daq.frf import FrequencyResponse, PointFlag

__all__ = ["backlash_svg", "bode_svg", "diagnosis_svgs", "figure_svg"]

_BLUE, _GREY, _RED = BLUE, "#999999", VERMILION
_MOST_READINGS = 2000
"""Of a response whose readings tell their numbers: each takes 200 bytes twice."""
_NAMED = re.compile(r'(\bid="|\bhref="#|url\(#)')
_STYLE = re.compile(r"<style\b.*?</style>", re.DOTALL)
_METADATA = re.compile(r"<metadata>.*?</metadata>", re.DOTALL)


def bode_svg(response: FrequencyResponse, features: Sequence[LevelFeatures]) -> Markup:
    """Gain and phase at every level with ARF and RF."""
    figure = draw_response(response, features)
    # The page names the unit; a title that holds any text might be read as a formula.
    figure.axes[0].set_title("")
    figure.set_size_inches(7.6, 4.9)
    told = "Gain and phase over frequency at every source level"
    return figure_svg(figure, "bode", told, _readings(figure, response))


@dataclass(frozen=True, slots=True)
class _Reading:
    """A place in a picture, in points from its upper left, and what is said of it."""

    x: float
    y: float
    text: str


def _readings(figure: Figure, response: FrequencyResponse) -> Callable[[], Iterator[_Reading]]:
    """Every reading of gain and phase with its numbers, once the figure is laid out."""

    def find() -> Iterator[_Reading]:
        if len(response) > _MOST_READINGS:
            return
        height = figure.bbox.height
        gain, phase = figure.axes[:2]
        for number, hz in enumerate(response.frequency_hz):
            level = response.source_vpk[number]
            place = f"{hz:.6g} Hz" + (f", {level:g} V" if np.isfinite(level) else "")
            is_spoilt = bool(response.flags[number] & PointFlag.SPOILT)
            for axes, value, error, unit in (
                (gain, response.gain_db[number], response.gain_std_db[number], "dB"),
                (phase, response.phase_deg[number], response.phase_std_deg[number], "deg"),
            ):
                # Of a spoilt reading the gain alone is drawn, hollow.
                if np.isfinite(value) and not (is_spoilt and axes is phase):
                    x, y = axes.transData.transform((hz, value))
                    said = f"spoilt, {value:.4g}" if is_spoilt else with_error(value, error)
                    yield _Reading(x, height - y, f"{place}: {said} {unit}")

    return find


def backlash_svg(
    ratio: Mapping[str, Any] | None, estimate: Mapping[str, Any] | None
) -> Markup | None:
    """The contribution ratio with its interval and the error index, as far as there are any.

    Parameters
    ----------
    ratio
        That of the model in force; None if no model is.
    estimate
        Document of ``estimate --json``, for its error index.
    """
    curve = None if estimate is None else estimate.get("error_index")
    if ratio is None and not curve:
        return None
    heights = [*([1.0] if ratio is not None else []), *([4.0] if curve else [])]
    figure = Figure(figsize=(7.6, 0.7 + 0.45 * sum(heights)), layout="constrained")
    axes = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights, squeeze=False)[:, 0]
    if ratio is not None:
        low, high = span_of(ratio)
        axes[0].plot(
            [low, high], [0, 0], color=_BLUE, linewidth=6, alpha=0.3, solid_capstyle="butt"
        )
        axes[0].plot(ratio["value"], 0, marker="o", color=_BLUE)
        axes[0].axvline(0.5, color=_GREY, linewidth=0.8)
        axes[0].set_yticks([])
        axes[0].set_ylabel("r, 95 %", rotation=0, ha="right", va="center")
    if curve:
        _draw_index(axes[-1], curve)
        if ratio is not None:
            axes[-1].axvspan(low, high, color=_BLUE, alpha=0.12, linewidth=0)
    axes[0].set_xlim(-0.02, 1.02)
    axes[-1].set_xlabel("contribution ratio r: 0 all in stage 2, 1 all in stage 1")
    return figure_svg(figure, "backlash", "Contribution ratio with its 95 % interval; error index")


def _draw_index(axes: Any, curve: Mapping[str, Any]) -> None:
    ratio, hz, std = (
        np.array([np.nan if v is None else v for v in curve[name]], dtype=float)
        for name in ("ratio", "hz", "std_hz")
    )
    axes.plot(ratio, hz, color=_RED, linewidth=1.2)
    axes.fill_between(ratio, hz - std, hz + std, color=_RED, alpha=0.2, linewidth=0)
    axes.axvline(curve["minimum_ratio"], color=_RED, linewidth=0.8, linestyle=":")
    axes.set_ylabel("error index (Hz)")
    axes.grid(alpha=0.3)


def figure_svg(
    figure: Figure,
    name: str,
    description: str,
    readings: Callable[[], Iterable[_Reading]] = tuple,
) -> Markup:
    """A figure as one ``<svg>`` element; its names begin with `name`, the same at every run.

    What `readings` gives shows its text where a pointer rests on it.
    """
    # Points of the picture are those of its axes.
    figure.set_dpi(72.0)
    stream = io.StringIO()
    # Letters stay letters: they can be searched and copied, and take little room.
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": name, "font.size": 8.0}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    # Its style sheet would hold for the whole page.
    text = _METADATA.sub("", _STYLE.sub("", text))
    text = _NAMED.sub(lambda found: f"{found.group(1)}{name}-", text)
    spots = "".join(
        f'<circle cx="{spot.x:.1f}" cy="{spot.y:.1f}" r="4" fill="none" pointer-events="all">'
        f"<title>{spot.text}</title></circle>"
        for spot in readings()
    )
    text = text.replace("<svg", f'<svg role="img" aria-label="{description}"', 1).strip()
    return Markup(text.removesuffix("</svg>") + spots + "</svg>")


def diagnosis_svgs(diagnosis: Diagnosis) -> list[tuple[Markup, str]]:
    """The figures of a diagnosis, each with its caption."""
    residuals, judged = residual_figure(diagnosis), probability_figure(diagnosis)
    residuals.suptitle("")
    residuals.set_size_inches(7.6, 4.2)
    judged.set_size_inches(7.6, 0.22 * len(diagnosis.verdict.judged) + 0.7)
    judged.axes[0].set_title("")
    return [
        (
            figure_svg(residuals, "residuals", "Residuals before and after, level by level"),
            "Measured minus predicted, each source level predicted from the others; the band is "
            "one standard deviation.",
        ),
        (
            figure_svg(judged, "judged", "Sets of causes by probability"),
            "Sets of causes that were judged.",
        ),
    ]
