"""One plot with its axes: title, ticks, labels and units around what is drawn.

Owns the frame of a plot. It has neither keys nor mouse; whoever holds it decides what it shows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip
from textual.widget import Widget

from tui.app.plot.canvas import Canvas
from tui.app.plot.layers import Layer
from tui.app.plot.palette import Palette, palette_of
from tui.app.plot.scales import Scale

__all__ = ["LEFT", "Chart", "Drawing"]

LEFT = 7
"""Columns of the labels left of the axis."""

_ABOVE, _BELOW = 1, 2
"""Rows of the title, and of the axis with its labels."""


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """What a chart shows: its title with the unit of y, the unit of x, scales and layers."""

    title: str
    x_unit: str
    x: Scale
    y: Scale
    layers: Sequence[Layer]


class Chart(Widget, can_focus=False):
    """Axes and what is drawn on them."""

    DEFAULT_CSS = "Chart { height: 1fr; }"

    def __init__(self, id: str) -> None:
        super().__init__(id=id)
        self.drawing: Drawing | None = None
        self._strips: list[Strip] = []

    @property
    def inner(self) -> tuple[int, int]:
        """Width and height of the inner part, in cells; at least 2 each."""
        return max(2, self.size.width - LEFT - 1), max(2, self.size.height - _ABOVE - _BELOW)

    @property
    def palette(self) -> Palette:
        """Colours of the theme in force."""
        return palette_of(self.app)

    def show(self, drawing: Drawing | None) -> None:
        """Draw something else."""
        self.drawing = drawing
        self._strips = [] if drawing is None else _strips(drawing, self.palette)
        self.refresh()

    def value_at(self, column: int) -> float | None:
        """The value of x under a column of this widget."""
        if self.drawing is None or column < LEFT + 1:
            return None
        return self.drawing.x.value(column - LEFT - 0.5)

    def render_line(self, y: int) -> Strip:
        """One row."""
        width = self.size.width
        style = self.rich_style
        if y >= len(self._strips):
            return Strip.blank(width, style)
        return self._strips[y].adjust_cell_length(width, style).simplify()


def _strips(drawing: Drawing, palette: Palette) -> list[Strip]:
    canvas = Canvas(drawing.x, drawing.y, palette.background)
    canvas.grid(palette.grid)
    for layer in drawing.layers:
        canvas.draw(layer)
    ink = Style(color=palette.ink, bgcolor=palette.background)
    title = Segment(f"{'':{LEFT}} {drawing.title}", ink)
    labels = _row_labels(drawing.y)
    rows = [
        Strip([Segment(labels[row], ink), *canvas.segments(row)]) for row in range(drawing.y.cells)
    ]
    axis, words = _foot(drawing)
    return [Strip([title]), *rows, Strip([Segment(axis, ink)]), Strip([Segment(words, ink)])]


def _row_labels(y: Scale) -> list[str]:
    """What stands left of each row, the axis included."""
    rows = [f"{'':{LEFT}}\u2502"] * y.cells
    for tick, label in zip(y.ticks, y.labels, strict=True):
        row = y.cells - 1 - int(((tick - y.low) / (y.high - y.low)) * y.cells)
        if 0 <= row < y.cells:
            rows[row] = f"{label[:LEFT]:>{LEFT}}\u2524"
    return rows


def _foot(drawing: Drawing) -> tuple[str, str]:
    """The axis of x, and what its ticks say, with the unit."""
    x = drawing.x
    axis = [" "] * LEFT + ["\u2514"] + ["\u2500"] * x.cells
    words = [" "] * (LEFT + 1 + x.cells)
    unit = f" {drawing.x_unit}"
    words[: len(unit)] = unit
    taken = len(unit)
    places = x.place(np.array(x.ticks, dtype=float))
    for place, label in zip(places, x.labels, strict=True):
        column = LEFT + 1 + min(max(int(place), 0), x.cells - 1)
        axis[column] = "\u252c"
        start = min(max(0, column - len(label) // 2), len(words) - len(label))
        if start > taken:
            words[start : start + len(label)] = label
            taken = start + len(label)
    return "".join(axis), "".join(words)
