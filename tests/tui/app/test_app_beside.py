"""Nothing that the screens read holds a key up: no file is opened in the event loop."""

import os
import sys
import threading
import time
from contextlib import contextmanager
from types import SimpleNamespace

import pytest
from outputs.screen import operated, run

from daq.configs import config_path
from tui.app.state.background import Beside
from tui.cli import main

SHORT = ["--settle-cycles", "3", "--integrate-cycles", "3", "--serial", "SN 7"]
BAND = ["--level", "2.5", "--start", "120", "--stop", "160", "--points", "9"]

_watched = SimpleNamespace(folder=None, thread=0, opened=[])


def _audit(event, details):
    if _watched.folder is None or event not in ("open", "sqlite3.connect", "os.listdir"):
        return
    place = os.fsdecode(details[0]) if isinstance(details[0], str | bytes | os.PathLike) else ""
    if _watched.folder in place:
        _watched.opened.append((threading.get_ident() == _watched.thread, event, place))


@contextmanager
def watching(folder):
    """What is opened below a folder, and whether by this thread."""
    if not getattr(_watched, "hooked", False):
        sys.addaudithook(_audit)
        _watched.hooked = True
    _watched.opened, _watched.thread = [], threading.get_ident()
    _watched.folder = str(folder)
    try:
        yield _watched
    finally:
        _watched.folder = None


@pytest.fixture
def db(tmp_path):
    """Two complete sessions."""
    path = tmp_path / "bench.db"
    words = ["measure", "--unit", "adss", "--db", str(path), *BAND, *SHORT]
    for seed in (1, 2):
        assert main([*words, "--instrument", f"sim:?seed={seed}"]) == 0
    return path


def test_event_loop_opens_no_bench_file(db, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    unit = tmp_path / "own.toml"
    unit.write_text(config_path("units", "adss").read_text())

    async def way():
        with watching(tmp_path) as watched:
            async with operated(db, (120, 40), log=tmp_path / "lashbench.log") as op:
                await op.sees("Sessions of this bench", "complete")
                await op.press("7")
                await op.sees("[7 Report]", "9/9")
                await op.press("u", "space", "down", "space", "o")
                await op.sees("\u25cf #2  \u25a0 #1")
                await op.press("enter")
                await op.sees("[5 Result]", "r = 0.310")
                await op.press("ctrl+y")
                await op.sees("copied; also in")
                await op.press("7", "w")
                await op.sees("REPORT:")
                await op.press("1")
                await op.sees("[1 Unit]")
                await op.types("#file", str(unit))
                await op.press("enter")
                await op.sees("own.toml")
                await op.connects("sim:")
                await op.plans()
                await op.checks()
                await op.press("ctrl+n", "l", "s")
                await op.sees("16 of 16 points stored; complete")
                await op.press("left", "b", "right", "b")
                await op.sees("Measure the band again?")
                await op.press("b")
                await op.sees("16 of 16 points stored; complete")
            opened = list(watched.opened)
        assert {event for _, event, _ in opened} >= {"open", "sqlite3.connect"}
        assert [place for in_loop, _, place in opened if in_loop] == []

    run(way)


def test_similar_work_runs_one_at_a_time():
    """Of requests that wait, the latest counts."""
    told, shown, errors, begun, may_end = [], [], [], [], threading.Event()
    app = SimpleNamespace(
        post_message=told.append, show_error=lambda title, error: errors.append((title, error))
    )
    beside = Beside(app)

    def work(number):
        def go():
            begun.append(number)
            assert may_end.wait(10.0)
            if number == 4:
                raise ValueError("by design")
            return number

        return go

    def next_told():
        end = time.monotonic() + 10
        while not told:
            assert time.monotonic() < end
            time.sleep(0.005)
        beside.done(told.pop())

    for number in (1, 2, 3):
        beside.do("read", work(number), shown.append, "not read")
    assert beside.is_under_way("read")
    may_end.set()
    next_told()
    assert (begun[0], shown) == (1, [])
    next_told()
    assert (begun, shown) == ([1, 3], [3])
    assert not beside.is_under_way("read")
    beside.do("read", work(4), shown.append, "not read")
    next_told()
    ((title, error),) = errors
    assert (title, str(error), shown) == ("not read", "by design", [3])
