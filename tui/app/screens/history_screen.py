"""Step 7: the report, the trend of a unit over its sessions, several sessions overlaid.

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
from textual.containers import Horizontal, Vertical

from tui.app.dialogs.correction import CorrectionDialog
from tui.app.plot.bode import BodePlot
from tui.app.plot.chart import Chart
from tui.app.plot.curves import trend_drawing
from tui.app.plot.traces import LEVEL_MARKS, traces_of_sessions
from tui.app.screens.history_table import NARROW, ROOM, WIDE, narrow_cells, wide_cells
from tui.app.state.sessions import (
    audit_trail,
    correct_session,
    responses_of,
    rows_of_history,
)
from tui.app.step_screen import StepScreen
from tui.app.widgets.plain import Caption, Field, Table, Words
from tui.measurements.history_rows import answer_words

if TYPE_CHECKING:
    from daq.frf import FrequencyResponse

__all__ = ["HistoryScreen"]

_FEWEST = 2
"""Sessions of an overlay."""

_ORDERS = ("newest first", "r", "b1", "b2", "serial number")
_SORTED_BY = ("id", "contribution_ratio", "b1_deg", "b2_deg", "serial")
"""In the order of the key."""
_TREND_WORDS = "contribution ratio of stage 1 by session, oldest first, one standard error"


class HistoryScreen(StepScreen):
    """Report, trend, overlay."""

    STEP = 7
    HELP = """
W writes the report of the measurement in view as one HTML file that prints.

