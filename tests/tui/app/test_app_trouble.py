"""The bench screen when things go wrong: stops, broken wires, killed programs, overloads."""

import asyncio
import subprocess
import sys

import pytest
from instruments.bench_server import gimbal_analyser, served
from instruments.killed import killed_after
from outputs.screen import (
    DIAGNOSIS,
    LONG,
    Diagnosed,
    begun,
    operated,
    quick_analyses,
    run,
    some_points,
    starts,
    sweeping,
)

from analysis.observation.joint import sweep_document
from daq.analyser import SourceState
from daq.frf import PointFlag
from daq.plan import SweepPlan
from daq.store import Store
from tui.app.dialogs.dialogs import ErrorDialog


@pytest.mark.parametrize(
    "place", ["sweep", pytest.param("field", marks=pytest.mark.long), "dialog"]
)
def test_one_key_stops_source_from_every_screen(tmp_path, place):
    db = tmp_path / "bench.db"

    async def way(url):
        async with operated(db) as op:
            await sweeping(op, url, **LONG)
            if place in ("unit", "field"):
                await op.press("1")
            if place == "field":
                await op.types("#notes", "cut")
            if place == "palette":
                await op.press("ctrl+p")
            if place == "dialog":
                await op.press("f1")
            await op.press("ctrl+x")
            while op.app.keeper.busy:
                await op.pilot.pause(0.02)
            assert op.app.desk.run.source is SourceState.CONFIRMED_OFF
            if place in ("unit", "field", "sweep"):
                await op.sees("SOURCE OFF (confirmed)", "interrupted")

    run(lambda: way("sim:"))
    measurement = begun(db)
    assert measurement.state == "interrupted"
    assert 3 <= measurement.points < 2800


def test_pause_is_reversible_and_abort_is_final(tmp_path):
    db = tmp_path / "bench.db"

    async def way(url):
        async with operated(db) as op:
            await sweeping(op, url, **LONG)
            assert "SOURCE ON at 2.5 V peak" in op.screen
            await op.press("space")
            await op.sees("Paused, source off", "SOURCE OFF (confirmed)")
            stored = op.app.desk.run.done
            await op.press("space")
            await some_points(op, stored + 2)
            await op.press("a")
            await op.sees("Abort for good?")
            await op.press("a")
            await op.sees("aborted: aborted by the operator", "SOURCE OFF (confirmed)")
            await op.press("r")
            assert not op.app.keeper.busy

    with served(gimbal_analyser()) as url:
        run(lambda: way(url))
    assert begun(db).state == "aborted"


def test_dropped_connection_opens_dialog_and_resumes(tmp_path):
    db = tmp_path / "bench.db"

    async def way(url):
        async with operated(db) as op:
            await starts(op, url)
            screen = await op.sees("The session was interrupted", "points are kept")
            assert isinstance(op.app.screen, ErrorDialog)
            assert "Traceback" not in screen
            assert "connection" in op.app.screen.text
            await op.press("enter")
            await op.sees("R: go on with the missing points", "SOURCE OFF (confirmed)")
            kept = op.app.desk.run.done
            assert 0 < kept < 16
            await op.press("r")
            await op.sees("16 of 16 points stored; complete")

    with served(gimbal_analyser(faults=["dropped-connection:point=6"])) as url:
        run(lambda: way(url))
    measurement = begun(db)
    assert (measurement.id, measurement.state, measurement.points) == (1, "complete", 16)


def test_resume_of_killed_program_is_offered_first(tmp_path):
    db = tmp_path / "bench.db"

    async def way(url):
        async with operated(db) as op:
            screen = await op.sees("RESUME", "interrupted: Enter on RESUME goes on")
            assert "ADSS SIMULATED" in screen
            await op.press("enter")
            await op.sees("[2 Instrument]", url)
            await op.press("enter")
            await op.sees("CONNECTED")
            await op.press("ctrl+n")
            await op.sees("going on with measurement 1: only missing points are taken")
            await op.checks()
            await op.press("ctrl+n")
            await op.sees("S: START")
            await op.press("s")
            await op.sees("40 of 40 points stored; complete")

    with served(gimbal_analyser()) as url:
        killed_after(5, 0.0, url, db, 0, (120.0, 160.0, 40, 4, 4, 2.5))
        assert begun(db).state == "interrupted"
        run(lambda: way(url))
    assert (begun(db).id, begun(db).state) == (1, "complete")


