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
from tui.app.judged_words import headline, item_lines
from tui.app.plot.bode import BodePlot
from tui.app.plot.chart import Chart
from tui.app.plot.curves import trend_drawing
from tui.app.screens.history_table import NARROW, ROOM, WIDE, narrow_cells, wide_cells
from tui.app.screens.session_overlay import SessionOverlay
from tui.app.state.listing import Listed, Listing
from tui.app.state.sessions import (
    audit_trail,
    correct_session,
    judge_sessions,
    rows_of_history,
)
from tui.app.widgets.plain import Caption, Field, Table, Words
from tui.measurements.history_rows import answer_words

if TYPE_CHECKING:
    from analysis.acceptance import Judgement

__all__ = ["HistoryScreen"]

_TREND_WORDS = "contribution ratio of stage 1 by session, oldest first, one standard error"


class HistoryScreen(SessionOverlay):
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
serial number. J chooses limits: each session is judged by them, and below the table stands why.

C corrects serial number, operator or notes of the session under the cursor; what
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
    HistoryScreen.-side #text { max-height: 16; }
    """

    def __init__(self) -> None:
        super().__init__()
        self._listing = Listing()
        self._every_unit = self._audit = False
        self._search = ""
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
            self.fill()
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
        read = partial(rows_of_history, desk.db, unit, self._search, desk.limits_choice)
        self.bench.beside.do("history", read, self._take, "The history cannot be read")

    def _take(self, found: Listed) -> None:
        self._listing.found = found
        self._trails.clear()
        self.fill()
        self.show()
        self._judge()

    def _judge(self) -> None:
        """Judge what is listed, some sessions at a time, beside the screen."""
        found, waiting = self._listing.found, self._listing.next_to_judge()
        if found.limits is None or not waiting:
            return

        def take(judged: dict[int, Judgement]) -> None:
            if self._listing.found is found:
                self._listing.take(judged)
                self.fill()
                self.show()
                self._judge()

        work = partial(judge_sessions, self.desk.db, waiting, found.limits.limits)
        self.bench.beside.do("judging", work, take, "The sessions cannot be judged")

    def show_body(self) -> None:
        """Trend and words."""
        self._draw_trend()
        self.query_one("#text", Words).update("\n".join(self._lines()))

    def hint(self) -> str:
        """The report, then whatever is wanted."""
        if "report" in self.bench.analyses.progress:
            return "Writing the report"
        if self.desk.measurement is None:
            return f"Enter: open a session.  {self.overlay_words()}"
        return f"W: write the report of #{self.desk.measurement}.  {self.overlay_words()}"

    def copy_text(self) -> str:
        """The table and the trends."""
        rows = ["\t".join(cells) for cells in map(self._cells, self._listing.found.rows)]
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

    def on_bode_plot_cursor_moved(self) -> None:
        """The reading follows the cursor."""
        self.query_one("#text", Words).update("\n".join(self._lines()))

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
        self._listing.turn()
        self.fill()
        self.show()

    def action_units(self) -> None:
        """Sessions of this unit, or all."""
        self._every_unit = not self._every_unit
        self.arrive()

    def action_correct(self) -> None:
        """Ask what is wrong of the session under the cursor."""
        row = self.row_under_cursor()
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

    def fill(self) -> None:
        """Write the table anew."""
        table = self.query_one("#sessions", Table)
        cursor = table.cursor_row
        table.clear()
        narrow = self._columns == NARROW
        for row in self._listing.ordered():
            cells = self._cells(row, narrow)
            table.add_row(*cells, key=str(row["id"]))
        table.move_cursor(row=min(cursor, max(0, table.row_count - 1)))

    def _cells(self, row: dict[str, Any], narrow: bool = False) -> list[str]:
        mark, in_view = self.mark_of(row["id"]), row["id"] == self.desk.measurement
        judgement = self._listing.judgement(row["id"])
        verdict = "" if judgement is None else judgement.verdict
        if narrow:
            return narrow_cells(row, mark, in_view, verdict, self._every_unit)
        return wide_cells(row, mark, in_view, verdict)

    def row_under_cursor(self) -> dict[str, Any] | None:
        """The session that keys are about."""
        table = self.query_one("#sessions", Table)
        listed = self._listing.ordered()
        return listed[table.cursor_row] if 0 <= table.cursor_row < len(listed) else None

    def _draw_trend(self) -> None:
        chart = self.query_one("#trend", Chart)
        ratios = [row["contribution_ratio"] for row in self._listing.found.rows]
        chart.show(trend_drawing(chart, list(filter(None, ratios))))

    def _lines(self) -> list[str]:
        results, lines = self.desk.results, []
        # What was just asked for comes first; small screens show the first lines only.
        if self.has_class("-overlay") and (reading := self.query_one(BodePlot).reading):
            lines.append(f"cursor: {reading}")
        if results.report is not None:
            lines.append(f"REPORT: {results.report.name} in {results.report.parent}")
        if "report" in results.faults:
            lines.append(f"NO REPORT: {results.faults['report']}")
        row = self.row_under_cursor()
        if row is not None and self._audit:
            return [*lines, *self._trail(row)]
        if row is not None:
            lines += self._row_lines(row)
        return [*lines, *self._list_lines()]

    def _row_lines(self, row: dict[str, Any]) -> list[str]:
        """What was said of a session: verdict and why, diagnosis, warnings."""
        told = []
        if self._columns == NARROW:
            state = f"{row['state']}, {row['points']} points"
            state += ", SIMULATED" if row["simulated"] else ""
            told.append(f"{row['unit']} {row['serial']}".strip() + f", {state}")
        judgement = self._listing.judgement(row["id"])
        told += headline(judgement)
        told += [line for line in item_lines(judgement) if not line.startswith("PASS")]
        return [f"#{row['id']}: {words}" for words in [*told, *answer_words(row)]]

    def _list_lines(self) -> list[str]:
        """What is listed, and how."""
        found, lines = self._listing.found, []
        if found.fault:
            lines.append(f"NOT JUDGED: {found.fault}")
        if waiting := self._listing.waiting():
            lines.append(f"judging beside the screen, {len(waiting)} to go")
        if self._listing.order:
            lines.append(f"sorted by {self._listing.order}")
        if self._search and not found.rows:
            return [*lines, f"no session has {self._search!r}; / and an empty line list all"]
        if self._search:
            lines.append(f"searched for {self._search!r}, found: {len(found.rows)}")
        if not self.has_class("-overlay"):
            lines.append(_TREND_WORDS)
        lines += found.trends
        if self.bench.beside.is_under_way("history") and not found.rows:
            lines.append(f"reading {self.desk.db}")
        elif not any(row["answer"]["state"] != "none" for row in found.rows):
            lines.append("no session is estimated yet: open one with Enter")
        return lines
