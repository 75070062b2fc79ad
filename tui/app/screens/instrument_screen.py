"""Step 2: which instrument, whether it answers, and what to do where it does not.

Owns the choice of the address. Connecting here asks who is there and drives
nothing.
"""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.widgets.option_list import Option

from daq.drivers import DRIVERS
from daq.errors import LashbenchError
from daq.untrusted.visible_text import visible_line
from tui.app.messages import InstrumentsListed
from tui.app.state.desk import SIMULATED_URL
from tui.app.step_screen import StepScreen
from tui.app.widgets.plain import Caption, Choices, Field, Words, choice

if TYPE_CHECKING:
    from daq.limits import Bench

__all__ = ["InstrumentScreen"]

_SIMULATED = (
    (SIMULATED_URL, "simulated bench, as fast as it computes"),
    (f"{SIMULATED_URL}&speed=realtime", "simulated bench, by the clock"),
)
_SECRETS = 10_000
"""Seeds of what a simulated bench hides; another one whenever the screen is opened."""
_OTHERS = tuple(driver for driver in DRIVERS if driver.scheme)
"""Instruments whose address does not stand alone."""
_BEFORE = ", or ".join(f"{one.scheme}: for {one.name}" for one in _OTHERS)
_REMEDIES = (
    "What to try:",
    "- the simulated bench needs nothing: choose it above",
    "- power, cable and address of the analyser; its front panel shows the address",
    *(f"- {one.name}: write {one.scheme}: before its address" for one in _OTHERS),
    "- a serial adapter needs the right to use its port: group dialout",
    "- a simulated one on a wire: lashbench serve --unit adss --ratio 0.3 --tcp 0",
)


