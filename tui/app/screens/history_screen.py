"""Step 7: the report, the trend of a unit over its sessions, two sessions overlaid.

Owns the choice of sessions. Estimates that the history lacks are not made
here: a session gets one when its result is opened.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical

from daq.servers.place import HistoryPlace, is_there
from tui.app.dialogs.correction import CorrectionDialog
from tui.app.plot.bode import BodePlot
from tui.app.plot.chart import Chart
from tui.app.plot.curves import trend_drawing
from tui.app.plot.traces import traces_of_response
from tui.app.state.sessions import audit_trail, correct_session, responses_of
from tui.app.step_screen import StepScreen
from tui.app.widgets.plain import Table, Words
from tui.measurements.history_rows import Trends, answer_words, measurement_row, trend_lines

if TYPE_CHECKING:
    from daq.frf import FrequencyResponse

__all__ = ["HistoryScreen"]

_SHOWN = 200
_ANSWERS = {"r": 11, "b1/deg": 13, "b2/deg": 13}
_WIDE = {"": 3, "#": 6, "started": 12, "unit": 26, "state": 12, "points": 10, **_ANSWERS}
_NARROW = {"#": 7, "started": 12, "serial": 9, "points": 8, **_ANSWERS}
"""Columns with their widths, a gap included."""

_ROOM = sum(_WIDE.values()) + 2
"""Columns that the wide table and its scroll bar take."""

_SHORT = 8
"""Characters of a serial number on a narrow screen; the words below have all of it."""

_TREND_WORDS = "contribution ratio of stage 1 by session, oldest first, one standard error"


class HistoryScreen(StepScreen):
    """Report, trend, overlay."""

    STEP = 7
    HELP = """
W writes the report of the measurement in view as one HTML file that prints.

