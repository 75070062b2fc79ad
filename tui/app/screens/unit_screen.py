"""Step 1: the unit under test, who measures, and recent sessions, interrupted ones first.

Owns the choice of the unit and of a session to go on with.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets.option_list import Option

from daq.errors import LashbenchError
from daq.untrusted.visible_text import visible_line
from tui.app.state.sessions import one_session, recent_sessions
from tui.app.step_screen import StepScreen
from tui.app.widgets.plain import Caption, Choices, Field, Table, Words, choice

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.store_records import HistoryLine, Measurement
    from sim.unit import Unit

__all__ = ["UnitScreen"]

_RECENT = 20
_READING_S = 30.0
"""How long a sentence on an unusual value stays."""
_REMARKS = {"serial": "serial number", "operator": "operator", "notes": "notes"}


class UnitScreen(StepScreen):
    """Which unit, which serial number, by whom."""

    STEP = 1
    HELP = """
Choose the unit under test: highlight it and press Enter, or type the path of a unit file.
Its parameters and limits stand beside it. Serial number, operator and notes are kept with
every measurement as they are when it begins, and cannot be changed while it is under way or to
be gone on with; Enter on a unit begins a new one.

Enter on a unit leads to the serial number, and Enter in a field to the next one. The line with >
names the field that is typed into; Esc leaves the fields, so that 1 to 7 are steps again.

