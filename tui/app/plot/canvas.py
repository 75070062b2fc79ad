"""Cells with characters and colours, and how layers are drawn into them.

Owns the arithmetic from values to dots: a cell has 2 by 4 dots of Braille, and bands end on eighths
of a cell. Later layers lie above earlier ones.
"""

from __future__ import annotations

from functools import singledispatchmethod

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from rich.style import Style

from tui.app.plot.layers import Array, Band, Bars, Curve, Layer, Line, Marks
from tui.app.plot.scales import Scale

__all__ = ["Canvas"]

_BRAILLE = 0x2800
_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bit of a dot, by its row from the top and its column."""

_EIGHTHS = " \u2581\u2582\u2583\u2584\u2585\u2586\u2587\u2588"
_DASH = 6
"""Dots of a dash, and of the gap after it."""


class Canvas:
    """The inner part of a plot.

    Parameters
    ----------
    x, y
        Scales; their cells are its width and height.
    background
        Colour behind everything.
    """

    def __init__(self, x: Scale, y: Scale, background: str) -> None:
        self.x, self.y, self.background = x, y, background
        shape = (y.cells, x.cells)
        self._text = np.full(shape, " ", dtype="<U1")
        self._bits = np.zeros(shape, dtype=np.int64)
        self._front = np.zeros(shape, dtype=np.int64)
        self._back = np.zeros(shape, dtype=np.int64)
        self._covered = np.zeros(shape, dtype=np.int64)
        """Colour of the band that covers most of a cell."""
        self._colours: list[str] = [background]

    def grid(self, colour: str) -> None:
        """Thin lines at the ticks, behind what follows."""
        number = self._number(colour)
        rows = self._rows(np.array(self.y.ticks))
        columns = self._columns(np.array(self.x.ticks))
        self._text[rows, :] = "\u2508"
        self._text[:, columns] = "\u250a"
        self._text[np.ix_(rows, columns)] = "\u253c"
        self._front[rows, :] = number
        self._front[:, columns] = number

    @singledispatchmethod
    def draw(self, layer: Layer) -> None:
        """Draw a layer above those before."""
        raise TypeError(f"{layer!r} is no layer")

    @draw.register
    def _(self, layer: Band) -> None:
        places = self.x.place(layer.x)
        order = np.argsort(places)
        centres = np.arange(self.x.cells) + 0.5
        low, high = (
            np.interp(centres, places[order], self.y.place(one)[order], np.nan, np.nan)
            for one in (layer.low, layer.high)
        )
        eighths = [np.clip(np.round(8 * one), 0, 8 * self.y.cells) for one in (low, high)]
        number = self._number(layer.colour)
        for row in range(self.y.cells):
            # Cells count from the bottom, rows of the terminal from the top.
            at = self.y.cells - 1 - row
            with np.errstate(invalid="ignore"):
                first, last = (np.clip(one - 8 * at, 0, 8) for one in eighths)
                filled = last - first
                self._fill(row, filled >= 8, number)
                self._partly(row, (filled > 0) & (filled < 8) & (first == 0), last, number, False)
                self._partly(row, (filled > 0) & (first > 0), first, number, True)

    @draw.register
    def _(self, layer: Curve) -> None:
        columns, rows = self._dots(layer.x, layer.y)
        steps: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
        length = 0.0
        for x0, y0, x1, y1 in zip(columns, rows, columns[1:], rows[1:], strict=False):
            if not np.all(np.isfinite((x0, y0, x1, y1))):
                length = 0.0
                continue
            count = int(max(abs(x1 - x0), abs(y1 - y0))) + 1
            clipped = _clip((x0, y0, x1, y1), 2 * self.x.cells, 4 * self.y.cells)
            if clipped is not None:
                start, end = clipped
                share = np.linspace(start, end, min(count, 4096) + 1)
                if layer.dashed:
                    share = share[((length + share * count) // _DASH) % 2 == 0]
                steps.append((x0 + share * (x1 - x0), y0 + share * (y1 - y0)))
            length += count
        if steps:
            across, up = (np.concatenate(one) for one in zip(*steps, strict=True))
            self._set(across, up, layer.colour)
        alone = np.isfinite(columns) & np.isfinite(rows)
        self._set(columns[alone], rows[alone], layer.colour)

    @draw.register
    def _(self, layer: Bars) -> None:
        columns, low = self._dots(layer.x, layer.low)
        _, high = self._dots(layer.x, layer.high)
        for x, first, last in zip(columns, low, high, strict=True):
            if np.all(np.isfinite((x, first, last))) and last - first >= 1.0:
                up = np.arange(max(first, -1.0), min(last, 4.0 * self.y.cells) + 0.5)
                self._set(np.full(up.shape, x), up, layer.colour)

    @draw.register
    def _(self, layer: Marks) -> None:
        with np.errstate(invalid="ignore"):
            columns = np.floor(self.x.place(layer.x))
            rows = np.floor(self.y.place(layer.y))
            inside = (columns >= 0) & (columns < self.x.cells) & (rows >= 0) & (
                rows < self.y.cells
            )  # fmt: skip
        for at in np.flatnonzero(inside).tolist():
            row, column = self.y.cells - 1 - int(rows[at]), int(columns[at])
            self._put(row, column, layer.characters[at], layer.colours[at])

    @draw.register
    def _(self, layer: Line) -> None:
        number = self._number(layer.colour)
        if layer.upright:
            for column in self._columns(np.array([layer.at])):
                free = self._bits[:, column] == 0
                self._text[free, column] = "\u2502" if layer.solid else "\u254e"
                self._front[free, column] = number
                start = max(0, min(int(column) + 1, self.x.cells - len(layer.label)))
                for offset, sign in enumerate(layer.label[: self.x.cells - start]):
                    self._put(0, start + offset, sign, layer.colour)
            return
        for row in self._rows(np.array([layer.at])):
            free = self._bits[row] == 0
            self._text[row, free] = "\u2500" if layer.solid else "\u254c"
            self._front[row, free] = number

    def segments(self, row: int) -> list[Segment]:
        """One row of the terminal, from the top."""
        bits, text = self._bits[row], self._text[row]
        signs = np.where(bits > 0, np.array([chr(_BRAILLE + int(b)) for b in bits]), text)
        front = self._front[row]
        back = np.where((bits > 0) | (text == " "), self._covered[row], self._back[row])
        edges = np.flatnonzero((np.diff(front) != 0) | (np.diff(back) != 0)) + 1
        parts = []
        for start, end in zip([0, *edges], [*edges, len(signs)], strict=True):
            style = Style(color=self._colours[front[start]], bgcolor=self._colours[back[start]])
            parts.append(Segment("".join(signs[start:end]), style))
        return parts

    # ------------------------------------------------------------ inside

    def _number(self, colour: str) -> int:
        if colour not in self._colours:
            self._colours.append(colour)
        return self._colours.index(colour)

    def _columns(self, values: Array) -> NDArray[np.int64]:
        return _within(self.x.place(values), self.x.cells)

    def _rows(self, values: Array) -> NDArray[np.int64]:
        return self.y.cells - 1 - _within(self.y.place(values), self.y.cells)

    def _dots(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Places in dots, from the left and from the bottom."""
        return 2.0 * self.x.place(x), 4.0 * self.y.place(y)

    def _set(self, across: Array, up: Array, colour: str) -> None:
        width, height = 2 * self.x.cells, 4 * self.y.cells
        columns, rows = np.floor(across).astype(np.int64), np.floor(up).astype(np.int64)
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        columns, rows = columns[inside], height - 1 - rows[inside]
        cells = rows // 4, columns // 2
        np.bitwise_or.at(self._bits, cells, _BITS[rows % 4, columns % 2])
        self._front[cells] = self._number(colour)

    def _put(self, row: int, column: int, sign: str, colour: str) -> None:
        self._bits[row, column] = 0
        self._text[row, column] = sign
        self._front[row, column] = self._number(colour)
        self._back[row, column] = self._covered[row, column]

    def _fill(self, row: int, where: NDArray[np.bool_], number: int) -> None:
        self._text[row, where] = " "
        self._back[row, where] = self._covered[row, where] = number

    def _partly(
        self, row: int, where: NDArray[np.bool_], eighths: Array, number: int, above: bool
    ) -> None:
        """Fill cells below a height, or above it, given in eighths."""
        for column in np.flatnonzero(where):
            height = int(eighths[column])
            under = self._covered[row, column]
            self._text[row, column] = _EIGHTHS[height]
            self._front[row, column] = under if above else number
            self._back[row, column] = number if above else under
            if (8 - height if above else height) >= 4:
                self._covered[row, column] = number


def _within(places: Array, cells: int) -> NDArray[np.int64]:
    with np.errstate(invalid="ignore"):
        inside = np.isfinite(places) & (places >= 0) & (places < cells)
    return np.floor(places[inside]).astype(np.int64)


def _clip(
    line: tuple[float, float, float, float], width: float, height: float
) -> tuple[float, float] | None:
    """The share of a line that lies in a box (Liang and Barsky); None where nothing does."""
    x0, y0, x1, y1 = line
    start, end = 0.0, 1.0
    for step, room in (
        (x0 - x1, x0), (x1 - x0, width - x0), (y0 - y1, y0), (y1 - y0, height - y0)
    ):  # fmt: skip
        if step == 0.0:
            if room < 0.0:
                return None
        elif step < 0.0:
            start = max(start, room / step)
        else:
            end = min(end, room / step)
    return (start, end) if start <= end else None
