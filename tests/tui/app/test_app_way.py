"""The bench screen from a unit to a report, on the simulated analyser over a socket."""

import asyncio

import pytest
from instruments.bench_server import gimbal_analyser, served
from outputs.screen import SIZES, operated, run

from daq.store import Store


@pytest.mark.parametrize(
    "size",
    [SIZES[0], pytest.param(SIZES[-1], marks=pytest.mark.long)],
    ids=lambda size: f"{size[0]}x{size[1]}",
)
def test_all_seven_steps_run_in_order(tmp_path, monkeypatch, size):
    monkeypatch.chdir(tmp_path)
    db = tmp_path / "bench.db"

    async def way(url):
        async with operated(db, size) as op:
            screen = await op.sees("[1 Unit]", "Unit under test", "k_s1", "5 V peak")
            assert "No sessions yet" in screen
            await op.types("#serial", "SN 7")
            await op.types("#operator", "Ada")
            screen = await op.connects(url)
            assert "SIMULATED" in screen
            assert "SOURCE OFF (confirmed)" in screen
            await op.plans()
            screen = await op.checks()
            for line in ("limits", "identity", "options: 1D2", "trial point", "confirmed off"):
                assert line in screen, line
            await op.press("ctrl+n")
            screen = await op.sees("[4 Sweep]", "S: START", "SOURCE OFF (confirmed)")
            assert "16 points" in screen
            assert "done about" in screen
            await op.press("s")
            await op.sees("16 of 16 points stored; complete", "SIMULATED")
            async with asyncio.timeout(20.0):
                while op.screen.count("\u25cf") < 12:
                    await op.pilot.pause(0.05)
            await op.press("ctrl+n")
            await op.sees("[5 Result]", "Adjust stage 2 first", "b2 = 0.0455", "ARF")
            assert "r = 0.310 +- 0.050  (95 %: 0.220 to 0.410)" in op.app.screen.copy_text()
            await op.press("v")
            await op.sees("least is likeliest")
            await op.press("ctrl+n")
            await op.sees("[6 Diagnosis]", "not diagnosed yet")
            await op.press("d")
            screen = await op.sees("VERDICT: AMBIGUOUS", "0.55  load-inertia")
            assert "4.2 standard errors" in op.app.screen.copy_text()
            assert "MEASURE THIS NEXT" in screen
            await op.press("ctrl+n")
            await op.sees("[7 Report]", "open", "diagnosed ambiguous: load-inertia")
            await op.press("w")
            await op.sees("REPORT:")
            assert "SIMULATED" in op.screen

    with served(gimbal_analyser()) as url:
        run(lambda: way(url))
    assert (tmp_path / "report-1.html").read_text() == "<html>measurement 1</html>"
    with Store(db, read_only=True) as store:
        (measurement,) = [m for m in store.measurements() if m.points]
        assert (measurement.state, measurement.points) == ("complete", 16)
        assert measurement.header.serial == "SN 7"
        assert measurement.header.operator == "Ada"
        assert measurement.source_state.value == "confirmed-off"
