"""Step 1: the unit under test, who measures, and recent sessions, interrupted ones first.

Owns the choice of the unit and of a session to go on with.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets.option_list import Option

from daq.errors import LashbenchError
from daq.visible_text import visible_line
from tui.app.step_screen import StepScreen
from tui.app.widgets.plain import Caption, Choices, Field, Table, Words, choice

if TYPE_CHECKING:
    from daq.store_records import Measurement

__all__ = ["UnitScreen"]

_RECENT = 20
_REMARKS = {"serial": "serial number", "operator": "operator", "notes": "notes"}


class UnitScreen(StepScreen):
    """Which unit, which serial number, by whom."""

    STEP = 1
    HELP = """
Choose the unit under test: highlight it and press Enter, or type the path of a unit file.
Its parameters and limits stand beside it. Serial number, operator and notes are kept with
every measurement as they are when it begins, and cannot be changed while it is under way or to
be gone on with; Enter on a unit begins a new one. Tab goes from field to field.

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

    def body(self) -> ComposeResult:
        """Unit and operator on top, sessions below."""
        with Horizontal(id="choice"):
            with Vertical(id="left", classes="pane"):
                yield Words("Unit under test", classes="heading")
                yield Choices(*self._units(), id="units", compact=True)
                for name, label, hint in (
                    ("file", "unit file", "or the path of one"),
                    *((remark, _REMARKS[remark], "") for remark in _REMARKS),
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
        interrupted = any(m.state == "interrupted" for m in self._measurements)
        self.query_one("#sessions" if interrupted else "#units").focus()

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
        return "Enter: choose the unit.  Tab: next field.  Ctrl+N: on to the instrument"

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
        if event.option.id is not None:
            self._choose(event.option.id)
            self._begin_anew()
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
            if not self._choose(event.value.strip()):
                return
            self._begin_anew()
        if event.input.id == "notes":
            self.action_next()
        else:
            self.focus_next()

    def on_data_table_row_selected(self, event: Table.RowSelected) -> None:
        """Resume an interrupted session, open another."""
        measurement = next(m for m in self._measurements if str(m.id) == event.row_key.value)
        if measurement.state == "interrupted":
            self._resume(measurement)
        else:
            self.bench.open_measurement(measurement)

    def action_resume(self) -> None:
        """Resume the latest interrupted session."""
        found = [m for m in self._measurements if m.state == "interrupted"]
        if found:
            self._resume(found[0])
        else:
            self.notify("no session is interrupted")

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

    def _choose(self, name: str) -> bool:
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
        self._listed_beside = running = self._under_way()
        self._measurements = self._recent(running)
        table = self.query_one("#sessions", Table)
        table.clear()
        for measurement in self._measurements:
            header = measurement.header
            simulated = measurement.instrument is not None and measurement.instrument.simulated
            table.add_row(
                "RESUME" if measurement.state == "interrupted" else "",
                str(measurement.id),
                measurement.started[:16].replace("T", " "),
                header.unit + (" SIMULATED" if simulated else ""),
                header.serial or "-",
                measurement.state,
                f"{measurement.points}/{header.plan.points}",
                key=str(measurement.id),
            )
        interrupted = sum(m.state == "interrupted" for m in self._measurements)
        words = f"Sessions of this bench ({self.desk.db})"
        if interrupted:
            words = f"{interrupted} interrupted: Enter on RESUME goes on   {words}"
        elif running is not None:
            words = f"Session {running} is under way: step 4   {words}"
        elif not self._measurements:
            words = f"No sessions yet in {self.desk.db}"
        self.query_one("#sessions-heading", Words).update(words)

    def _under_way(self) -> int | None:
        return self.desk.run.measurement if self.desk.run.live else None

    def _recent(self, running: int | None) -> list[Measurement]:
        """Interrupted ones with points first, then the latest; checks without a sweep left out."""
        found = [m for m in self.bench.measurements() if m.points > 0]
        latest = [m for m in reversed(found) if m.id != running][:_RECENT]
        return sorted(latest, key=lambda m: m.state != "interrupted")
