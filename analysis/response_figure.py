"""A Bode figure of a response: gain and phase per source level, with its features.

Owns what such a figure shows. It opens no window, keeps nothing between calls
and marks every reading that it leaves out.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator, NullLocator

from analysis.drawing.palette import LEVEL_COLOURS
from analysis.drawing.picture import save_picture
from analysis.resonance import LevelFeatures
from daq.frf import FrequencyResponse, PointFlag
from daq.untrusted.visible_text import visible_line

__all__ = ["draw_response", "save_response_figure"]

_MARKERS = "osD^vP"


def draw_response(response: FrequencyResponse, features: Sequence[LevelFeatures] = ()) -> Figure:
    """Draw gain (dB re 1 V/V, with error bars of one standard error) and phase (wrapped, degrees).

    Parameters
    ----------
    response
        Measured or simulated; a simulated one says so in the title.
    features
        ARF and RF per level, each a band of +- one standard error and a
        line of the legend.
    """
    figure = Figure(figsize=(9.0, 6.5), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    found = {_key(feature.source_vpk): feature for feature in features}
    for index, level in enumerate(map(_key, response.levels_vpk.tolist())):
        style: dict[str, Any] = {
            "color": LEVEL_COLOURS[index % len(LEVEL_COLOURS)],
            "marker": _MARKERS[index % len(_MARKERS)],
            "markersize": 3.0,
        }
        part = (
            response.take(~np.isfinite(response.source_vpk))
            if level is None
            else response.at_level(level)
        )
        _draw_level(gain, phase, part, _label(level, found.get(level)), style)
        if level in found:
            _mark(gain, found[level], style["color"])
    _dress(gain, phase, response)
    return figure


def save_response_figure(
    response: FrequencyResponse, features: Sequence[LevelFeatures], path: Path
) -> None:
    """Write `draw_response` as a picture; the suffix names its kind."""
    save_picture(draw_response(response, features), path)


def _draw_level(
    gain: Axes, phase: Axes, part: FrequencyResponse, name: str, style: dict[str, Any]
) -> None:
    spoilt = (part.flags & PointFlag.SPOILT) != 0
    # A spoilt reading breaks the line; a bridge would pass for data.
    gain_db = np.where(spoilt, np.nan, part.gain_db)
    gain.errorbar(
        part.frequency_hz, gain_db, yerr=part.gain_std_db, linewidth=0.8, label=name, **style
    )
    # Points only: a line would join -180 to 180 degrees across the whole panel.
    phase_deg = np.where(spoilt, np.nan, part.phase_deg)
    phase.plot(part.frequency_hz, phase_deg, linewidth=0.0, **style)
    if spoilt.any():
        hollow = style | {"linewidth": 0.0, "markerfacecolor": "none"}
        gain.plot(part.frequency_hz[spoilt], part.gain_db[spoilt], **hollow)


def _key(source_vpk: float) -> float | None:
    """A level that can be looked up: None where the response does not say it."""
    return source_vpk if np.isfinite(source_vpk) else None


def _label(level: float | None, found: LevelFeatures | None) -> str:
    name = "? V" if level is None else f"{level:g} V"
    if found is None:
        return name
    parts = [
        f"{name} {feature.frequency_hz:.1f} ± {feature.std_hz:.1f} Hz" if feature else f"no {name}"
        for name, feature in (("ARF", found.arf), ("RF", found.rf))
    ]
    return f"{name}: {', '.join(parts)}"


def _mark(gain: Axes, found: LevelFeatures, colour: str) -> None:
    for feature in (found.arf, found.rf):
        if feature is not None:
            low = feature.frequency_hz - feature.std_hz
            high = feature.frequency_hz + feature.std_hz
            gain.axvspan(low, high, color=colour, alpha=0.2, linewidth=0.0)


def _dress(gain: Axes, phase: Axes, response: FrequencyResponse) -> None:
    simulated = response.provenance.get("kind") == "simulated"
    # A name is no formula, whatever dollars stand in it.
    title = visible_line(response.unit) + (", SIMULATED" if simulated else "")
    gain.set_title(title, parse_math=False)
    gain.set_ylabel("gain V_o/V_i (dB re 1 V/V)")
    # Above the curves, of which none has room to spare.
    handles, labels = gain.get_legend_handles_labels()
    gain.figure.legend(
        handles, labels, title="source level, V peak", fontsize=8, loc="outside upper center",
        ncols=2,
    )  # fmt: skip
    phase.set_ylabel("phase, wrapped (deg)")
    phase.set_xlabel("frequency (Hz)")
    phase.set_ylim(-190, 190)
    phase.yaxis.set_major_locator(MultipleLocator(90))
    phase.yaxis.set_minor_locator(NullLocator())
    for axes in (gain, phase):
        axes.grid(alpha=0.3)
