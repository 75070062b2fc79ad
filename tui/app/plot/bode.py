"""A Bode plot: gain over phase on frequency, with a cursor, zoom and pan by keys.

Owns the two charts, the band that they show and the cursor. What is drawn comes as traces; nothing
here knows where they come from.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from textual import events
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.message import Message

from tui.app.plot.bode_layers import gain_layers, phase_layers
from tui.app.plot.chart import Chart, Drawing
from tui.app.plot.layers import Layer, Line
from tui.app.plot.scales import degree_scale, frequency_scale, linear_scale
from tui.app.plot.traces import Prediction, Trace, legend
from tui.app.widgets.plain import Words

__all__ = ["BodePlot"]

_ZOOM = 0.5
"""Width of the band after one step of zoom."""

_PAN = 0.25
"""Share of the band that one step of pan moves it by."""

_NARROWEST = 1e-3
"""Of a band, as a share of its middle."""


class BodePlot(Vertical, can_focus=True):
    """Gain and phase of some traces; the arrows move the cursor and zoom."""

    BINDINGS = [
        Binding("left", "move(-1)", "Cursor left", show=False),
        Binding("right", "move(1)", "Cursor right", show=False),
        Binding("shift+left", "move(-10)", "Cursor far left", show=False),
        Binding("shift+right", "move(10)", "Cursor far right", show=False),
        Binding("up", "zoom(1)", "Zoom in", show=False),
        Binding("down", "zoom(-1)", "Zoom out", show=False),
        Binding("less_than_sign,ctrl+left", "pan(-1)", "Band down", show=False),
        Binding("greater_than_sign,ctrl+right", "pan(1)", "Band up", show=False),
        Binding("home", "whole", "Whole band", show=False),
    ]
    KEYS = (
        "In the plot: left and right move the cursor (with Shift by ten points), up and down zoom "
        "in and out around it, < and > pan, Home shows the whole band. The mouse puts the cursor "
        "anywhere."
    )
    """Its keys, for the help of a step."""

    DEFAULT_CSS = """
    BodePlot { height: 1fr; }
    BodePlot #gain { height: 2fr; }
    BodePlot #phase { height: 1fr; min-height: 6; }
    BodePlot.-gain-only #phase { display: none; }
    BodePlot.-phase-only #gain { display: none; }
    BodePlot.-phase-only #phase { height: 1fr; }
    BodePlot #legend-line { height: 1; text-wrap: nowrap; text-overflow: ellipsis; }
    BodePlot:focus #legend-line { text-style: bold; }
    """

    class CursorMoved(Message):
        """The cursor stands elsewhere."""

        def __init__(self, plot: BodePlot, frequency_hz: float) -> None:
            super().__init__()
            self.plot, self.frequency_hz = plot, frequency_hz

    def __init__(self, id: str = "bode") -> None:
        super().__init__(id=id)
        self.traces: tuple[Trace, ...] = ()
        self.predictions: tuple[Prediction, ...] = ()
        self.cursor_hz: float | None = None
        self.view_hz: tuple[float, float] | None = None
        """The band that is zoomed into; None for the whole."""
        self._span: tuple[float, float] | None = None
        self._lines: list[tuple[float, str]] = []

    def compose(self) -> ComposeResult:
        """Gain, phase, legend."""
        yield Chart("gain")
        yield Chart("phase")
        yield Words("", id="legend-line")

    def on_mount(self) -> None:
        """The colours follow the theme."""
        self.app.theme_changed_signal.subscribe(self, lambda _: self._redraw())

    def on_resize(self) -> None:
        """Dots and ticks are for a size."""
        self.call_after_refresh(self._redraw)

    def draw(
        self,
        traces: Sequence[Trace],
        span_hz: tuple[float, float] | None = None,
        lines: Iterable[tuple[float, str]] = (),
        predictions: Sequence[Prediction] = (),
    ) -> None:
        """Draw traces anew.

        Parameters
        ----------
        traces
            What to draw; references go behind the others.
        span_hz
            Band of the frequency axis; that of the traces if left out.
        lines
            Vertical lines as (Hz, label).
        predictions
            What a model says of the levels: a line with its band.
        """
        self.traces = tuple(sorted(traces, key=lambda trace: not trace.reference))
        self.predictions = tuple(predictions)
        self._span, self._lines = span_hz, list(lines)
        self._redraw()

    @property
    def reading(self) -> str:
        """The points under the cursor in words; empty without a cursor or points."""
        parts: list[str] = []
        before = np.nan
        for trace in self.traces:
            if self.cursor_hz is None or not len(trace.frequency_hz):
                continue
            at = _nearest(trace.frequency_hz, self.cursor_hz)
            hertz, error = trace.frequency_hz[at], trace.gain_std_db[at]
            bar = f" +-{error:.2f}" if np.isfinite(error) else ""
            # The frequency is told once where the levels share it.
            where = "" if hertz == before else f"{hertz:.2f} Hz "
            before = hertz
            parts.append(
                f"{where}{trace.name}: {trace.gain_db[at]:.2f}{bar} dB "
                f"{trace.phase_deg[at]:.0f} deg"
            )
        return "; ".join(parts)

    # ------------------------------------------------------------ keys and mouse

    def action_move(self, points: int) -> None:
        """Move the cursor by some points of all traces taken together."""
        grid = self._grid()
        if not len(grid):
            return
        start = len(grid) // 2 if self.cursor_hz is None else _nearest(grid, self.cursor_hz)
        self._place(float(grid[int(np.clip(start + points, 0, len(grid) - 1))]))

    def action_zoom(self, steps: int) -> None:
        """Show less of the band around the cursor, or more."""
        whole, band = self._whole(), self._band()
        if whole is None or band is None:
            return
        low, high = band
        middle = 0.5 * (low + high) if self.cursor_hz is None else self.cursor_hz
        width = (high - low) * _ZOOM**steps
        if width < _NARROWEST * middle:
            return
        share = 0.5 if high == low else (middle - low) / (high - low)
        self._look(middle - share * width, middle + (1.0 - share) * width)

    def action_pan(self, steps: int) -> None:
        """Move the band that is shown."""
        if self.view_hz is not None:
            low, high = self.view_hz
            self._look(low + steps * _PAN * (high - low), high + steps * _PAN * (high - low))

    def action_whole(self) -> None:
        """Show the whole band."""
        self.view_hz = None
        self._redraw()

    def on_click(self, event: events.Click) -> None:
        """Put the cursor where the mouse is."""
        chart = event.widget
        grid = self._grid()
        if not isinstance(chart, Chart) or not len(grid):
            return
        hertz = chart.value_at(event.screen_x - chart.region.x)
        if hertz is not None:
            self._place(float(grid[_nearest(grid, hertz)]))

    # ------------------------------------------------------------ inside

    def _grid(self) -> NDArray[np.float64]:
        grids = [trace.frequency_hz for trace in self.traces if not trace.reference]
        return np.unique(np.concatenate(grids)) if grids else np.zeros(0)

    def _place(self, hertz: float) -> None:
        self.cursor_hz = hertz
        if self.view_hz is not None:
            low, high = self.view_hz
            # A cursor that leaves the band takes it along.
            shift = min(0.0, hertz - low) + max(0.0, hertz - high)
            self.view_hz = (low + shift, high + shift)
        self._redraw()
        self.post_message(self.CursorMoved(self, hertz))

    def _look(self, low: float, high: float) -> None:
        whole = self._whole()
        if whole is None:
            return
        width = high - low
        low = max(whole[0], min(low, whole[1] - width))
        high = min(whole[1], low + width)
        self.view_hz = None if (low, high) == whole else (low, high)
        self._redraw()

    def _whole(self) -> tuple[float, float] | None:
        if self._span is not None:
            return self._span
        grids = [t.frequency_hz for t in self.traces if len(t.frequency_hz)]
        if not grids:
            return None
        low, high = min(float(g[0]) for g in grids), max(float(g[-1]) for g in grids)
        return (low, high) if high > low else (0.99 * low, 1.01 * high)

    def _band(self) -> tuple[float, float] | None:
        return self.view_hz or self._whole()

    def _redraw(self) -> None:
        if not self.is_mounted or not self.query("#legend-line"):
            return
        gain, phase = self.query_one("#gain", Chart), self.query_one("#phase", Chart)
        with self.app.batch_update():
            self._draw_gain(gain)
            self._draw_phase(phase)
            words = legend(self.traces, self.predictions) or "no points yet"
            if self.view_hz is not None:
                words += f"  \u2502 zoom {self.view_hz[0]:.4g} to {self.view_hz[1]:.4g} Hz"
            self.query_one("#legend-line", Words).update(words)

    def _draw_gain(self, chart: Chart) -> None:
        band = self._band()
        if band is None:
            chart.show(None)
            return
        width, height = chart.inner
        layers, span = gain_layers(self.traces, self.predictions, band, chart.palette, width)
        low, high = span or (-1.0, 1.0)
        drawing = Drawing(
            "gain, dB re 1 V/V", "Hz", frequency_scale(*band, width),
            linear_scale(low, high, height), [*layers, *self._marked(chart)],
        )  # fmt: skip
        chart.show(drawing)

    def _draw_phase(self, chart: Chart) -> None:
        band = self._band()
        if band is None:
            chart.show(None)
            return
        width, height = chart.inner
        layers, span = phase_layers(self.traces, self.predictions, band, chart.palette, width)
        low, high = span or (-180.0, 0.0)
        drawing = Drawing(
            "phase, deg, continuous", "Hz", frequency_scale(*band, width),
            degree_scale(low, high, height), [*layers, *self._marked(chart)],
        )  # fmt: skip
        chart.show(drawing)

    def _marked(self, chart: Chart) -> list[Layer]:
        palette = chart.palette
        lines: list[Layer] = [Line(hertz, palette.alert, label) for hertz, label in self._lines]
        if self.cursor_hz is not None:
            lines.append(Line(self.cursor_hz, palette.ink, solid=True))
        return lines


def _nearest(grid: NDArray[np.float64], hertz: float) -> int:
    return int(np.argmin(np.abs(grid - hertz)))
