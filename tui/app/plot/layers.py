"""What can be drawn on a plot: curves, bands, marks, bars and lines, as records.

Owns these records only. Arrays have the shape (points,); NaN ends a curve and leaves out a point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Band", "Bars", "Curve", "Layer", "Line", "Marks"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """The room between two curves, filled; `low` and `high` are values over `x`."""

    x: Array
    low: Array
    high: Array
    colour: str


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """Points joined by a line of dots; `dashed` leaves out every other stretch."""

    x: Array
    y: Array
    colour: str
    dashed: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Bars:
    """Vertical error bars from `low` to `high`."""

    x: Array
    low: Array
    high: Array
    colour: str


@dataclass(frozen=True, slots=True, eq=False)
class Marks:
    """A character at each point."""

    x: Array
    y: Array
    characters: Sequence[str]
    colours: Sequence[str]


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A vertical line, or a horizontal one, with a label at its end."""

    at: float
    colour: str
    label: str = ""
    upright: bool = True
    solid: bool = False


Layer = Band | Curve | Bars | Marks | Line
