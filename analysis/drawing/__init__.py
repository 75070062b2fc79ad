"""What every figure shares: its colours, and how it becomes a file.

Owns no figure. It loads no drawing library by itself.
"""

from __future__ import annotations

from analysis.drawing.palette import (
    BLUE,
    GREEN,
    LEVEL_COLOURS,
    ORANGE,
    PURPLE,
    SKY_BLUE,
    VERMILION,
)
from analysis.drawing.picture import PICTURES, checked_picture, save_picture

__all__ = [
    "BLUE",
    "GREEN",
    "LEVEL_COLOURS",
    "ORANGE",
    "PICTURES",
    "PURPLE",
    "SKY_BLUE",
    "VERMILION",
    "checked_picture",
    "save_picture",
]