class InstrumentScreen(StepScreen):
    """Simulated, found, or typed."""

    STEP = 2
    HELP = f"""
Choose where the analyser is and press Enter: a simulated bench, a port or resource that was
found on this machine, or an address that you type, such as TCPIP::192.0.2.7::5025::SOCKET,
GPIB0::11::INSTR, prologix:/dev/ttyUSB0?addr=11 or prologix-tcp:HOST:PORT?addr=11. These are for a
35670A. Before any of them write {_BEFORE}.

One simulated bench hides a cause: its address does not tell which. Measure it, diagnose it, and
press H in step 6 to see what it was.

The bench file has limits of its own, the rate at which the level changes and input ranges: type
"default" or the path of a file, and press Enter.

Connecting asks who is there and what the source does. It drives nothing.
"""
    BINDINGS = [
        Binding("ctrl+t", "connect", "Connect", id="instrument.connect"),
        Binding("ctrl+f", "find", "Search again", id="instrument.find", show=False),
    ]
    DEFAULT_CSS = """
    InstrumentScreen #found { height: auto; max-height: 6; border: none; }
    InstrumentScreen.-tall #found { max-height: 14; }
    InstrumentScreen #answer { height: 1fr; overflow-y: auto; }
    """

    def body(self) -> ComposeResult:
        """List, field, answer."""
        with Vertical(classes="pane"):
            yield Words("Instrument", classes="heading")
            yield Choices(*self._options([]), id="found", compact=True)
            with Horizontal(classes="field"):
                yield Caption("address")
                yield Field(self.desk.url, id="url", compact=True)
            with Horizontal(classes="field"):
                yield Caption("bench file")
                yield Field(self.desk.bench, id="bench", placeholder="name or path", compact=True)
            yield Words("searching this machine for instruments", id="search")
            yield Words("", id="answer")

    def __init__(self) -> None:
        super().__init__()
        self._found: Sequence[tuple[str, str]] = ()
        self._hidden = f"sim:?hidden={secrets.randbelow(_SECRETS)}"
        self._limits = ""

    def on_mount(self) -> None:
        """Search beside the screen."""
        super().on_mount()
        self.query_one("#found").focus()
        self.action_find()
        self._read_bench(self.desk.bench)

    def arrive(self) -> None:
        """The address may have come with a session that is to be resumed."""
        self.query_one("#url", Field).value = self.desk.url
        self.query_one("#bench", Field).value = self.desk.bench
        self._list()

    def unread(self) -> str:
        """An address or a bench file that was typed and not taken."""
        desk = self.desk
        if self.query_one("#bench", Field).value.strip() != desk.bench:
            return "the bench file was typed but not read: press Enter on it"
        if self.query_one("#url", Field).value.strip() != desk.url:
            return "the address was typed but not connected: press Enter on it"
        return ""

    def listed(self, message: InstrumentsListed) -> None:
        """Show what was found."""
        self._found = message.found
        self._list()
        count = len(message.found)
        words = [f"{count} found on this machine" if count else "none found on this machine"]
        self.query_one("#search", Words).update("; ".join([*words, *message.notes]))

    def _list(self) -> None:
        """The simulated ones, those that were found, and the one that a session brought."""
        options = self.query_one("#found", Choices)
        kept = options.highlighted
        kept_id = None if kept is None else options.get_option_at_index(kept).id
        options.clear_options()
        options.add_options(self._options(self._found))
        ids = [option.id for option in options.options]
        wanted = self.desk.url if self.desk.resume is not None else kept_id
        options.highlighted = ids.index(wanted) if wanted in ids else 0

    def show_body(self) -> None:
        """Who answered, or why nobody did."""
        desk = self.desk
        lines: list[str] = []
        if self.bench.keeper.busy and not desk.run.live:
            lines = [f"connecting to {desk.url} ..."]
        elif desk.identity is not None:
            who = desk.identity
            lines = [
                f"CONNECTED to {desk.url}" + (", SIMULATED" if who.simulated else ""),
                f"{who.maker} {who.model}, serial {who.serial}, revision {who.revision or '-'}",
                f"options: {', '.join(who.options) or 'none'}",
                desk.run.source_text,
            ]
        elif desk.link_fault:
            lines = ["NOT CONNECTED", desk.link_fault, "", *_REMEDIES]
        lines += ["", self._limits] if lines else [self._limits]
        self.query_one("#answer", Words).update("\n".join(lines))

    def hint(self) -> str:
        """Connect, then check."""
        if self.desk.identity is not None:
            return "Connected.  Ctrl+N: on to the checks"
        if self.typing_into is not None:
            return f"Typing: {self.typing_into}.  Enter takes it.  Esc leaves the field"
        return "Arrows and Enter: connect one of these; or Tab, type an address, Enter"

    def copy_text(self) -> str:
        """What the instrument said, or the fault."""
        return str(self.query_one("#answer", Words).content)

    def on_option_list_option_selected(self, event: Choices.OptionSelected) -> None:
        """Connect what was chosen."""
        if event.option.id is not None:
            self.query_one("#url", Field).value = event.option.id
            self.action_connect()

    def on_input_submitted(self, event: Field.Submitted) -> None:
        """Connect what was typed, or read the bench file."""
        if event.input.id == "bench":
            self._read_bench(event.value.strip())
        else:
            self.action_connect()

    def action_connect(self) -> None:
        """Ask who is there."""
        desk, bench = self.desk, self.bench
        if bench.keeper.busy:
            self.notify("the instrument is in use; stop it first", severity="warning")
            return
        desk.url = self.query_one("#url", Field).value.strip()
        desk.identity, desk.link_fault = None, ""
        bench.keeper.look()
        # A digit that is pressed next is meant for a step.
        self.query_one("#found").focus()
        self.show()

    def _read_bench(self, name: str) -> None:
        """Read a bench file beside the screen; the one before stays where it cannot be used."""
        from daq.limits import load_bench

        if self.bench.keeper.busy and name != self.desk.bench:
            self.notify("a session is under way; its bench stays", severity="warning")
            return

        def take(place: Bench) -> None:
            if name != self.desk.bench:
                self.desk.bench = name
                self.query_one("#found").focus()
            bounds = place.limits
            self._limits = (
                f"bench {visible_line(place.name)}: up to {bounds.source_vpk:g} V peak, "
                f"{bounds.start_hz:g} to {bounds.stop_hz:g} Hz"
            )
            self.show()

        def refuse(error: LashbenchError) -> None:
            self.bench.show_error("The bench file cannot be used", error)

        self.bench.beside.do("bench", partial(load_bench, name), take, "No bench", refuse)

    def action_find(self) -> None:
        """Search once more."""
        self.bench.find_instruments()

    def _options(self, found: Sequence[tuple[str, str]]) -> list[Option]:
        # An address that two searches found is listed once.
        hidden = (self._hidden, "simulated bench that hides a cause")
        places = dict([*_SIMULATED, hidden, *found])
        if self.desk.resume is not None and self.desk.url not in places:
            places[self.desk.url] = f"of measurement {self.desk.resume}"
        return [choice(f"{words}:  {url}", url) for url, words in places.items()]
