"""Step 7: the report, the trend of a unit over its sessions, two sessions overlaid.

Owns the choice of sessions. Estimates that the history lacks are not made
here: a session gets one when its result is opened.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical

from daq.errors import LashbenchError
from tui.app.step_screen import StepScreen
from tui.app.widgets.bode import BodePlot
from tui.app.widgets.panel import Panel
from tui.app.widgets.plain import Table, Words
from tui.app.widgets.traces import traces_of_response
from tui.history_rows import measurement_row, trend_lines, trend_rows
from tui.reports import estimates_in_force

__all__ = ["HistoryScreen"]

_SHOWN = 200
_TREND_WORDS = "contribution ratio of stage 1 by session, oldest first, one standard error"


class HistoryScreen(StepScreen):
    """Report, trend, overlay."""

    STEP = 7
    HELP = """
W writes the report of the measurement in view as one HTML file that prints.

The table lists this unit's sessions. Enter opens one: it is then the one that result,
diagnosis and report are about. Space marks a session; with two marked, O lays one over the
other in a plot (the first marked is drawn as a line). T goes back to the trend: the
contribution ratio of every estimated session with its error bar. U lists all units.
"""
    BINDINGS = [
        Binding("w", "write", "Write report", id="history.report"),
        Binding("space", "mark", "Mark", id="history.mark"),
        Binding("o", "overlay", "Overlay", id="history.overlay"),
        Binding("t", "trend", "Trend", id="history.trend", show=False),
        Binding("u", "units", "All units", id="history.units", show=False),
    ]
    DEFAULT_CSS = """
    HistoryScreen #sessions { height: 8; }
    HistoryScreen.-tall #sessions { height: 16; }
    HistoryScreen BodePlot { display: none; }
    HistoryScreen.-overlay BodePlot { display: block; }
    HistoryScreen.-overlay #trend { display: none; }
    HistoryScreen #trend { height: 1fr; }
    HistoryScreen #text { height: auto; max-height: 5; }
    """

    def __init__(self) -> None:
        super().__init__()
        self._marked: list[int] = []
        self._rows: list[dict[str, Any]] = []
        self._every_unit = False

    def body(self) -> ComposeResult:
        """Table, plot, words."""
        with Vertical(classes="pane"):
            yield Table(id="sessions", cursor_type="row", zebra_stripes=True)
            yield Panel("trend")
            yield BodePlot()
            yield Words("", id="text")

    def on_mount(self) -> None:
        """Columns; gain alone where there is little room."""
        table = self.query_one("#sessions", Table)
        table.add_columns("", "#", "started", "unit", "state", "points", "r", "b1/deg", "b2/deg")
        self.query_one(BodePlot).set_class(self.size.height < 40, "-gain-only")
        super().on_mount()
        table.focus()

    def arrive(self) -> None:
        """Sessions as they are now."""
        self._read()
        self._fill()

    def show_body(self) -> None:
        """Trend and words."""
        self._draw_trend()
        self.query_one("#text", Words).update("\n".join(self._lines()))

    def hint(self) -> str:
        """The report, then whatever is wanted."""
        if "report" in self.bench.analyses.progress:
            return "Writing the report"
        if self.desk.measurement is None:
            return "Enter: open a session.  Space on two of them, then O: overlay"
        return f"W: write the report of #{self.desk.measurement}.  Space on two, then O: overlay"

    def copy_text(self) -> str:
        """The table and the trends."""
        rows = ["\t".join(cells) for cells in map(self._cells, self._rows)]
        return "\n".join([*rows, *self._lines()])

    # ------------------------------------------------------------ keys

    def action_next(self) -> None:
        """Nowhere to go."""
        self.notify("this is the last step; 1 begins anew")

    def action_write(self) -> None:
        """Write the report of the measurement in view."""
        desk = self.desk
        if desk.measurement is None:
            self.notify("open a session first: Enter", severity="warning")
            return
        # Where the operator is, not where the history lies: that may be a hidden folder.
        path = Path.cwd() / f"report-{desk.measurement}.html"
        self.bench.analyses.begin("report", path)
        self.show()

    def action_mark(self) -> None:
        """Mark or unmark the session under the cursor; two at most."""
        measurement = self._under_cursor()
        if measurement is None:
            return
        if measurement in self._marked:
            self._marked.remove(measurement)
        else:
            self._marked = [*self._marked, measurement][-2:]
        self._fill()

    def action_overlay(self) -> None:
        """Lay the two marked sessions over each other."""
        from daq.store import Store

        if len(self._marked) != 2:
            self.notify("mark two sessions first: Space", severity="warning")
            return
        below, above = self._marked
        try:
            with Store(self.desk.db, read_only=True) as store:
                traces = traces_of_response(store.response(below), f"#{below}")
                traces += traces_of_response(store.response(above))
        except LashbenchError as error:
            self.bench.show_error("The sessions cannot be overlaid", error)
            return
        self.add_class("-overlay")
        self.query_one(BodePlot).draw(traces)
        self.show()

    def action_trend(self) -> None:
        """Back to the trend."""
        self.remove_class("-overlay")
        self.show()

    def action_units(self) -> None:
        """Sessions of this unit, or all."""
        self._every_unit = not self._every_unit
        self.arrive()
        self.show()

    def on_data_table_row_selected(self, event: Table.RowSelected) -> None:
        """Open it."""
        measurement = next(m for m in self.bench.measurements() if str(m.id) == event.row_key.value)
        self.bench.open_measurement(measurement)

    # ------------------------------------------------------------ inside

    def _read(self) -> None:
        from daq.store import Store

        desk = self.desk
        unit = None if desk.unit is None or self._every_unit else desk.unit.name.lower()
        measurements = [
            m
            for m in self.bench.measurements()
            if m.points and unit in (None, m.header.unit.lower())
        ][-_SHOWN:]
        known: Mapping[int, Mapping[str, Any]] = {}
        if measurements:
            with Store(desk.db, read_only=True) as store:
                known = estimates_in_force(store, measurements)
        self._rows = [measurement_row(m, known.get(m.id, {})) for m in measurements]

    def _fill(self) -> None:
        table = self.query_one("#sessions", Table)
        cursor = table.cursor_row
        table.clear()
        for row in reversed(self._rows):
            table.add_row(*self._cells(row), key=str(row["id"]))
        table.move_cursor(row=min(cursor, max(0, len(self._rows) - 1)))

    def _cells(self, row: dict[str, Any]) -> list[str]:
        def shown(name: str, digits: int) -> str:
            number = row[name]
            return (
                "-" if not number else f"{number['value']:.{digits}f}+-{number['std']:.{digits}f}"
            )

        mark = "*" if row["id"] in self._marked else ""
        view = ">" if row["id"] == self.desk.measurement else ""
        unit = f"{row['unit']} {row['serial']}".strip() + (" SIM." if row["simulated"] else "")
        return [
            mark + view,
            str(row["id"]),
            row["started"][5:16].replace("T", " "),
            unit,
            row["state"],
            f"{row['points']}/{row['planned']}",
            shown("contribution_ratio", 2),
            shown("b1_deg", 3),
            shown("b2_deg", 3),
        ]

    def _under_cursor(self) -> int | None:
        table = self.query_one("#sessions", Table)
        newest_first = self._rows[::-1]
        if 0 <= table.cursor_row < len(newest_first):
            return int(newest_first[table.cursor_row]["id"])
        return None

    def _draw_trend(self) -> None:
        panel = self.query_one("#trend", Panel)
        panel.clear()
        rows = [row for row in self._rows if row["contribution_ratio"]]
        panel.set_ylimits(-0.05, 1.05)
        if not rows:
            return
        place = np.arange(len(rows), dtype=float) + 1.0
        value = np.array([row["contribution_ratio"]["value"] for row in rows], float)
        std = np.array([row["contribution_ratio"]["std"] or 0.0 for row in rows], float)
        panel.set_xlimits(0.5, len(rows) + 0.5)
        panel.set_xticks([float(p) for p in place[:: max(1, len(rows) // 12)]])
        panel.errorbar(place, value, None, std, marker="o", marker_style="bright_blue")

    def _lines(self) -> list[str]:
        results, lines = self.desk.results, []
        # What was just asked for comes first; small screens show the first lines only.
        if results.report is not None:
            lines.append(f"REPORT: {results.report.name} in {results.report.parent}")
        if "report" in results.faults:
            lines.append(f"NO REPORT: {results.faults['report']}")
        if not self.has_class("-overlay"):
            lines.append(_TREND_WORDS)
        lines += [line for line in trend_lines(trend_rows(self._rows)) if line]
        if not any(row["contribution_ratio"] for row in self._rows):
            lines.append("no session is estimated yet: open one with Enter")
        return lines