def test_overload_is_marked_by_shape_and_words(tmp_path):
    db = tmp_path / "bench.db"

    async def way(url):
        async with operated(db) as op:
            await starts(op, url)
            screen = await op.sees("16 of 16 points stored; complete", "1 flagged")
            assert "! overload" in screen
            plot = screen.partition("gain, dB")[2].partition("phase, deg")[0]
            assert plot.replace("! overload", "").count("!") == 1

    run(lambda: way("sim:?fault=overload-burst:point=8"))
    with Store(db, read_only=True) as store:
        flags = [p.point.flags for p in store.points(begun(db).id)]
    assert sum(bool(f & PointFlag.OVERLOAD) for f in flags) == 1


def test_proposed_sweep_starts_by_one_key(tmp_path):
    """Both sweeps are then diagnosed together."""
    db, diagnosed = tmp_path / "bench.db", []

    def diagnose(responses, unit, progress):
        diagnosed.append([response.provenance["measurement_id"] for response in responses])
        swept = [sweep_document(SweepPlan((120.0, 140.0), (r.levels_vpk[0],))) for r in responses]
        return Diagnosed({**DIAGNOSIS, "sweeps": swept})

    async def way(url):
        analyses = quick_analyses(diagnose=diagnose)
        async with operated(db, (120, 40), analyses=analyses) as op:
            await op.connects(url)
            await starts(op, url)
            await op.sees("complete")
            await op.press("ctrl+n", "ctrl+n", "d")
            await op.sees("MEASURE THIS NEXT", "shaft-stiffness", "3 from 120 to 140 Hz")
            await op.press("n")
            await op.sees("[4 Sweep]", "3 of 3 points stored; complete")
            await op.press("ctrl+n", "ctrl+n", "d")
            await op.sees("measurement 2", "sweep 2: 2 points from 120 to 140 Hz up")

    run(lambda: way("sim:"))
    assert diagnosed == [[1], [2, 1]]
    plan = begun(db).header.plan
    proposed = DIAGNOSIS["next_measurement"]["plan"]
    assert plan.levels_vpk == tuple(proposed["levels_vpk"])
    assert plan.frequencies_hz == tuple(proposed["frequencies_hz"])
    assert plan.settle_cycles == 4


def test_band_picked_on_plot_is_remeasured(tmp_path):
    db = tmp_path / "bench.db"

    async def way(url):
        async with operated(db) as op:
            await starts(op, url)
            await op.sees("complete")
            await op.press("1")
            await op.types("#notes", "for the next one")
            await op.press("escape", "4")
            await op.press("left", "b")
            await op.sees("Band from")
            await op.press("right", "right", "right", "b")
            await op.sees("Measure the band again?", "4 stored points")
            await op.press("b")
            await op.sees("keeps its own", "yours were left out")
            await op.sees("16 of 16 points stored; complete")
            assert op.app.desk.notes == ""

    run(lambda: way("sim:"))
    with Store(db, read_only=True) as store:
        measurement = begun(db).id
        assert len(store.points(measurement)) == 16
        assert len(store.points(measurement, superseded=True)) == 20


def test_the_stop_key_works_without_a_session(tmp_path):
    """It switches off what was found driving, once the instrument has answered."""

    async def way(url):
        async with operated(tmp_path / "bench.db") as op:
            await op.press("ctrl+x")
            await op.sees("no instrument is connected")
            screen = await op.connects(url)
            assert "SOURCE ON: switch it off by hand" in screen
            await op.press("enter", "ctrl+x")
            await op.sees("source confirmed off", "SOURCE OFF (confirmed)")

    analyser = gimbal_analyser()
    for line in (b"*RST\n", b"INST:SEL SINE\n", b"SOUR:VOLT 2 VPK\n"):
        analyser.listen(line, end=True)
    with served(analyser) as url:
        run(lambda: way(url))


