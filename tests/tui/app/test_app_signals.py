"""The screens on a real terminal: ended by a signal, frozen, gone, left with a source not off."""

import asyncio
import os
import pty
import select
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress

import pytest
from outputs.screen import LONG, begun, operated, run, sweeping

from daq.analyser import SourceState
from daq.errors import LashbenchError
from daq.store import Store

PROGRAM = """
import sys
from pathlib import Path
import daq.hp35670a.analyser
import daq.hp35670a.safe
from daq.hp35670a.setup import Timing
from tui.app.application import BenchApp
from tui.measure_options import PlanOptions

# Whoever is silent is waited for less long than at a bench; whoever answers may take his time,
# on a machine that is busy with other tests.
if "silence" in sys.argv[2]:
    daq.hp35670a.analyser.Timing = lambda: Timing(reply_s=0.5, block_s=1.0, overhead_s=3.0)
    daq.hp35670a.safe._BUDGET_S = 2.0

class Driven(BenchApp):
    def on_mount(self):
        super().on_mount()
        self.desk.choose_unit("adss")
        self.desk.url = sys.argv[2]
        self.desk.options = PlanOptions((2.0,), 120.0, 160.0, 2500, None, None, 4, 4)
        assert self.keeper.start(hold=False)
        if len(sys.argv) > 3:
            self.set_interval(0.05, lambda: self.desk.run.done < int(sys.argv[3]) or self.exit(0))

app = Driven(Path(sys.argv[1]), find=lambda post: None)
code = app.run()
sys.exit(code if code is not None else app.return_code or 0)
"""

CROWDED = PROGRAM.replace("        assert self.keeper.start(hold=False)\n", "").replace(
    "app = Driven",
    """
class Driven(Driven):
    drawn = 0

    def on_mount(self):
        # Not while the first step looks for a history, which the session is about to make.
        self.set_timer(0.5, lambda: self.keeper.start(hold=False))
        self.set_interval(0.02, self.draw)

    def draw(self):
        if self.drawn == 0 and self.desk.run.done > 0:
            self.go(4)
        if Path(sys.argv[1] + "-crowd").exists():
            self.screen.refresh()
            self.drawn += 1
            if self.drawn == 100:
                self.go(1)

app = Driven""",
)
"""Draws all of the screen again and again while a file is there, and another step after a while."""

STUCK = PROGRAM.replace(
    "app = Driven",
    """
import time

class Driven(Driven):
    def on_ready(self):
        self.set_interval(0.05, self.hold)

    def hold(self):
        if self.desk.run.done > 2:
            # As long as nothing else says so, the event loop stands still.
            Path(sys.argv[1] + "-stuck").touch()
            time.sleep(120.0)

app = Driven""",
)
"""A screen whose event loop stands still while it measures."""

REPLAY = """
import sys
from pathlib import Path
from tui.app.state.recording import read_recording
from tui.app.state.replay import ReplayApp
sys.exit(ReplayApp(read_recording(Path(sys.argv[1]), None)).run() or 0)
"""

SLOW = "sim:?ratio=0.3&seed=1&speed=realtime"


@pytest.fixture
def on_terminal():
    """Start the program on a terminal of its own, whose screen somebody reads."""
    started = []

    def start(*words, program=PROGRAM):
        started.append(OnTerminal(program, *words))
        return started[-1]

    yield start
    for one in started:
        one.program.kill()
        one.ended()


class OnTerminal:
    """The program, in a session that the terminal sends no signals to, and what it drew."""

    def __init__(self, program, *words):
        self._ours, theirs = pty.openpty()
        self.program = subprocess.Popen(
            [sys.executable, "-c", program, *words],
            stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
        )  # fmt: skip
        os.close(theirs)
        self.seen = b""
        self._looks = threading.Event()
        self.look()

    def look(self):
        self._looks.set()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def look_away(self):
        self._looks.clear()
        self._reader.join()

    def press(self, keys):
        os.write(self._ours, keys)

    def go_away(self):
        self.look_away()
        os.close(self._ours)

    def _read(self):
        while self._looks.is_set():
            # One that waits in a read would keep the terminal open when it is closed.
            if not select.select([self._ours], [], [], 0.05)[0]:
                continue
            try:
                some = os.read(self._ours, 65536)
            except OSError:
                return
            if not some:
                return
            self.seen += some

    def sees(self, words, within_s=20.0):
        end = time.monotonic() + within_s
        while words not in self.seen:
            assert time.monotonic() < end, self.seen[-2000:]
            time.sleep(0.05)

    def ended(self, within_s=60.0):
        code = self.program.wait(within_s)
        self._reader.join(5.0)
        return code

    def ends_by_signal(self):
        """Check that it was interrupted; else show what its screen said last."""
        code = self.ended()
        assert code == 130, (code, self.seen[-3000:])