The table lists this unit's sessions. Enter opens one: it is then the one that result,
diagnosis and report are about. Space marks a session, up to six of them; O lays those that are
marked over each other in a plot, each with the mark that it has in the table and with a colour,
and Tab leads into it: its cursor reads all of them. T goes back to the trend: the
contribution ratio of every session of which a model is accepted, with its error bar. Below it
stands what was diagnosed of the session under the cursor, and every warning. U lists all units.
/ searches: type words that unit, serial number, operator, notes, state, day or number have;
Enter lists what has all of them, an empty line lists all. S sorts: newest first, by r, b1, b2 or
serial number. C corrects serial number, operator or notes of the session under the cursor; what
stood there before stays in its audit trail, which A shows.
"""
    BINDINGS = [
        Binding("w", "write", "Write report", id="history.report"),
        Binding("space", "mark", "Mark", id="history.mark"),
        Binding("o", "overlay", "Overlay", id="history.overlay"),
        Binding("slash", "search", "Search", id="history.search", key_display="/"),
        Binding("s", "sort", "Sort", id="history.sort", show=False),
        Binding("t", "trend", "Trend", id="history.trend", show=False),
        Binding("u", "units", "All units", id="history.units", show=False),
        Binding("c", "correct", "Correct", id="history.correct", show=False),
        Binding("a", "audit", "Audit trail", id="history.audit", show=False),
    ]
    DEFAULT_CSS = """
    HistoryScreen #list { height: auto; }
    HistoryScreen #finding { display: none; }
    HistoryScreen.-finding #finding { display: block; }
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
        self._rows: list[dict[str, Any]] = []
        self._every_unit = self._audit = False
        self._search, self._order = "", 0
        self._trends: list[str] = []
        self._trails: dict[int, list[str]] = {}
        self._columns: Mapping[str, int] = {}

    def body(self) -> ComposeResult:
        """Table, plot, words; the plot beside the others where there is room."""
        with Vertical(id="halves", classes="pane"):
            with Vertical(id="list"):
                with Horizontal(classes="field", id="finding"):
                    yield Caption("search")
                    yield Field("", id="search", compact=True)
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
        return NARROW if room < ROOM else WIDE

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
        read = partial(rows_of_history, desk.db, unit, self._search)
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
            return f"Enter: open a session.  {self._overlay_words()}"
        return f"W: write the report of #{self.desk.measurement}.  {self._overlay_words()}"

    def _overlay_words(self) -> str:
        count = len(self.desk.marked)
        if count < _FEWEST:
            return "Space marks two or more, O: overlay"
        return f"{count} marked, O: overlay; T: trend"

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
        """Mark or unmark the session under the cursor; as many as there are marks."""
        row, desk = self._row_under_cursor(), self.desk
        if row is None:
            return
        number = int(row["id"])
        if number in desk.marked:
            desk.marked = tuple(one for one in desk.marked if one != number)
        elif len(desk.marked) == len(LEVEL_MARKS):
            self.notify(
                f"{len(LEVEL_MARKS)} sessions can be told apart; Space on one unmarks it",
                severity="warning",
            )
            return
        else:
            desk.marked = (*desk.marked, number)
        self._fill()
        if self.has_class("-overlay") and len(desk.marked) >= _FEWEST:
            # The plot shows the marks that stand in the table.
            self.action_overlay()
        else:
            self.action_trend()

    def action_overlay(self) -> None:
        """Lay the marked sessions over each other."""
        marked = list(self.desk.marked)
        if len(marked) < _FEWEST:
            self.notify("mark two sessions or more first: Space", severity="warning")
            return

        def draw(responses: list[FrequencyResponse]) -> None:
            traces = traces_of_sessions(dict(zip(marked, responses, strict=True)))
            self.add_class("-overlay")
            self.query_one(BodePlot).draw(traces)
            self.show()

        read = partial(responses_of, self.desk.db, marked)
        self.bench.beside.do("overlay", read, draw, "The sessions cannot be overlaid")

    def on_bode_plot_cursor_moved(self) -> None:
        """The reading follows the cursor."""
        self.query_one("#text", Words).update("\n".join(self._lines()))

    def action_trend(self) -> None:
        """Back to the trend."""
        self.remove_class("-overlay")
        self.show()

    def action_search(self) -> None:
        """Type what to search for."""
        self.add_class("-finding")
        self.query_one("#search", Field).focus()

    def on_input_submitted(self, event: Field.Submitted) -> None:
        """List what has the words."""
        event.stop()
        self._search = event.value.strip()
        self.set_class(bool(self._search), "-finding")
        self.query_one("#sessions", Table).focus()
        self.arrive()

    def action_sort(self) -> None:
        """Another order."""
        self._order = (self._order + 1) % len(_ORDERS)
        self._fill()
        self.show()

    def _listed(self) -> list[dict[str, Any]]:
        """The rows in the order in which they stand; what has no value comes last."""
        key = _SORTED_BY[self._order]
        newest = self._rows[::-1]

        def value(row: dict[str, Any]) -> float | str | None:
            found = row[key]
            return found["value"] if isinstance(found, dict) else found

        if not self._order:
            return newest
        known = [row for row in newest if value(row) not in (None, "")]
        lacking = [row for row in newest if value(row) in (None, "")]
        return [*sorted(known, key=value), *lacking]  # type: ignore[arg-type]

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
        narrow = self._columns == NARROW
        for row in self._listed():
            cells = self._cells(row, narrow)
            table.add_row(*cells, key=str(row["id"]))
        table.move_cursor(row=min(cursor, max(0, len(self._rows) - 1)))

    def _cells(self, row: dict[str, Any], narrow: bool = False) -> list[str]:
        marked, in_view = self.desk.marked, row["id"] == self.desk.measurement
        mark = LEVEL_MARKS[marked.index(row["id"])] if row["id"] in marked else ""
        if narrow:
            return narrow_cells(row, mark, in_view, self._every_unit)
        return wide_cells(row, mark, in_view)

    def _row_under_cursor(self) -> dict[str, Any] | None:
        table = self.query_one("#sessions", Table)
        listed = self._listed()
        return listed[table.cursor_row] if 0 <= table.cursor_row < len(listed) else None

    def _draw_trend(self) -> None:
        chart = self.query_one("#trend", Chart)
        ratios = [row["contribution_ratio"] for row in self._rows if row["contribution_ratio"]]
        chart.show(trend_drawing(chart, ratios))

    def _lines(self) -> list[str]:
        results, lines = self.desk.results, []
        # What was just asked for comes first; small screens show the first lines only.
        if self.has_class("-overlay") and (reading := self.query_one(BodePlot).reading):
            lines.append(f"cursor: {reading}")
        if results.report is not None:
            lines.append(f"REPORT: {results.report.name} in {results.report.parent}")
        if "report" in results.faults:
            lines.append(f"NO REPORT: {results.faults['report']}")
        row = self._row_under_cursor()
        if row is not None and self._audit:
            return [*lines, *self._trail(row)]
        if row is not None:
            if self._columns == NARROW:
                of = f"{row['unit']} {row['serial']}".strip()
                state = row["state"] + (", SIMULATED" if row["simulated"] else "")
                lines.append(f"#{row['id']}: {of}, {state}")
            lines += [f"#{row['id']}: {words}" for words in answer_words(row)]
        if self._order:
            lines.append(f"sorted by {_ORDERS[self._order]}")
        if self._search and not self._rows:
            return [*lines, f"no session has {self._search!r}; / and an empty line list all"]
        if self._search:
            lines.append(f"searched for {self._search!r}, found: {len(self._rows)}")
        if not self.has_class("-overlay"):
            lines.append(_TREND_WORDS)
        lines += self._trends
        if self.bench.beside.is_under_way("history") and not self._rows:
            lines.append(f"reading {self.desk.db}")
        elif not any(row["answer"]["state"] != "none" for row in self._rows):
            lines.append("no session is estimated yet: open one with Enter")
        return lines
