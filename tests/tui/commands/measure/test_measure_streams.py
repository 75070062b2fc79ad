"""A measurement whose terminal takes no more, or whose reader left: it ends as it would have."""

import json
import os
import pty
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress

import pytest

from daq.analyser import SourceState
from daq.errors import LashbenchError
from daq.store import Store
from tui.text.narrator import Narrator

POINTS = 500
"""Lines of progress that more than fill a terminal's buffer, which is full after some 350."""


@contextmanager
def measuring(db, *words, points, instrument="sim:", **streams):
    program = subprocess.Popen(
        [
            sys.executable, "-m", "tui.cli", "measure", "--unit", "adss",
            "--instrument", instrument, "--level", "2", "--start", "200", "--stop", "450",
            "--points", str(points), "--settle-cycles", "2", "--integrate-cycles", "2",
            "--db", str(db), *words,
        ],
        **streams,
    )  # fmt: skip
    try:
        yield program
    finally:
        program.kill()
        program.communicate()


@pytest.fixture
def stalled():
    """A terminal that nobody reads."""
    ours, theirs = pty.openpty()
    yield theirs
    os.close(ours)
    with suppress(OSError):
        os.close(theirs)


def test_blocked_terminal_delays_neither_session_nor_signal(tmp_path, stalled):
    db, out = tmp_path / "bench.db", tmp_path / "out.json"
    with (
        out.open("w") as file,
        measuring(db, "--json", points=4000, stdout=file, stderr=stalled) as program,
    ):
        end = time.monotonic() + 60.0
        while True:
            # Until the session has made it there is no history to read.
            with suppress(LashbenchError), Store(db, read_only=True) as store:
                if any(m.points > POINTS for m in store.measurements()):
                    break
            assert time.monotonic() < end, "the session stands still"
            time.sleep(0.05)
        program.send_signal(signal.SIGTERM)
        assert program.wait(30.0) == 130
    document = json.loads(out.read_text())
    assert (document["state"], document["source_state"]) == ("interrupted", "confirmed-off")
    with Store(db, read_only=True) as store:
        assert store.measurement(document["id"]).source_state is SourceState.CONFIRMED_OFF


@pytest.mark.parametrize("words", [pytest.param((), marks=pytest.mark.long), ("--json",)])
def test_closed_stdout_does_not_hide_error(tmp_path, words):
    reading, writing = os.pipe()
    os.close(reading)
    with measuring(
        tmp_path / "bench.db", *words,
        points=20, instrument="sim:?fault=dropped-connection:point=3",
        stdout=writing, stderr=subprocess.PIPE, text=True,
    ) as program:  # fmt: skip
        os.close(writing)
        said = program.stderr.read()
        assert program.wait(60.0) == 3
    assert "SOURCE OFF UNKNOWN: switch it off by hand" in said.splitlines()[-1]


def test_messages_keep_order_and_progress_may_drop(stalled):
    reading, writing = os.pipe()
    with os.fdopen(writing, "w") as stream:
        before = set(threading.enumerate())
        narrator = Narrator(stream)
        (writer,) = set(threading.enumerate()) - before
        for number in range(100):
            narrator.say(f"{number}\n")
        assert narrator.has_said_all(5.0)
        narrator.end()
        writer.join(5.0)
        assert not writer.is_alive()
    with os.fdopen(reading) as written:
        assert written.read().split() == [str(number) for number in range(100)]
    with os.fdopen(os.dup(stalled), "w") as stream:
        narrator = Narrator(stream)
        began = time.monotonic()
        for _ in range(100):
            narrator.say("x" * 4096)
        assert not narrator.say("left out", fleeting=True)
        assert not narrator.has_said_all(0.1)
        assert time.monotonic() - began < 5.0
