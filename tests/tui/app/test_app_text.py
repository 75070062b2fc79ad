"""What others wrote is plain text on every screen: no markup, no action, nothing unseen."""

import asyncio
import re
import unicodedata

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from outputs.screen import DIAGNOSIS, ESTIMATE, Diagnosed, operated, quick_analyses, run, text_of

from daq.analyser import Identity, SourceState, SweepPoint
from daq.errors import AnalysisError, InputError, LinkError
from daq.frf import PointFlag
from daq.plan import SweepPlan
from daq.session_events import CheckLine, Finished, Warned
from daq.store import Store
from daq.store_records import MeasurementHeader
from daq.untrusted.visible_text import visible, visible_line
from tui.app import messages
from tui.app.state.recording import read_recording
from tui.app.state.replay import ReplayApp
from tui.app.terminal_app import TerminalApp
from tui.app.widgets.plain import Caption, Choices, Field, Passage, Push, Table, Words, choice
from tui.cli import main

HOSTILE = "[/x][proto]:boom:\u202e\x1b]0;t\x07[@click=app.bell]go[/]"
SHOWN = visible(HOSTILE)
SHORT = "[/x][proto]\u202e\x1b[2J"
SIZES = [(80, 24), (138, 40)]


def hostile_history(path):
    """A history as another program may leave it: every text of others is hostile."""
    plan = SweepPlan((120.0, 130.0, 140.0), (2.5,))
    with Store(path, create=True) as store:
        for complete in (True, False):
            header = MeasurementHeader(
                HOSTILE, HOSTILE, plan, HOSTILE, HOSTILE, HOSTILE, HOSTILE,
                {"unit": unit_text(), HOSTILE: HOSTILE},
            )  # fmt: skip
            number = store.begin(header)
            store.set_instrument(number, Identity(HOSTILE, HOSTILE, HOSTILE, HOSTILE, (HOSTILE,)))
            store.note(number, HOSTILE, HOSTILE)
            for hertz in plan.frequencies_hz:
                store.add_point(
                    number, 2.5, hertz, SweepPoint(hertz, 0.1 + 0j, 0.1, 0.1, PointFlag(0))
                )
            state = "complete" if complete else "interrupted"
            store.finish(number, state, SourceState.CONFIRMED_OFF)
        store.add_estimate(1, HOSTILE, ESTIMATE | {"warnings": [HOSTILE]})
    return path


def unit_text():
    from daq.configs import config_path

    text = config_path("units", "adss").read_text()
    name = HOSTILE.translate({0x1B: "\\u001b", 0x07: "\\u0007"})
    return re.sub(r"(?m)^name = .*$", lambda _: f'name = "{name}"', text, count=1)


def seen_whole(screen):
    """Nothing on a screen tells a terminal anything, and nothing is hidden."""
    strange = {c for c in screen if unicodedata.category(c) in ("Cc", "Cf", "Cs") and c != "\n"}
    assert not strange, strange
    assert "boom:" in screen or "boom" not in screen
    return "".join(line.strip() for line in screen.replace("│", " ").splitlines())


async def holds(op, words=SHOWN, within_s=20.0):
    """Wait until the words stand on the screen, however they are broken into lines."""
    for _ in range(int(within_s / 0.05)):
        if words.replace(" ", "") in seen_whole(op.screen).replace(" ", ""):
            return
        await op.pilot.pause(0.05)
    raise AssertionError(f"{words!r} is not on the screen:\n{op.screen}")


@pytest.mark.parametrize(
    "size",
    [pytest.param(SIZES[0], marks=pytest.mark.long), SIZES[1]],
    ids=lambda size: f"{size[0]}x{size[1]}",
)
def test_hostile_history_is_plain_text_on_screens(tmp_path, monkeypatch, size):
    folder = tmp_path / "[b]bench[/x]"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    db = hostile_history(folder / "a[]b[b].db")
    short = SHOWN[: 12 if size[0] < 100 else len(SHOWN)]

    async def way():
        analyses = quick_analyses(
            estimate=lambda response, unit, progress: ESTIMATE | {"warnings": [HOSTILE]},
            diagnose=lambda responses, unit, progress: Diagnosed(
                DIAGNOSIS | {"warnings": [HOSTILE], "shape": HOSTILE}
            ),
        )
        async with operated(db, size, analyses=analyses) as op:
            await holds(op, "RESUME")
            await holds(op, short)
            await op.press("enter")
            await holds(op, "going on with measurement 2")
            assert op.app.desk.serial == HOSTILE
            await holds(op, SHOWN[:20])
            await op.goes_to(1)
            await holds(op, "session 2 keeps them")
            op.app.screen.query_one("#sessions").focus()
            await op.press("down", "enter")
            await op.sees("[5 Result]", "r = 0.310")
            assert f"warning: {SHOWN}" in visible(op.app.screen.copy_text())
            if size[0] > 100:
                await holds(op, f"warning: {SHOWN}")
            await op.press("ctrl+n", "d")
            await op.sees("VERDICT")
            if size[0] > 100:
                await holds(op, f"left by the plain model: {SHOWN}")
            await op.press("ctrl+n")
            await holds(op, short)
            await op.press("w")
            await holds(op, "[b]bench[/x]")

    run(way)
    with Store(db, read_only=True) as store:
        assert {m.header.serial for m in store.measurements()} == {HOSTILE}