def driving(db, within_s=40.0):
    """Wait until a session in a history has points."""
    end = time.monotonic() + within_s
    while True:
        # Until the session has made it there is no history to read.
        with suppress(LashbenchError), Store(db, read_only=True) as store:
            if any(m.points > 2 for m in store.measurements()):
                return
        assert time.monotonic() < end, "no session began"
        time.sleep(0.05)


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGHUP, marks=pytest.mark.long)]
)
def test_signal_ends_screen_with_source_off(tmp_path, on_terminal, number):
    db = tmp_path / "bench.db"
    terminal = on_terminal(str(db), "sim:?ratio=0.3&seed=1")
    driving(db)
    terminal.program.send_signal(number)
    terminal.ends_by_signal()
    assert begun(db).state == "interrupted"
    assert begun(db).source_state is SourceState.CONFIRMED_OFF


def test_failed_switch_off_is_reported_after_screen(tmp_path, on_terminal):
    """The message follows when a signal has ended the screen."""
    db = tmp_path / "bench.db"
    terminal = on_terminal(str(db), "sim:?fault=silence:point=5")
    driving(db)
    terminal.program.send_signal(signal.SIGTERM)
    assert terminal.ended() == 1
    assert begun(db).source_state is SourceState.UNKNOWN
    assert b"error: SOURCE UNKNOWN: switch it off by hand" in terminal.seen.splitlines()[-1]


def test_quitting_first_reports_failed_switch_off(tmp_path, monkeypatch):
    monkeypatch.setattr("daq.hp35670a.safe._BUDGET_S", 2.0)
    db = tmp_path / "bench.db"

    async def way():
        async with operated(db) as op:
            await sweeping(op, "sim:?fault=silence:point=5", **LONG)
            await op.press("ctrl+q")
            await op.sees("Quit?")
            await op.press("y")
            await op.sees("SWITCH THE SOURCE OFF BY HAND", within_s=60.0)
            assert op.app.is_running
            await op.press("escape", "ctrl+q")
            while op.app.is_running:
                await asyncio.sleep(0.02)
            assert op.app.return_code == 1

    run(way)
    assert begun(db).source_state is SourceState.UNKNOWN


def test_lost_screen_ends_the_session(tmp_path, on_terminal):
    db = tmp_path / "bench.db"
    terminal = on_terminal(str(db), "sim:?ratio=0.3&seed=1", "3")
    assert terminal.ended() == 0, terminal.seen[-2000:]
    assert begun(db).state == "interrupted"
    assert begun(db).source_state is SourceState.CONFIRMED_OFF
    assert begun(db).points < 2500


def test_lost_terminal_without_signal_ends_session(tmp_path, on_terminal):
    db = tmp_path / "bench.db"
    terminal = on_terminal(str(db), "sim:?ratio=0.3&seed=1")
    driving(db)
    terminal.go_away()
    terminal.ends_by_signal()
    assert begun(db).state == "interrupted"
    assert begun(db).source_state is SourceState.CONFIRMED_OFF
    replay = on_terminal(str(db), program=REPLAY)
    replay.sees(b"REPLAY, no instrument")
    replay.go_away()
    replay.ends_by_signal()


def test_lost_terminal_with_source_on_exits_1(tmp_path, on_terminal):
    db = tmp_path / "bench.db"
    terminal = on_terminal(str(db), "sim:?fault=silence:point=5")
    driving(db)
    terminal.go_away()
    assert terminal.ended() == 1
    assert begun(db).source_state is SourceState.UNKNOWN


@pytest.mark.slow
def test_blocked_terminal_delays_no_signal_and_redraws(tmp_path, on_terminal):
    db, crowd = tmp_path / "bench.db", tmp_path / "bench.db-crowd"
    terminal = on_terminal(str(db), SLOW, program=CROWDED)
    driving(db)
    terminal.sees(b"[4 Sweep]")
    for told_to_end in (False, True):
        terminal.look_away()
        terminal.seen = b""
        crowd.touch()
        time.sleep(2.5)
        crowd.unlink()
        if not told_to_end:
            terminal.look()
            terminal.sees(b"Unit under test")
    terminal.program.send_signal(signal.SIGTERM)
    terminal.ends_by_signal()
    assert begun(db).source_state is SourceState.CONFIRMED_OFF


@pytest.mark.slow
@pytest.mark.parametrize("way", ["ctrl+x", pytest.param("SIGTERM", marks=pytest.mark.long)])
def test_source_stops_whatever_the_event_loop_does(tmp_path, on_terminal, way):
    db, stuck = tmp_path / "bench.db", tmp_path / "bench.db-stuck"
    terminal = on_terminal(str(db), SLOW, program=STUCK)
    driving(db, within_s=90.0)
    end = time.monotonic() + 20
    while not stuck.exists():
        assert time.monotonic() < end
        time.sleep(0.02)
    if way == "ctrl+x":
        terminal.press(b"\x18")
    else:
        terminal.program.send_signal(signal.SIGTERM)
    end = time.monotonic() + 20
    while begun(db).source_state is not SourceState.CONFIRMED_OFF:
        assert time.monotonic() < end, "the source is not off"
        time.sleep(0.02)
    assert terminal.program.poll() is None
    assert begun(db).points < 2500