The table lists this unit's sessions. Enter opens one: it is then the one that result,
diagnosis and report are about. Space marks a session; with two marked, O lays one over the
other in a plot (the first marked is drawn as a line). T goes back to the trend: the
contribution ratio of every session of which a model is accepted, with its error bar. Below it
stands what was diagnosed of the session under the cursor, and every warning. U lists all units.
C corrects serial number, operator or notes of the session under the cursor; what stood there
before stays in its audit trail, which A shows.
"""
    BINDINGS = [
        Binding("w", "write", "Write report", id="history.report"),
        Binding("space", "mark", "Mark", id="history.mark"),
        Binding("o", "overlay", "Overlay", id="history.overlay"),
        Binding("t", "trend", "Trend", id="history.trend", show=False),
        Binding("u", "units", "All units", id="history.units", show=False),
        Binding("c", "correct", "Correct", id="history.correct", show=False),
        Binding("a", "audit", "Audit trail", id="history.audit", show=False),
    ]
    DEFAULT_CSS = """
    HistoryScreen #list { height: auto; }
    HistoryScreen #plots { height: 1fr; }
    HistoryScreen.-side #halves { layout: horizontal; }
    HistoryScreen.-side #list { width: 3fr; height: 100%; }
    HistoryScreen.-side #plots { width: 2fr; height: 100%; }
    HistoryScreen #sessions { height: 8; }
    HistoryScreen.-tall #sessions { height: 16; }
    HistoryScreen.-side #sessions { height: 1fr; }
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
        self._every_unit = self._audit = False
        self._trends: list[str] = []
        self._trails: dict[int, list[str]] = {}
        self._columns: Mapping[str, int] = {}

    def body(self) -> ComposeResult:
        """Table, plot, words; the plot beside the others where there is room."""
        with Vertical(id="halves", classes="pane"):
            with Vertical(id="list"):
                yield Table(id="sessions", cursor_type="row", zebra_stripes=True)
                yield Words("", id="text")
            with Vertical(id="plots"):
                yield Chart("trend")
                yield BodePlot()

    def on_mount(self) -> None:
        """Columns."""
        self._add_columns()
        super().on_mount()
        self.query_one("#sessions", Table).focus()

    def on_resize(self) -> None:
        """Columns and plots are for a size."""
        self.query_one(BodePlot).set_class(self.size.height < 40, "-gain-only")
        self.call_after_refresh(self._fit)

    def _fit(self) -> None:
        if self._columns != self._headings():
            self.query_one("#sessions", Table).clear(columns=True)
            self._add_columns()
            self._fill()
        self.show()

    def _headings(self) -> Mapping[str, int]:
        room = self.query_one("#list").size.width or self.size.width
        return _NARROW if room < _ROOM else _WIDE

    def _add_columns(self) -> None:
        self._columns = self._headings()
        table = self.query_one("#sessions", Table)
        # Without padding each width has its gap; the table's own widths come too late.
        table.cell_padding = 0
        for heading in self._columns:
            table.add_column(heading, width=self._columns[heading])

    def arrive(self) -> None:
        """Sessions as they are now; those of before stay until they are read."""
        desk = self.desk
        unit = None if desk.unit is None or self._every_unit else desk.unit.name
        read = partial(_read_rows, desk.db, unit)
        self.bench.beside.do("history", read, self._take, "The history cannot be read")

    def _take(self, found: tuple[list[dict[str, Any]], list[str]]) -> None:
        self._rows, self._trends = found
        self._trails.clear()
        self._fill()
        self.show()

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
        if len(self._marked) != 2:
            self.notify("mark two sessions first: Space", severity="warning")
            return
        marked = list(self._marked)

        def draw(responses: list[FrequencyResponse]) -> None:
            below, above = responses
            traces = traces_of_response(below, f"#{marked[0]}") + traces_of_response(above)
            self.add_class("-overlay")
            self.query_one(BodePlot).draw(traces)
            self.show()

        read = partial(responses_of, self.desk.db, marked)
        self.bench.beside.do("overlay", read, draw, "The sessions cannot be overlaid")

    def action_trend(self) -> None:
        """Back to the trend."""
        self.remove_class("-overlay")
        self.show()

    def action_units(self) -> None:
        """Sessions of this unit, or all."""
        self._every_unit = not self._every_unit
        self.arrive()

    def action_correct(self) -> None:
        """Ask what is wrong of the session under the cursor."""
        row = self._row_under_cursor()
        if row is None:
            return
        dialog = CorrectionDialog(row["id"], row, self.desk.operator)

        def take(asked: tuple[str, dict[str, str]] | None) -> None:
            if asked is not None:
                self._correct(row["id"], *asked)

        self.app.push_screen(dialog, take)

    def action_audit(self) -> None:
        """Show the audit trail of the session under the cursor, or hide it."""
        self._audit = not self._audit
        self.show()

    def on_data_table_row_selected(self, event: Table.RowSelected) -> None:
        """Open it."""
        self.bench.open_session(int(event.row_key.value or 0))

    def on_data_table_row_highlighted(self) -> None:
        """What was said of it."""
        self.query_one("#text", Words).update("\n".join(self._lines()))

    # ------------------------------------------------------------ inside

    def _correct(self, measurement: int, person: str, changes: dict[str, str]) -> None:
        def tell(names: list[str]) -> None:
            words = f"corrected: {', '.join(names)}" if names else "nothing was to be corrected"
            self.notify(words)
            self.arrive()

        work = partial(correct_session, self.desk.db, measurement, person, changes)
        self.bench.beside.do("correction", work, tell, "Nothing was corrected")

    def _trail(self, row: dict[str, Any]) -> list[str]:
        """The audit trail of a session, read beside the screen when it is asked for first."""
        number = row["id"]
        if not row["corrections"]:
            return [f"#{number}: nothing was corrected"]
        if number not in self._trails:
            self._trails[number] = [f"#{number}: reading its audit trail"]

            def take(found: list[str]) -> None:
                self._trails[number] = found
                self.show()

            read = partial(audit_trail, self.desk.db, number)
            self.bench.beside.do(f"audit trail {number}", read, take, "It cannot be read")
        return self._trails[number]

    def _fill(self) -> None:
        table = self.query_one("#sessions", Table)
        cursor = table.cursor_row
        table.clear()
        narrow = self._columns == _NARROW
        for row in reversed(self._rows):
            cells = self._narrow_cells(row) if narrow else self._cells(row)
            table.add_row(*cells, key=str(row["id"]))
        table.move_cursor(row=min(cursor, max(0, len(self._rows) - 1)))

    def _cells(self, row: dict[str, Any]) -> list[str]:
        def shown(name: str, digits: int) -> str:
            number = row[name]
            if number:
                return f"{number['value']:.{digits}f}+-{number['std'] or 0.0:.{digits}f}"
            return row["answer"]["state"] if said and name == "contribution_ratio" else "-"

        said = row["estimate"] is not None or row["diagnosis"] is not None
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

    def _narrow_cells(self, row: dict[str, Any]) -> list[str]:
        """The same on 80 columns: nothing that was measured is cut."""
        mark, number, started, unit, state, points, *answer = self._cells(row)
        whole = f"{row['points']}" if row["state"] == "complete" else points
        name = row["serial"] if row["serial"] and not self._every_unit else unit
        simulated = "S" if row["simulated"] else ""
        return [f"{mark}{simulated}{number}", started, _short(name), whole, *answer]

    def _under_cursor(self) -> int | None:
        row = self._row_under_cursor()
        return None if row is None else int(row["id"])

    def _row_under_cursor(self) -> dict[str, Any] | None:
        table = self.query_one("#sessions", Table)
        newest_first = self._rows[::-1]
        if 0 <= table.cursor_row < len(newest_first):
            return newest_first[table.cursor_row]
        return None

    def _draw_trend(self) -> None:
        chart = self.query_one("#trend", Chart)
        ratios = [row["contribution_ratio"] for row in self._rows if row["contribution_ratio"]]
        chart.show(trend_drawing(chart, ratios))

    def _lines(self) -> list[str]:
        results, lines = self.desk.results, []
        # What was just asked for comes first; small screens show the first lines only.
        if results.report is not None:
            lines.append(f"REPORT: {results.report.name} in {results.report.parent}")
        if "report" in results.faults:
            lines.append(f"NO REPORT: {results.faults['report']}")
        row = self._row_under_cursor()
        if row is not None and self._audit:
            return [*lines, *self._trail(row)]
        if row is not None:
            if self._columns == _NARROW:
                of = f"{row['unit']} {row['serial']}".strip()
                state = row["state"] + (", SIMULATED" if row["simulated"] else "")
                lines.append(f"#{row['id']}: {of}, {state}")
            lines += [f"#{row['id']}: {words}" for words in answer_words(row)]
        if not self.has_class("-overlay"):
            lines.append(_TREND_WORDS)
        lines += self._trends
        if self.bench.beside.is_under_way("history") and not self._rows:
            lines.append(f"reading {self.desk.db}")
        elif not any(row["answer"]["state"] != "none" for row in self._rows):
            lines.append("no session is estimated yet: open one with Enter")
        return lines


def _short(text: str) -> str:
    return text if len(text) <= _SHORT else f"{text[: _SHORT - 1]}\u2026"


def _read_rows(db: HistoryPlace, unit: str | None) -> tuple[list[dict[str, Any]], list[str]]:
    """The latest sessions with points as rows, of one unit or of all, and the trends in words."""
    from daq.store import Store

    if not is_there(db):
        return [], []
    with Store(db, read_only=True) as store:
        lines = store.lines(unit, last=_SHOWN, with_points=True)
    rows = [measurement_row(line) for line in lines]
    return rows, [line for line in trend_lines(Trends(rows).rows()) if line]
