"""A Bode plot in characters: gain over phase on log frequency, with a cursor that can be moved.

Owns the two plots and the cursor. What is drawn comes as traces; nothing here
knows where they come from.
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
from textual_plot import HiResMode

from tui.app.widgets.axes import DegreeAxis, LogHertzAxis
from tui.app.widgets.panel import LEFT, Panel
from tui.app.widgets.plain import Words
from tui.app.widgets.traces import Trace, legend

__all__ = ["BodePlot"]

_MARGIN_DB = 0.08


class _Panel(Panel, can_focus=False):
    """Gain or phase."""

    def on_mount(self) -> None:
        """A logarithmic axis of frequency."""
        super().on_mount()
        self.set_x_formatter(LogHertzAxis())

    def hertz_at(self, column: int) -> float:
        """Frequency under a column of this widget, Hz."""
        log_hz, _ = self.get_coordinate_from_pixel(column - LEFT, 1)
        return float(10.0**log_hz)


class BodePlot(Vertical, can_focus=True):
    """Gain and phase of some traces; left and right move the cursor from point to point."""

    BINDINGS = [
        Binding("left", "move(-1)", "Cursor left", show=False),
        Binding("right", "move(1)", "Cursor right", show=False),
        Binding("shift+left", "move(-10)", "Cursor far left", show=False),
        Binding("shift+right", "move(10)", "Cursor far right", show=False),
    ]

    DEFAULT_CSS = """
    BodePlot { height: 1fr; }
    BodePlot #gain { height: 2fr; }
    BodePlot #phase { height: 1fr; min-height: 6; }
    BodePlot.-gain-only #phase { display: none; }
    BodePlot.-phase-only #gain { display: none; }
    BodePlot.-phase-only #phase { height: 1fr; }
    BodePlot #legend-line { height: 1; color: $text-muted; }
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
        self.cursor_hz: float | None = None
        self._span: tuple[float, float] | None = None
        self._lines: list[tuple[float, str]] = []

    def compose(self) -> ComposeResult:
        """Gain, phase, legend."""
        yield _Panel("gain")
        yield _Panel("phase")
        yield Words("", id="legend-line")

    def on_mount(self) -> None:
        """Axes and the first, empty drawing."""
        self.query_one("#phase", _Panel).set_ylimits(-190.0, 190.0)
        self.draw(self.traces)

    def draw(
        self,
        traces: Sequence[Trace],
        span_hz: tuple[float, float] | None = None,
        lines: Iterable[tuple[float, str]] = (),
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
        """
        self.traces = tuple(sorted(traces, key=lambda trace: not trace.reference))
        self._span, self._lines = span_hz, list(lines)
        self._redraw()

    @property
    def reading(self) -> str:
        """The points under the cursor in words; empty without a cursor or points."""
        parts = []
        for trace in self.traces:
            if self.cursor_hz is None or not len(trace.frequency_hz):
                continue
            at = int(np.argmin(np.abs(trace.frequency_hz - self.cursor_hz)))
            error = trace.gain_std_db[at]
            bar = f" +-{error:.2f}" if np.isfinite(error) else ""
            parts.append(
                f"{trace.name}: {trace.frequency_hz[at]:.2f} Hz "
                f"{trace.gain_db[at]:.2f}{bar} dB {trace.phase_deg[at]:.0f} deg"
            )
        return "; ".join(parts)

    def action_move(self, points: int) -> None:
        """Move the cursor by some points of all traces taken together."""
        grids = [trace.frequency_hz for trace in self.traces if not trace.reference]
        if not grids:
            return
        grid = np.unique(np.concatenate(grids))
        start = len(grid) // 2 if self.cursor_hz is None else _nearest(grid, self.cursor_hz)
        self._place(float(grid[int(np.clip(start + points, 0, len(grid) - 1))]))

    def on_click(self, event: events.Click) -> None:
        """Put the cursor where the mouse is."""
        panel = event.widget
        while panel is not None and not isinstance(panel, _Panel):
            panel = panel.parent if panel.parent is not self else None  # type: ignore[assignment]
        if panel is None or not self.traces:
            return
        grid = np.unique(np.concatenate([trace.frequency_hz for trace in self.traces]))
        hertz = panel.hertz_at(event.screen_x - panel.region.x)
        self._place(float(grid[_nearest(grid, hertz)]))

    def _place(self, hertz: float) -> None:
        self.cursor_hz = hertz
        self._redraw()
        self.post_message(self.CursorMoved(self, hertz))

    def _redraw(self) -> None:
        if not self.is_mounted:
            return
        gain, phase = self.query_one("#gain", _Panel), self.query_one("#phase", _Panel)
        with self.app.batch_update():
            for panel in (gain, phase):
                panel.clear()
                if span := self._log_span():
                    panel.set_xlimits(*span)
            for trace in self.traces:
                _draw_gain(gain, trace)
                _draw_phase(phase, trace)
            _fit(gain, self.traces)
            # The frame takes three lines of it.
            phase.set_y_formatter(DegreeAxis(phase.size.height - 3))
            for panel in (gain, phase):
                for hertz, _ in self._lines:
                    panel.add_v_line(float(np.log10(hertz)), "green")
                if self.cursor_hz is not None:
                    panel.add_v_line(float(np.log10(self.cursor_hz)), "bright_white")
            words = legend(self.traces) or "no points yet"
            if names := dict.fromkeys(label for _, label in self._lines if label):
                words += f"  \u2502 {', '.join(names)}"
            unit = "phase, wrapped, deg" if self.has_class("-phase-only") else "gain, dB re 1 V/V"
            self.query_one("#legend-line", Words).update(f"{unit} over Hz   {words}")

    def _log_span(self) -> tuple[float, float] | None:
        if self._span is not None:
            low, high = self._span
        elif grids := [t.frequency_hz for t in self.traces if len(t.frequency_hz)]:
            low, high = min(g[0] for g in grids), max(g[-1] for g in grids)
        else:
            return None
        margin = 0.01 + 0.01 * (np.log10(high) - np.log10(low))
        return float(np.log10(low) - margin), float(np.log10(high) + margin)


def _nearest(grid: NDArray[np.float64], hertz: float) -> int:
    return int(np.argmin(np.abs(grid - hertz)))


def _draw_gain(panel: _Panel, trace: Trace) -> None:
    x = np.log10(trace.frequency_hz)
    for run in trace.runs:
        if run.stop - run.start > 1:
            panel.plot(x[run], trace.gain_db[run], trace.style, HiResMode.BRAILLE)
    if trace.reference:
        return
    marks, bars = np.array(trace.marks), trace.bars_db
    for mark in dict.fromkeys(trace.marks):
        at = (marks == mark) & np.isfinite(trace.gain_db)
        style = trace.style if mark == trace.mark else "bold red"
        if at.any():
            panel.errorbar(
                x[at], trace.gain_db[at], None, bars[at], marker=mark, marker_style=style
            )


def _draw_phase(panel: _Panel, trace: Trace) -> None:
    x = np.log10(trace.frequency_hz)
    if trace.reference:
        # Points, since a line would join -180 to 180 degrees across the panel.
        panel.scatter(x, trace.phase_deg, marker_style=trace.style, hires_mode=HiResMode.BRAILLE)
        return
    marks = np.array(trace.marks)
    for mark in dict.fromkeys(trace.marks):
        at = marks == mark
        style = trace.style if mark == trace.mark else "bold red"
        panel.scatter(x[at], trace.phase_deg[at], mark, style)


def _fit(panel: _Panel, traces: Sequence[Trace]) -> None:
    """Limits of the gain axis with room for error bars; spoilt readings do not count."""
    lows, highs = [], []
    for trace in traces:
        for run in trace.runs:
            bars = np.minimum(trace.bars_db[run], 20.0)
            lows.append(float(np.min(trace.gain_db[run] - bars)))
            highs.append(float(np.max(trace.gain_db[run] + bars)))
    if not lows:
        return
    low, high = min(lows), max(highs)
    margin = max(0.5, _MARGIN_DB * (high - low))
    panel.set_ylimits(low - margin, high + margin)
