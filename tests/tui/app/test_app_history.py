"""The bench screen with sessions behind it: reference, trend, overlay, opening, the palette."""

import logging
import shlex
import shutil
from pathlib import Path

import pytest
from outputs.screen import ESTIMATE, operated, quick_analyses, run

from daq.store import Store
from tui.app.plot.traces import LEVEL_MARKS
from tui.app.state.analyses import Analyses
from tui.cli import main
from tui.logs import logging_to_file
from tui.measurements.stored_answers import keep_estimate
from tui.places import log_path

SHORT = ["--settle-cycles", "3", "--integrate-cycles", "3", "--serial", "SN 7"]
BAND = ["--level", "2.5", "--start", "120", "--stop", "160", "--points", "9"]


@pytest.fixture
def db(measured, tmp_path):
    """A copy for each test: what one keeps in it is not another's."""
    return Path(shutil.copy(measured, tmp_path / "bench.db"))


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Two complete sessions, the first of them estimated."""
    path = tmp_path_factory.mktemp("history") / "bench.db"
    words = ["measure", "--unit", "adss", "--db", str(path), *BAND, *SHORT]
    for seed in (1, 2):
        assert main([*words, "--instrument", f"sim:?seed={seed}"]) == 0
    with Store(path) as store:
        first = store.measurement(1)
    keep_estimate(path, first, ESTIMATE)
    return path


def test_trend_overlay_and_opening(db):
    asked = []

    def estimate(response, unit, progress):
        asked.append(unit.name)
        return ESTIMATE

    async def way():
        analyses = quick_analyses(estimate=estimate)
        async with operated(db, (120, 40), analyses=analyses) as op:
            await op.press("7")
            screen = await op.sees("[7 Report]", "0.31+-0.05", "oldest first")
            assert "ADSS SN 7 SIM." in screen
            await op.press("o")
            await op.sees("mark two sessions or more first")
            await op.press("space", "down", "space", "o")
            await op.sees("\u25cf #2  \u25a0 #1")
            await op.press("t")
            await op.sees("oldest first")
            await op.press("enter")
            await op.sees("[5 Result]", "measurement 1, SIMULATED", "r = 0.310")
            assert asked == []
            await op.press("7", "up", "enter")
            await op.sees("[5 Result]", "measurement 2, SIMULATED", "r = 0.310")
            assert asked == ["ADSS"]

    run(way)
    with Store(db, read_only=True) as store:
        assert set(store.latest_estimates()) == {1, 2}


def test_six_sessions_are_told_apart(tmp_path, monkeypatch):
    """Each has a mark in table and legend, the cursor reads all, F2 prints the same picture."""
    monkeypatch.chdir(tmp_path)
    db = tmp_path / "bench.db"
    words = ["measure", "--unit", "adss", "--db", str(db), "--level", "1.5", *BAND, *SHORT]
    for seed in range(7):
        assert main([*words, "--instrument", f"sim:?seed={seed}"]) == 0
    lines = []

    async def way():
        async with operated(db, (200, 60)) as op:
            await op.press("7")
            await op.sees("[7 Report]", "complete")
            await op.press(*["space", "down"] * 6, "space")
            await op.sees("6 sessions can be told apart")
            await op.press("o")
            legend = "  ".join(
                f"{mark} #{number}"
                for mark, number in zip(LEVEL_MARKS, range(7, 1, -1), strict=True)
            )
            screen = await op.sees(legend)
            table = [line[:4] for line in screen.splitlines() if "complete   " in line]
            assert [row.strip() for row in table] == [*LEVEL_MARKS, ""]
            plot = op.app.screen.query_one("#bode")
            assert len({trace.colour for trace in plot.traces}) == 6
            plot.focus()
            await op.press("left")
            await op.sees("cursor: 135.00 Hz #7 1.5 V:")
            assert plot.reading.count(" dB ") == 12
            op.app.screen.query_one("#sessions").focus()
            await op.press("up", "space")
            await op.sees("5 marked, O: overlay", "\u25bc #3\n")
            await op.press("f2")
            await op.sees("The same on the command line")
            lines.extend(op.app.screen.text.splitlines())

    run(way)
    (line,) = [one for one in lines if " plot " in one]
    assert line.startswith("lashbench plot 7 6 5 4 3 --db ")
    assert main(shlex.split(line)[1:]) == 0
    assert (tmp_path / "overlay-7-6-5-4-3.png").exists()


def test_trend_omits_estimate_of_remeasured_points(db):
    words = ["measure", "--unit", "adss", "--db", str(db), "--instrument", "sim:"]
    assert main([*words, "--resume", "1", "--remeasure", "100:200"]) == 0

    async def way():
        async with operated(db, (120, 40)) as op:
            await op.press("7")
            assert "0.31" not in await op.sees("[7 Report]", "no session is estimated yet")

    run(way)


def test_diagnosis_is_restored_after_restart(db):
    async def diagnosed():
        async with operated(db, (120, 40)) as op:
            await op.press("7", "down", "enter")
            await op.sees("[5 Result]", "measurement 1")
            await op.press("6", "d")
            assert "from the history" not in await op.sees("VERDICT: AMBIGUOUS")

    async def restarted():
        async with operated(db, (120, 40)) as op:
            await op.press("7", "down")
            await op.sees("#1: diagnosed ambiguous: load-inertia (0.55)", "open")
            await op.press("enter")
            await op.sees("[5 Result]", "measurement 1")
            await op.press("6")
            await op.sees("from the history, made 20", "VERDICT: AMBIGUOUS", "MEASURE THIS NEXT")

    run(diagnosed)
    run(restarted)
    words = ["measure", "--unit", "adss", "--db", str(db), "--instrument", "sim:"]
    assert main([*words, "--resume", "1", "--remeasure", "100:200"]) == 0

    async def measured_again():
        async with operated(db, (120, 40)) as op:
            await op.press("7", "down", "enter")
            await op.sees("[5 Result]", "measurement 1")
            await op.press("6")
            await op.sees("not diagnosed yet")

    run(measured_again)


def test_correction_is_stored_with_its_trail(db):
    async def way():
        async with operated(db) as op:
            await op.press("7", "down", "c")
            await op.sees("Correct measurement 1", "corrected by")
            await op.types("#correct-serial", "SN 8")
            await op.press("enter")
            await op.sees("say who corrects it")
            await op.types("#correct-person", "Ada")
            await op.press("enter")
            await op.sees("ADSS SN 8, complete, 9 points, SIMULATED")
            await op.press("down", "a")
            await op.sees("#1: serial 'SN 7' corrected to 'SN 8' by Ada")

    run(way)
    with Store(db, read_only=True) as store:
        assert [one.new for one in store.corrections(1)] == ["SN 8"]
        assert store.measurement(2).header.serial == "SN 7"


def test_report_is_written_to_working_folder(db, tmp_path, monkeypatch):
    async def way():
        analyses = Analyses(quick_analyses().estimate, quick_analyses().diagnose)
        async with operated(db, analyses=analyses) as op:
            await op.press("7", "enter")
            await op.sees("r = 0.310")
            await op.press("7", "w")
            await op.sees("REPORT: report-2.html")

    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    run(way)
    (page,) = folder.iterdir()
    text = page.read_text()
    assert "SIMULATED" in text
    assert "ADSS" in text
    assert "SN 7" in text


def test_earlier_session_is_drawn_behind_sweep(db):
    async def way():
        async with operated(db) as op:
            await op.connects("sim:")
            await op.plans()
            await op.checks()
            await op.press("ctrl+n", "l")
            await op.sees("line #2 2.5 V")
            await op.press("l")
            await op.sees("no points yet")

    run(way)


def test_another_unit_clears_earlier_results(db):
    async def way():
        async with operated(db) as op:
            await op.press("7", "enter")
            await op.sees("[5 Result]", "r = 0.310")
            await op.press("1")
            op.app.screen.query_one("#units").focus()
            await op.press("home", "down")
            await op.sees("EDSS: SI units")
            await op.press("5")
            await op.sees("no measurement yet")
            assert op.app.screen.STEP == 1

    run(way)


def test_plan_changed_after_checks_is_swept(db):
    async def way():
        async with operated(db) as op:
            await op.connects("sim:")
            await op.plans()
            await op.checks()
            await op.plans(start="125", stop="150", points="6")
            await op.checks()
            await op.press("ctrl+n", "s")
            await op.sees("6 of 6 points stored; complete")

    run(way)
    with Store(db, read_only=True) as store:
        plan = store.measurements()[-1].header.plan
    assert (plan.frequencies_hz[0], len(plan.frequencies_hz)) == (125.0, 6)


def test_palette_reaches_every_step_and_copies(db):
    async def way():
        async with operated(db) as op:
            await op.press("ctrl+p", *"report", "enter")
            await op.press("ctrl+p", *"go to history", "enter")
            await op.sees("[7 Report]", "complete")
            await op.press("ctrl+y")
            await op.sees("copied")
            assert "ADSS SN 7 SIM." in op.app.clipboard

    run(way)


def test_log_has_trace_that_screen_omits(db, tmp_path, monkeypatch):
    def broken(response, unit, progress):
        raise ZeroDivisionError("by design")

    async def way():
        analyses = quick_analyses(diagnose=broken)
        async with operated(db, analyses=analyses, log=log_path()) as op:
            await op.press("7", "enter")
            await op.sees("r = 0.310")
            await op.press("6", "d")
            screen = await op.sees("NO DIAGNOSIS", "internal fault (ZeroDivisionError)")
            assert "by design" not in screen

    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    with logging_to_file() as path:
        run(way)
    assert path == tmp_path / "state" / "lashbench" / "lashbench.log"
    text = path.read_text()
    assert "Traceback" in text
    assert "by design" in text
    handlers = logging.getLogger("lashbench").handlers
    assert not any(isinstance(handler, logging.FileHandler) for handler in handlers)


def test_history_is_searched_and_sorted(tmp_path):
    db = tmp_path / "bench.db"
    words = ["measure", "--unit", "adss", "--db", str(db), "--instrument", "sim:?seed=1", "--level",
             "2.5", "--start", "130", "--stop", "150", "--points", "3", "--serial"]  # fmt: skip
    for serial in ("SN 20", "SN 7", "SN 3"):
        assert main([*words, serial]) == 0

    async def way():
        async with operated(db) as op:

            def order(screen):
                lines = [line for line in screen.splitlines() if "11-" in line or "SN" in line]
                return [line.split("SN")[1].split()[0] for line in lines if " SN " in line[:40]]

            await op.press("7")
            screen = await op.sees("SN 20", "SN 7", "SN 3")
            assert order(screen)[:3] == ["3", "7", "20"]
            await op.press("s", "s", "s", "s")
            assert order(await op.sees("sorted by serial number"))[:3] == ["20", "3", "7"]
            await op.press("s", "slash", *"sn 20", "enter")
            await op.sees("found: 1")
            assert "SN 7" not in op.screen
            await op.press("slash", *"x", "enter")
            await op.sees("no session has 'x'")
            await op.press("slash", "delete", "enter")
            await op.sees("SN 20", "SN 7", "SN 3")

    run(way)