Below are the sessions of this bench. One that was interrupted comes first: highlight it and
press Enter to go on with it where it ended. Enter on a complete one opens its result.
"""
    BINDINGS = [Binding("ctrl+r", "resume", "Resume", id="unit.resume", show=False)]
    DEFAULT_CSS = """
    UnitScreen #choice { height: 13; }
    UnitScreen.-tall #choice { height: 16; }
    UnitScreen #left { width: 40; }
    UnitScreen #units { height: 4; border: none; }
    UnitScreen #parameters { width: 1fr; height: 1fr; }
    UnitScreen #sessions { height: 1fr; }
    """

    _listed_beside: int | None = None
    """The session that was under way when the others were listed."""
    _sessions: Sequence[HistoryLine] = ()
    """Those that are listed."""
    _offered = False
    """Whether the offer to resume had its chance to take the focus."""

    def body(self) -> ComposeResult:
        """Unit and operator on top, sessions below."""
        with Horizontal(id="choice"):
            with Vertical(id="left", classes="pane"):
                yield Words("Unit under test", classes="heading")
                yield Choices(*self._units(), id="units", compact=True)
                for name, label, hint in (
                    *((remark, _REMARKS[remark], "") for remark in _REMARKS),
                    ("file", "unit file", "path, if not listed"),
                ):
                    with Horizontal(classes="field"):
                        yield Caption(label)
                        yield Field(id=name, placeholder=hint, compact=True)
                yield Words("", id="whose")
                yield Words("", id="limits")
            with VerticalScroll(id="parameters", classes="pane"):
                yield Words("", id="parameter-list")
        yield Words("Sessions of this bench", classes="heading pane", id="sessions-heading")
        yield Table(id="sessions", cursor_type="row", zebra_stripes=True)

    def on_mount(self) -> None:
        """The table's columns, the first unit, and the offer to resume."""
        table = self.query_one("#sessions", Table)
        table.add_columns("", "#", "started (UTC)", "unit", "serial", "state", "points")
        if self.desk.unit is None:
            self._choose("adss")
        super().on_mount()
        self.query_one("#units").focus()

    def arrive(self) -> None:
        """Sessions as they are now, and what is on the desk wherever it came from."""
        self._list_sessions()
        for name in _REMARKS:
            self.query_one(f"#{name}", Field).value = visible_line(getattr(self.desk, name))
        units = self.query_one("#units", Choices)
        places = {option.id: place for place, option in enumerate(units.options)}
        # None of them, where another of that name is on the desk.
        units.highlighted = places.get(self.desk.unit_name)

    def show_body(self) -> None:
        """Parameters and limits of the unit chosen; the sessions where one began or ended."""
        if self._under_way() != self._listed_beside:
            self._list_sessions()
        self._show_whose()
        unit = self.desk.unit
        if unit is None:
            return
        limits = unit.limits
        cells = [f"{name:<5} {value:<11.4g}" for name, value in unit.parameters.items()]
        cells.sort(key=len)  # the one with a long name goes on a line of its own
        half = len(cells) // 2
        pairs = [f"{left} {right}" for left, right in zip(cells[:half], cells[half:], strict=False)]
        origin = self.desk.unit_origin.splitlines()
        lines = [f"{unit.name}: SI units, b_t in degrees", *origin, *pairs, *cells[2 * half :]]
        self.query_one("#parameter-list", Words).update("\n".join(lines))
        self.query_one("#limits", Words).update(
            f"limits: {limits.source_vpk:g} V peak, offset {limits.source_offset_v:g} V\n"
            f"        {limits.start_hz:g} to {limits.stop_hz:g} Hz"
        )

    def hint(self) -> str:
        """Resume first, else choose."""
        if self.query("#sessions") and self.query_one("#sessions").has_focus:
            return "Enter: resume or open it.  Tab: a new session.  Ctrl+N: on to the instrument"
        field = self.typing_into
        if field == "unit file":
            return "Typing: unit file.  Enter reads it.  Esc leaves the fields"
        if field is not None:
            return f"Typing: {field}.  Enter: next.  Esc leaves the fields.  Ctrl+N: instrument"
        return "Enter: choose it, then type its serial number.  Ctrl+N: on to the instrument"

    def action_undo(self) -> None:
        """As every step; a path that was typed belongs to the unit that is put back."""
        self.query_one("#file", Field).value = ""
        super().action_undo()

    def unread(self) -> str:
        """A unit file that was typed and not read."""
        name = self.query_one("#file", Field).value.strip()
        if name and name != self.desk.unit_name:
            return "the unit file was typed but not read: press Enter on it, or clear it"
        return ""

    def on_descendant_focus(self) -> None:
        """The hint follows the focus."""
        self._show_frame()

    def copy_text(self) -> str:
        """The unit's parameters."""
        return str(self.query_one("#parameter-list", Words).content)

    def on_option_list_option_highlighted(self, event: Choices.OptionHighlighted) -> None:
        """A unit that comes with lashbench."""
        if event.option.id is not None and event.option_list.has_focus:
            self._choose(event.option.id)

    def on_option_list_option_selected(self, event: Choices.OptionSelected) -> None:
        """Chosen: on to who measures."""
        if event.option.id is not None and self._choose(event.option.id):
            self._begin_anew()
            self.query_one("#file", Field).value = ""
        self.query_one("#serial", Field).focus()

    def on_input_changed(self, event: Field.Changed) -> None:
        """What is typed is on the desk at once."""
        name = event.input.id
        if name not in _REMARKS or self.desk.remarks_of is not None:
            return
        # What came from a history is shown with escapes, and stays as it is until it is changed.
        if event.value != visible_line(getattr(self.desk, name)):
            setattr(self.desk, name, event.value.strip())
            self._show_frame()

    def on_input_submitted(self, event: Field.Submitted) -> None:
        """Enter goes on; a typed file is read first."""
        if event.input.id == "file" and event.value.strip():
            self._read_unit(event.value.strip())
            return
        if event.input.id == "notes":
            self.action_next()
        else:
            self.focus_next()

    def on_data_table_row_selected(self, event: Table.RowSelected) -> None:
        """Resume an interrupted session, open another."""
        line = next(one for one in self._sessions if str(one.id) == event.row_key.value)
        self._take_up(line)

    def action_resume(self) -> None:
        """Resume the latest interrupted session."""
        found = [one for one in self._sessions if one.state == "interrupted"]
        if found:
            self._take_up(found[0])
        else:
            self.notify("no session is interrupted")

    def _take_up(self, line: HistoryLine) -> None:
        if line.state != "interrupted":
            self.bench.open_session(line.id)
            return
        read = partial(one_session, self.desk.db, line.id)
        self.bench.beside.do("session", read, self._resume, "The session cannot be resumed")

    def _resume(self, measurement: Measurement) -> None:
        if self.bench.keeper.busy:
            self.notify("a session is under way; stop it first", severity="warning")
            return
        try:
            lost = self.desk.take_up(measurement)
        except LashbenchError as error:
            self.bench.show_error("The session cannot be resumed", error)
            return
        self.notify(f"going on with measurement {measurement.id}: connect its instrument")
        if lost:
            self.notify(lost, severity="warning")
        self.bench.go(2)

    def _begin_anew(self) -> None:
        """A unit that is chosen, not merely looked at, is to be measured from the beginning."""
        if not self.bench.keeper.busy:
            self.desk.begin_anew()
            self.show()

    def _show_whose(self) -> None:
        """Remarks of a measurement that has them already can be read, not changed."""
        kept_by = self.desk.remarks_of
        whose = self.query_one("#whose", Words)
        whose.display = kept_by is not None
        whose.update(
            f"session {kept_by} keeps them as they are;\nEnter on a unit: a new measurement"
        )
        for name in _REMARKS:
            self.query_one(f"#{name}", Field).disabled = kept_by is not None

    def _read_unit(self, name: str) -> None:
        """A file that is typed may lie anywhere: it is read beside the screen."""
        from sim.unit import load_unit

        if self.bench.keeper.busy and name != self.desk.unit_name:
            self.notify("a session is under way; its unit stays", severity="warning")
            return

        def take(unit: Unit) -> None:
            from sim.datasheet import find_unusual  # loaded beside the screen, with the unit

            if self.bench.keeper.busy:
                self.notify("a session is under way; its unit stays", severity="warning")
                return
            changes = name != self.desk.unit_name
            self.desk.take_unit(name, unit)
            if changes:
                self.bench.put_away()
            self._begin_anew()
            self.show()
            for text in find_unusual(unit):
                self.notify(text, severity="warning", timeout=_READING_S, markup=False)
            if self.query_one("#file").has_focus:
                self.query_one("#serial", Field).focus()

        read = partial(load_unit, name)
        self.bench.beside.do("unit", read, take, "The unit file cannot be used")

    def _choose(self, name: str) -> bool:
        """One that comes with lashbench: it is part of the program."""
        if self.bench.keeper.busy and name != self.desk.unit_name:
            self.notify("a session is under way; its unit stays", severity="warning")
            return False
        changes = name != self.desk.unit_name
        try:
            self.desk.choose_unit(name)
        except LashbenchError as error:
            self.bench.show_error("The unit file cannot be used", error)
            return False
        if changes:
            self.bench.put_away()
        self.show()
        return True

    @staticmethod
    def _units() -> list[Option]:
        from daq.configs import config_names

        return [choice(name.upper(), name) for name in config_names("units")]

    def _list_sessions(self) -> None:
        """Read them beside the screen; those of before stay until then."""
        self._listed_beside = self._under_way()
        db = self.desk.db
        self.bench.beside.do(
            "sessions", partial(recent_sessions, db), self._show_sessions,
            "The history cannot be read",
        )  # fmt: skip
        if not self._sessions:
            self.query_one("#sessions-heading", Words).update(f"Reading {db}")

    def _show_sessions(self, found: Sequence[HistoryLine]) -> None:
        running = self._under_way()
        self._sessions = [line for line in found if line.id != running][:_RECENT]
        table = self.query_one("#sessions", Table)
        cursor = table.cursor_row
        table.clear()
        for line in self._sessions:
            table.add_row(
                "RESUME" if line.state == "interrupted" else "",
                str(line.id),
                line.started[:16].replace("T", " "),
                line.unit + (" SIMULATED" if line.simulated else ""),
                line.serial or "-",
                line.state,
                f"{line.points}/{line.planned}",
                key=str(line.id),
            )
        table.move_cursor(row=min(cursor, max(0, len(self._sessions) - 1)))
        interrupted = sum(line.state == "interrupted" for line in self._sessions)
        self._head_sessions(interrupted, running)
        if interrupted and not self._offered and self.query_one("#units").has_focus:
            table.focus()
        self._offered = True
        self._show_frame()

    def _head_sessions(self, interrupted: int, running: int | None) -> None:
        words = f"Sessions of this bench ({self.desk.db})"
        if interrupted:
            words = f"{interrupted} interrupted: Enter on RESUME goes on   {words}"
        elif running is not None:
            words = f"Session {running} is under way: step 4   {words}"
        elif not self._sessions:
            words = f"No sessions yet in {self.desk.db}"
        self.query_one("#sessions-heading", Words).update(words)

    def _under_way(self) -> int | None:
        return self.desk.run.measurement if self.desk.run.live else None
