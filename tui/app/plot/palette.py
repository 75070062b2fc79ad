"""Colours of plots: those of Okabe and Ito, made readable on any background.

Owns the choice of colours and their contrast. A colour never carries a meaning alone: marks,
line styles and words do.

Source: M. Okabe and K. Ito, Color Universal Design (2008); contrast as in WCAG 2.1.
"""

from __future__ import annotations

from dataclasses import dataclass

from textual.app import App
from textual.color import Color, ColorParseError

from analysis.drawing.palette import BLUE, GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILION

__all__ = ["LEAST_CONTRAST", "OKABE_ITO", "Palette", "contrast", "palette_of", "readable"]

OKABE_ITO = (BLUE, ORANGE, GREEN, PURPLE, SKY_BLUE, VERMILION)
"""In the order of source levels; the colour of alerts comes last."""

LEAST_CONTRAST = 4.5
"""Of text against its background, WCAG 2.1 level AA."""

_TINT, _GRID = 0.2, 0.32
"""Shares of a colour in the tint of a band, and of the text in the lines of the grid."""

_ALERT_CONTRAST = 5.5
"""What needs attention must be seen above a band, too."""

_STEPS = 20


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours on one background, as Rich writes them.

    `series` are those of curves, `tints` of their bands. `ink`: axes and labels. `grid`: lines
    behind the data. `alert`: what needs attention.
    """

    background: str
    ink: str
    grid: str
    alert: str
    series: tuple[str, ...]
    tints: tuple[str, ...]

    def colour(self, index: int) -> str:
        """Colour of a curve by number; they repeat."""
        return self.series[index % len(self.series)]

    def tint(self, index: int) -> str:
        """Colour of the band of a curve."""
        return self.tints[index % len(self.tints)]


def contrast(one: Color, other: Color) -> float:
    """Contrast of two colours, 1 to 21."""
    high, low = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def readable(colour: Color, background: Color, least: float = LEAST_CONTRAST) -> Color:
    """The colour itself, or the nearest mixture with black or white that can be read."""
    end = Color(255, 255, 255) if _luminance(background) < 0.18 else Color(0, 0, 0)
    for step in range(_STEPS + 1):
        mixed = colour.blend(end, step / _STEPS)
        if contrast(mixed, background) >= least:
            return mixed
    return end


def palette_of(app: App[object]) -> Palette:
    """The palette of the theme that an application has now."""
    variables = app.theme_variables
    try:
        background = Color.parse(variables["background"])
        text = Color.parse(variables["foreground"])
    except (KeyError, ColorParseError):
        background, text = Color(0, 0, 0), Color(255, 255, 255)
    if background.ansi is not None or text.ansi is not None:
        # The terminal's own colours are not known: its own names are safest.
        named = ("blue", "yellow", "green", "magenta", "cyan", "red")
        plain = tuple("bright_black" for _ in named)
        return Palette("default", "default", "bright_black", "red", named, plain)
    background, text = _solid(background), _solid(text)
    ink = readable(text, background)
    series = [readable(Color.parse(one), background) for one in OKABE_ITO]
    return Palette(
        background.hex6,
        ink.hex6,
        background.blend(ink, _GRID).hex6,
        readable(Color.parse(VERMILION), background, _ALERT_CONTRAST).hex6,
        tuple(one.hex6 for one in series),
        tuple(background.blend(one, _TINT).hex6 for one in series),
    )


def _luminance(colour: Color) -> float:
    red, green, blue = (
        part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4
        for part in (colour.r / 255, colour.g / 255, colour.b / 255)
    )
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _solid(colour: Color) -> Color:
    """A colour without transparency."""
    return Color(colour.r, colour.g, colour.b)