def test_missing_instrument_states_the_remedy(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.goes_to(2)
            await op.types("#url", "prologix:/dev/not-there?addr=11")
            await op.press("enter")
            screen = await op.sees("NOT CONNECTED", "/dev/not-there", "What to try")
            assert "SIMULATED |" not in screen
            await op.press("ctrl+n")
            await op.sees("connect an instrument first")
            assert op.app.screen.STEP == 2

    run(way)


def test_refused_plan_keeps_the_old_one(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.connects("sim:")
            await op.goes_to(3)
            await op.press("p")
            op.app.screen.query_one("#plan-levels").value = "4.5"
            await op.press("enter")
            await op.sees("The sweep", "above the 3 V peak of recipe ADSS")
            await op.press("escape")
            await op.sees("[3 Check]", "at 1.5, 2.2, 3 V peak")
            await op.press("p")
            op.app.screen.query_one("#plan-points").value = "x"
            await op.press("enter")
            await op.sees("'x' is not a whole number")

    run(way)


def test_a_decimal_comma_is_no_second_level(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.connects("sim:")
            await op.goes_to(3)
            await op.press("p")
            op.app.screen.query_one("#plan-levels").value = "1,2"
            await op.press("enter")
            screen = await op.sees("'1,2' is not a finite number")
            assert "V peak: 1 2.5" in screen
            assert "yes or no" in screen
            op.app.screen.query_one("#plan-levels").value = "1.2  2.5"
            await op.press("enter")
            assert op.app.desk.options.levels_vpk == (1.2, 2.5)

    run(way)


def test_letters_do_the_same_with_shift(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.connects("sim:")
            await op.goes_to(3)
            await op.press("P")
            await op.sees("source levels")
            await op.press("escape")
            await op.goes_to(1)
            await op.types("#notes", "")
            await op.press("A", "b")
            assert op.app.desk.notes == "Ab"

    run(way)


def test_points_stay_visible_when_resuming_fails(tmp_path):
    async def way(url):
        async with operated(tmp_path / "bench.db") as op:
            await sweeping(op, url, **LONG)
            await op.press("1")
            await op.sees("Session 1 is under way: step 4")
            await op.press("ctrl+x")
            await op.sees("#1 interrupted", "1 interrupted: Enter on RESUME goes on")
            done = op.app.desk.run.done
            op.app.desk.url = "TCPIP::127.0.0.1::1::SOCKET"
            await op.press("4", "r")
            await op.sees("The session did not begin")
            await op.press("escape")
            await op.sees(f"{done} of 2800 points stored; interrupted")
            assert done > 2

    run(lambda: way("sim:"))


def test_quitting_ends_a_session_safe(tmp_path):
    db = tmp_path / "bench.db"

    async def way(url):
        async with operated(db) as op:
            await sweeping(op, url, **LONG)
            await op.press("ctrl+q")
            await op.sees("Quit?")
            await op.press("y")
            while op.app.is_running:
                await asyncio.sleep(0.02)
            assert op.app.return_code == 0

    run(lambda: way("sim:"))
    assert begun(db).state == "interrupted"
    assert begun(db).source_state is SourceState.CONFIRMED_OFF


def test_failed_analysis_is_reported_and_isolated(tmp_path):
    def broken(response, unit, progress):
        raise ZeroDivisionError("by design")

    async def way():
        analyses = quick_analyses(estimate=broken)
        async with operated(tmp_path / "bench.db", analyses=analyses) as op:
            await starts(op, "sim:")
            await op.sees("complete")
            await op.press("ctrl+n")
            screen = await op.sees("NO ESTIMATE: internal fault (ZeroDivisionError)", "ARF")
            assert "Traceback" not in screen

    run(way)


def test_no_traceback_when_the_screen_itself_breaks(tmp_path):
    program = (
        "import asyncio, sys; from pathlib import Path;"
        "from tui.app.application import BenchApp;"
        "app = BenchApp(Path(sys.argv[1]), find=lambda post: None);"
        "app.call_later(lambda: 1 / 0);"
        "app.run(headless=True); sys.exit(app.return_code)"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "bench.db")],
        capture_output=True, text=True, timeout=30, check=False,
    )  # fmt: skip
    assert ended.returncode == 1
    assert "error: internal: ZeroDivisionError" in ended.stdout + ended.stderr
    assert "Error: division" not in (ended.stdout + ended.stderr).replace("ZeroDivisionError: ", "")
