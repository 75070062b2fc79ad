"""Colours that people with any colour vision can tell apart (Okabe and Ito 2008).

Owns their values and names. The yellow of that palette is left out: it is not seen on white.
"""

from __future__ import annotations

__all__ = ["BLUE", "GREEN", "LEVEL_COLOURS", "ORANGE", "PURPLE", "SKY_BLUE", "VERMILION"]

BLUE, VERMILION, GREEN = "#0072b2", "#d55e00", "#009e73"
PURPLE, SKY_BLUE, ORANGE = "#cc79a7", "#56b4e9", "#e69f00"

LEVEL_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, SKY_BLUE, ORANGE)
"""In the order in which the levels of a response take them."""
