"""The screen of a production line: scan, sweep, judge, next; stopped, killed and gone on with."""

import asyncio
import os
import pty
import signal
import subprocess
import sys
from contextlib import asynccontextmanager

import pytest
from instruments.line_bench import BAD, GOOD, line_bench, wait_until
from outputs.screen import Operator

from sim.unit import load_unit
from tui import cli
from tui.app.line.letters import large
from tui.app.line.screen import LineApp
from tui.judging import limits_to_judge_by
from tui.line.results import Results
from tui.line.unit import Line
from tui.text.output import Console


@pytest.fixture
def bench(tmp_path):
    with line_bench(tmp_path) as found:
        yield found


@asynccontextmanager
async def at_the_line(bench, size=(80, 24), db=None):
    """The screen with what `lashbench line --screen` gives it."""
    results = Results(bench.out)
    belt = Line(
        "adss", load_unit("adss"), bench.address, str(bench.folder / "recipe.toml"), "default",
        False, "Ada", db or bench.db, limits_to_judge_by(str(bench.folder / "limits.toml")), False,
        bench.out, Console(),
    )  # fmt: skip
    app = LineApp(belt, results, None, "ask")
    async with app.run_test(size=size) as pilot:
        yield Operator(app, pilot)
        await app.action_quit()


async def scans(op, text):
    op.app.query_one("#line").value = text
    await op.press("enter")


def test_units_are_judged_in_large_letters(bench):
    async def way():
        async with at_the_line(bench) as op:
            screen = await op.sees("scan a serial number", "no unit yet")
            assert large("READY", 76).splitlines()[0].strip() in screen
            bench.unit.inertia = GOOD
            await scans(op, "]C1SN 1\t")
            screen = await op.sees("1 PASS", "SN 1: #1", within_s=120.0)
            assert large("PASS", 76).splitlines()[2].strip() in screen
            assert "SOURCE OFF (confirmed)" in screen
            bench.unit.inertia = BAD
            await scans(op, "SN 2")
            screen = await op.sees("1 PASS, 1 FAIL", "yield 1/2 (50 %)", within_s=120.0)
            assert large("FAIL", 76).splitlines()[2].strip() in screen
            assert "ARF" in screen
            await scans(op, "SN 2")
            await op.sees("measure it again as a retest?")
            bench.unit.inertia = GOOD
            await scans(op, "y")
            await op.sees("2 PASS; 1 retests", "retest 1", within_s=120.0)
            await scans(op, "SN\u202e\x07 3")
            await op.sees("error: serial number")
            await scans(op, ".")

    asyncio.run(way())
    assert [(r["serial"], r["verdict"]) for r in bench.results()] == [
        ("SN 1", "PASS"), ("SN 2", "FAIL"), ("SN 2", "PASS"),
    ]  # fmt: skip
    assert not bench.drives


def test_stopped_unit_is_not_judged_but_resumed(bench):
    async def way():
        async with at_the_line(bench, (140, 40)) as op:
            bench.unit.wait_s = 0.5
            await scans(op, "SN 1")
            await op.sees("SOURCE ON", "of 21 points", within_s=120.0)
            while bench.points(1) <= 2:
                await op.pilot.pause(0.02)
            await op.press("ctrl+x")
            screen = await op.sees("Enter goes on", "SOURCE OFF (confirmed)", within_s=60.0)
            assert large("STOPPED", 136).splitlines()[2].strip() in screen
            assert not bench.drives
            bench.unit.wait_s = 0.0
            await scans(op, "")
            await op.sees("If it is on the bench")
            await scans(op, "")
            await op.sees("1 PASS", within_s=120.0)

    asyncio.run(way())
    (result,) = bench.results()
    assert (result["serial"], result["measurement"]) == ("SN 1", 1)
    assert bench.points(1) == 21


def test_killed_screen_judges_every_unit_once(bench):
    words = [*bench.words("--out", bench.out, "--screen")]
    near, far = pty.openpty()
    bench.unit.wait_s = 0.5
    with subprocess.Popen(
        [sys.executable, "-m", "tui.cli", *map(str, words)], stdin=far, stdout=far, stderr=far,
        env=os.environ | {"TERM": "xterm-256color", "COLUMNS": "80", "LINES": "24"},
    ) as process:  # fmt: skip
        os.set_blocking(near, False)

        def drained_until_swept():
            _read(near)
            return bench.points(1) > 2

        try:
            wait_until(lambda: _read(near), 60.0)
            os.write(near, b"SN 1\r")
            wait_until(drained_until_swept, 60.0)
        finally:
            os.kill(process.pid, signal.SIGKILL)
    os.close(near)
    os.close(far)
    assert bench.points(1) < 21
    bench.unit.wait_s = 0.0
    wait_until(lambda: not bench.drives, 60.0)

    async def way():
        async with at_the_line(bench) as op:
            await op.sees("SN 1 is not finished", within_s=60.0)
            await scans(op, "")
            await op.sees("1 PASS", within_s=120.0)
            await scans(op, "SN 1")
            await op.sees("done already, it was gone on with")

    asyncio.run(way())
    (result,) = bench.results()
    assert (result["serial"], result["verdict"], result["measurement"]) == ("SN 1", "PASS", 1)
    assert bench.points(1) == 21


def _read(terminal):
    """Whether the screen is there: it asks for what is typed."""
    try:
        return b"scan" in os.read(terminal, 1 << 16)
    except BlockingIOError:
        return False


def test_missing_terminal_is_reported_and_nothing_driven(bench, capsys):
    assert cli.main(list(map(str, bench.words("--screen")))) == 2
    assert "needs a terminal" in capsys.readouterr().err
    assert bench.measurements() == 0


@pytest.mark.parametrize("columns", [4, 20, 76, 136, 196])
def test_large_letters_fit(columns):
    for word in ("READY", "SWEEP", "PASS", "FAIL", "UNDECIDED", "MEASURED", "STOPPED", "FAULT"):
        rows = large(word, columns).splitlines()
        assert len(rows) in (1, 5)
        assert all(len(row) <= columns for row in rows) or rows == [word]
        assert "?" not in "".join(rows)
