"""The sweep that tells most of a unit, found in step 3 beside the screen."""

import shlex
import threading
import time

import pytest
from outputs.screen import operated, quick_analyses, run

from analysis.planning import Planned
from daq.errors import InputError
from daq.plan import SweepPlan, spaced_frequencies


def planned(unit, minutes, start=100.0):
    hertz = spaced_frequencies(start, 180.0, 21, "log")
    sweep = SweepPlan(hertz, (1.5, 2.5, 4.0), "up", 20, 30)
    return Planned(
        unit.name, sweep, minutes, (126.0, 130.0, 134.0), (145.0, 150.0, 155.0),
        "contribution_ratio", 0.031, 0.055, 0.29, (), (),
    )  # fmt: skip


@pytest.mark.parametrize("size", [(80, 24), pytest.param((140, 40), marks=pytest.mark.long)])
def test_best_plan_fills_the_plan_dialog(tmp_path, size):
    asked, lines = [], []

    def planner(unit, minutes, progress):
        asked.append((unit.limits.source_vpk, minutes))
        progress(0.5, "simulating")
        return planned(unit, minutes)

    async def way():
        analyses = quick_analyses(planner=planner)
        async with operated(tmp_path / "bench.db", size, analyses=analyses) as op:
            await op.connects("sim:")
            await op.goes_to(3)
            await op.press("b")
            await op.sees("The sweep that tells most of ADSS")
            op.app.screen.query_one("#minutes").value = "0"
            await op.press("enter")
            await op.sees("give more than 0")
            op.app.screen.query_one("#minutes").value = "3"
            await op.press("enter")
            await op.sees(
                "BEST of 3 min, ADSS", "ARF expected at 130 Hz", "RF expected at 150 Hz",
                "1.5, 2.5, 4 V", "expected error of the contribution ratio 0.031",
            )  # fmt: skip
            await op.press("f2")
            await op.sees("The same on the command line")
            lines.extend(op.app.screen.text.splitlines())
            await op.press("f2", "p")
            await op.sees("Found; expected error of r 0.031")
            fields = {
                name: op.app.screen.query_one(f"#plan-{name}").value
                for name in ("recipe", "levels", "start", "points", "spacing")
            }
            assert fields == {
                "recipe": "none", "levels": "1.5 2.5 4", "start": "100", "points": "21",
                "spacing": "log",
            }  # fmt: skip
            await op.press("enter")
            screen = await op.sees("63 points: 21 from 100 to 180 Hz", "no recipe")
            assert "BEST" not in screen
            plan = op.app.desk.plan()
            assert plan.frequencies_hz == pytest.approx(spaced_frequencies(100, 180, 21, "log"))
            # That of the bench, which is less than the unit's.
            assert asked == [(5.0, 3.0)]

    run(way)
    assert shlex.split(lines[0])[:6] == ["lashbench", "plan", "--unit", "adss", "--minutes", "3"]


def test_best_plan_beyond_limits_is_refused(tmp_path):
    """Where the search says so, and where the limits do when it is taken."""
    plans = iter([InputError("0.1 min: the shortest useful sweep takes 2 min; give more"), 1.0])

    def planner(unit, minutes, progress):
        found = next(plans)
        if isinstance(found, Exception):
            raise found
        return planned(unit, minutes, found)

    async def way():
        async with operated(tmp_path / "b.db", analyses=quick_analyses(planner=planner)) as op:
            await op.connects("sim:")
            await op.goes_to(3)
            await op.press("b", "enter")
            await op.sees("NO BEST PLAN: 0.1 min: the shortest useful sweep takes 2 min")
            before = op.app.desk.plan()
            await op.press("b", "enter")
            await op.sees("BEST of 5 min")
            await op.press("p")
            await op.sees("Found; expected error")
            await op.press("enter")
            await op.sees("Found; expected error", "1 Hz")
            await op.press("escape")
            assert op.app.desk.plan() == before

    run(way)


def test_search_for_best_plan_is_given_up(tmp_path):
    """It goes on beside other steps, and another unit has no use for what it found."""
    going_on, ended = threading.Event(), []

    def planner(unit, minutes, progress):
        try:
            for part in range(1000):
                if going_on.wait(0.02):
                    return planned(unit, minutes)
                progress(0.001 * part, "simulating")
        except BaseException as error:
            ended.append(type(error).__name__)
            raise

    async def way():
        async with operated(tmp_path / "b.db", analyses=quick_analyses(planner=planner)) as op:
            await op.connects("sim:")
            await op.goes_to(3)
            await op.press("b", "enter")
            await op.sees("finding the best plan of 5 min", "B gives it up")
            await op.press("b")
            await op.sees("the search was given up", "B: the best one")
            assert "finding the best plan" not in op.screen
            end = time.monotonic() + 20
            while not ended:
                assert time.monotonic() < end
                await op.pilot.pause(0.02)
            await op.press("b", "enter")
            await op.sees("finding the best plan of 5 min")
            await op.press("2")
            await op.sees("[2 Instrument]")
            going_on.set()
            await op.sees("the best plan was found: step 3")
            await op.press("3")
            await op.sees("BEST of 5 min, ADSS")
            op.app.desk.choose_unit("edss")
            await op.press("2", "3")
            await op.sees("[3 Check]")
            assert "BEST" not in op.screen

    run(way)
    assert ended == ["_GivenUp"]