def test_hostile_messages_are_plain_text(tmp_path):
    """Of the instrument, the session and the analyses."""

    async def way():
        async with operated(tmp_path / "bench.db", (138, 40)) as op:
            post = op.app.post_message
            await op.goes_to(2)
            post(messages.InstrumentsListed([(f"/dev/{HOSTILE}", HOSTILE)], [HOSTILE]))
            await holds(op, f"{SHOWN}: /dev/{SHOWN}")
            await holds(op, f"1 found on this machine; {SHOWN}")
            post(messages.InstrumentFailed("url", LinkError(HOSTILE)))
            await holds(op, f"NOT CONNECTED{SHOWN}")
            op.app.desk.url = HOSTILE
            who = Identity(HOSTILE, "model", "serial", "A", (HOSTILE,))
            post(messages.InstrumentFound(HOSTILE, who, SourceState.CONFIRMED_OFF))
            await holds(op, f"CONNECTED to {SHOWN}")
            await holds(op, f"options: {SHOWN}")
            op.app.desk.url = "sim:"
            op.app.screen.query_one("#url").value = "sim:"
            await op.goes_to(3)
            post(messages.SessionTold(CheckLine(HOSTILE, "note", HOSTILE)))
            post(messages.SessionTold(Warned(HOSTILE)))
            await holds(op, f"[note] {SHOWN}: {SHOWN}")
            ended = Finished(1, "interrupted", SourceState.UNCONFIRMED, 0, 0, 1.0, HOSTILE)
            post(messages.SessionTold(ended))
            post(messages.SessionEnded(InputError(HOSTILE)))
            await holds(op, f"The session ended ({SHOWN})")
            await op.press("escape")
            await holds(op, f"[interrupted] {SHOWN}")
            op.app.desk.measurement = 1
            post(messages.AnalysisFailed("result", 1, AnalysisError(SHORT)))
            await holds(op, f"result: {visible(SHORT)}")
            op.app.show_error(HOSTILE, InputError(HOSTILE))
            await holds(op, f"{SHOWN}{SHOWN}")
            await op.press("escape")
            op.app.screen.notify(f"of {SHORT}", title=SHORT, markup=True)
            await holds(op, f"of {visible(SHORT)}")

    run(way)


def test_hostile_replay_is_plain_text(tmp_path):
    recording = read_recording(hostile_history(tmp_path / "bench.db"), 1)

    async def way():
        app = ReplayApp(recording)
        async with app.run_test(size=(160, 40)) as pilot:
            await pilot.pause(0.2)
            shown = seen_whole(text_of(app)).replace(" ", "")
            assert SHOWN in shown
            assert f"{SHOWN}:{SHOWN}" in shown

    asyncio.run(way())


def test_markup_in_file_name_is_shown_literally(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db", (138, 40)) as op:
            await op.types("#file", f"/no/{HOSTILE}.toml")
            await op.press("enter")
            await holds(op, "The unit file cannot be used")
            seen_whole(op.screen)
            assert "[proto]:boom:" in op.screen

    run(way)


class Shown(TerminalApp):
    """Every widget that shows text, holding the same."""

    def __init__(self, text):
        super().__init__()
        self.text = text

    def compose(self):
        yield Words(self.text)
        yield Caption(self.text)
        yield Push(self.text)
        yield Choices(choice(self.text, "one"))
        yield Table()
        yield Passage(self.text)
        yield Field(self.text)

    def on_mount(self):
        table = self.query_one(Table)
        table.add_columns(self.text)
        table.add_row(self.text, key="one")
        self.query_one(Words).update(self.text)


_PIECES = st.sampled_from(
    ["[", "]", "[/", "[b]", "[/b]", "[@click=app.bell]", "[link=x]", "\\[", "$x", ":boom:", "=",
     "\u202e", "\u2066", "\u200b", "\x1b[2J", "\x9b", "\x07", "\ud800", "\ufe0f", "a", "&", "<b>"]
)  # fmt: skip


@settings(max_examples=10, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.lists(_PIECES, min_size=1, max_size=9).map("".join))
def test_every_widget_shows_text_literally(text):
    async def way():
        app = Shown(text)
        async with app.run_test(size=(120, 40)) as pilot:
            await pilot.pause()
            screen = text_of(app)
            seen_whole(screen)
            # Not the field, where what is not seen has a stand-in of its own width.
            assert screen.count(visible_line(text)) >= 6, screen
            assert app.query_one(Field).value == text
            app.notify(text, title=text)
            await pilot.pause()
            assert text_of(app)

    asyncio.run(way())


def test_command_line_shows_invisible_characters(tmp_path, capsys):
    db = hostile_history(tmp_path / "bench.db")
    assert main(["history", "--db", str(db), "--estimate", "none"]) == 0
    assert main(["export", "1", "--db", str(db), "--out", str(tmp_path / f"{HOSTILE}.x")]) == 2
    said = "\n".join(capsys.readouterr())
    seen_whole(said)
    assert "[proto]:boom:\\u202e" in said.replace("\n", "")
