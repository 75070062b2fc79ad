"""The screen that shows a recorded session as it ran, at any speed.

Owns the clock of the replay. There is no instrument behind it, and it says so.
"""

from __future__ import annotations

import time
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.widgets import ProgressBar

from daq.store_records import StoredPoint
from daq.untrusted.visible_text import visible_line
from tui.app.plot.bode import BodePlot
from tui.app.plot.traces import traces_of_points
from tui.app.state.recording import Recording
from tui.app.style import STYLE
from tui.app.terminal_app import TerminalApp
from tui.app.widgets.key_footer import KeyFooter
from tui.app.widgets.plain import Words
from tui.app.words import point_words, span_words

__all__ = ["ReplayApp"]

_TICK_S = 0.1
_FACTOR = 2.0
_JUMP_S = 0.1
"""Part of the whole that a jump covers."""


class ReplayApp(TerminalApp):
    """Plays a recording.

    Parameters
    ----------
    recording
        What to play.
    speed
        Seconds of the record per second.
    """

    TITLE = "lashbench replay"
    CSS = STYLE
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "pause", "Pause", priority=True),
        Binding("plus,equals_sign", "faster", "Faster", key_display="+"),
        Binding("minus", "slower", "Slower", key_display="-"),
        Binding("full_stop", "jump(1)", "Forward", key_display="."),
        Binding("comma", "jump(-1)", "Back", key_display=","),
        Binding("e,E", "end", "End"),
        Binding("q,Q", "quit", "Quit"),
    ]

    def __init__(self, recording: Recording, speed: float = 1.0) -> None:
        super().__init__()
        self.recording = recording
        self.speed = speed
        self.at_s = 0.0
        """Moment of the record that is shown."""
        self.paused = False
        self._clock_s = time.monotonic()
        self._shown = -1

    def compose(self) -> ComposeResult:
        """Banner, plot, lines."""
        yield Words(id="banner")
        with Vertical(classes="pane"):
            yield BodePlot()
            yield ProgressBar(total=max(0.001, self.recording.duration_s), show_eta=False)
            yield Words("", id="text")
        yield KeyFooter(compact=True)

    def on_mount(self) -> None:
        """Start the clock."""
        self.query_one(BodePlot).focus()
        self._clock_s = time.monotonic()
        self.set_interval(_TICK_S, self._tick)
        self._show()

    def on_resize(self) -> None:
        """Gain alone where there is little room."""
        self.query_one(BodePlot).set_class(self.size.height < 30, "-gain-only")

    def action_pause(self) -> None:
        """Hold, or go on."""
        self.paused = not self.paused
        self._show()

    def action_faster(self) -> None:
        """Twice as fast."""
        self.speed *= _FACTOR
        self._show()

    def action_slower(self) -> None:
        """Half as fast."""
        self.speed /= _FACTOR
        self._show()

    def action_jump(self, direction: int) -> None:
        """A tenth of the whole on, or back."""
        self._move(self.at_s + direction * _JUMP_S * self.recording.duration_s)

    def action_end(self) -> None:
        """All of it at once."""
        self._move(self.recording.duration_s)

    def _tick(self) -> None:
        now_s = time.monotonic()
        passed_s, self._clock_s = now_s - self._clock_s, now_s
        if not self.paused and self.at_s < self.recording.duration_s:
            self._move(self.at_s + self.speed * passed_s)

    def _move(self, at_s: float) -> None:
        self.at_s = min(max(0.0, at_s), self.recording.duration_s)
        self._show()

    def _show(self) -> None:
        if not self.query("#banner"):
            return  # A last tick while the screen is being taken down.
        seen = [entry for entry in self.recording.entries if entry.at_s <= self.at_s]
        points: dict[tuple[float, float], StoredPoint] = {}
        latest, said = "", ""
        for entry in seen:
            if entry.point is not None:
                # One that was measured again takes the old one's place, as it did then.
                points[entry.point.source_vpk, entry.point.requested_hz] = entry.point
                latest = point_words(entry.point)
            else:
                said = entry.text
        if len(seen) != self._shown:
            traces = traces_of_points(points.values(), self.recording.levels_vpk)
            low, high = self.recording.span_hz
            self.query_one(BodePlot).draw(traces, (low, high) if high > low else None)
            self._shown = len(seen)
        self.query_one(ProgressBar).update(progress=self.at_s)
        over = self.at_s >= self.recording.duration_s
        word = "PAUSED" if self.paused else "END" if over else "playing"
        simulated = "SIMULATED | " if self.recording.simulated else ""
        self.query_one("#banner", Words).update(
            visible_line(f" REPLAY, no instrument | {simulated}{self.recording.title}")
        )
        cursor = self.query_one(BodePlot).reading
        clock = f"{span_words(self.at_s)} of {span_words(self.recording.duration_s)}"
        lines = [
            f"{word}, {self.speed:g} times as fast, {clock}, {len(points)} points",
            f"now: {latest}" if latest else "",
            f"cursor: {cursor}" if cursor else said,
        ]
        self.query_one("#text", Words).update("\n".join(lines))
