"""Limits on the bench screen: chosen there, of bench file or unit; verdicts with their reasons."""

import shlex
import shutil
import threading

import pytest
from outputs.screen import ESTIMATE, operated, quick_analyses, run

from daq.configs import config_path
from daq.store import Store
from tui.cli import main
from tui.measurements.stored_answers import keep_estimate

LIMITS = """\
schema = 1
name = "outgoing"

[acceptance]
"""
SWEEP = ["--level", "2.5", "--start", "120", "--stop", "160", "--points", "21"]


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A complete session with an estimate, and one without."""
    path = tmp_path_factory.mktemp("judged") / "bench.db"
    words = ["measure", "--unit", "adss", "--db", str(path), *SWEEP, "--serial", "SN 7"]
    for seed in (1, 2):
        assert main([*words, "--instrument", f"sim:?seed={seed}"]) == 0
    with Store(path) as store:
        session = store.measurement(1)
    keep_estimate(path, session, ESTIMATE)
    return path


@pytest.fixture
def db(measured, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(measured, "bench.db")
    return tmp_path / "bench.db"


def limits(tmp_path, text, name="limits.toml"):
    path = tmp_path / name
    path.write_text(LIMITS + text)
    return path


async def chooses(op, named):
    await op.press("j")
    await op.sees("Judge by these limits")
    op.app.screen.query_one("#limits-file").value = named
    await op.press("enter")


async def says(op, words):
    """The whole text of the step, once it has some words."""
    for _ in range(400):
        if words in (said := op.app.screen.copy_text()):
            return said
        await op.pilot.pause(0.05)
    raise AssertionError(f"{words} not in:\n{said}")


async def opens(op, number):
    await op.press("7")
    await op.sees("[7 Report]", "SN 7")
    op.app.open_session(number)
    await op.sees("[5 Result]", "r = 0.310")


@pytest.mark.parametrize("size", [(80, 24), pytest.param((140, 40), marks=pytest.mark.long)])
def test_limits_are_chosen_and_decide(db, tmp_path, size):
    file = limits(tmp_path, (
        "r = { upper = 0.2 }\nb1_deg = { upper = 0.4 }\narf_hz = { lower = 100, upper = 200 }\n"
        'causes_not_tolerated = ["load-inertia", "shaft-stiffness"]\n'
    ))  # fmt: skip

    async def way():
        async with operated(db, size) as op:
            await opens(op, 1)
            assert " by limits" not in op.screen
            await chooses(op, "missing.toml")
            await op.sees("limits 'missing.toml' were not found")
            await op.press("escape")
            await chooses(op, "limits.toml")
            await op.sees("FAIL by limits outgoing; out of limits: contribution")
            said = op.app.screen.copy_text()
            assert "FAIL  contribution ratio r: 0.310 \u00b1 0.050, at most 0.2" in said
            assert "PASS  ARF at 2.5 V: " in said
            assert "Stage 1: PASS. b1 = 0.2148" in said
            assert "UNDECIDED  load-inertia: not tolerated (no diagnosis was made)" in said
            await op.press("f2")
            await op.sees("The same on the command line")
            line = op.app.screen.text.splitlines()[-1]
            assert "--judge limits.toml" in line
            assert line.startswith("lashbench estimate ")
            await op.press("f2", "6")
            await op.sees("not diagnosed yet", "FAIL by limits outgoing")
            await op.press("d")
            await op.sees("VERDICT", "FAIL by limits outgoing")
            await says(op, "load-inertia: not tolerated (some models that may be true have it)")
            await op.press("7")
            await op.sees("SN 7     FAIL", "#2: UNDECIDED by limits outgoing")
            await op.press("down")
            await op.sees("#1: FAIL by limits outgoing", "#1: FAIL  contribution ratio r")
            await op.press("z")
            await op.sees("undone: limits to judge by")
            await op.press("5")
            await op.sees("[5 Result]", "95 %, over")
            assert " by limits" not in op.screen

    run(way)
    assert file.exists()


def test_bench_file_names_its_limits(db, tmp_path):
    """Relative to the bench file, and before the unit's own."""
    folder = tmp_path / "line 2"
    folder.mkdir()
    limits(folder, "r = { upper = 0.9 }\n", "gears.toml")
    bench = folder / "bench.toml"
    text = config_path("benches", "default").read_text()
    bench.write_text(text.replace("schema = 1", 'schema = 1\njudge = "gears.toml"'))
    lines = []

    async def way():
        async with operated(db, bench=str(bench)) as op:
            await opens(op, 1)
            await op.sees("PASS by limits outgoing.")
            await op.press("f2")
            await op.sees("The same on the command line")
            lines.extend(op.app.screen.text.splitlines())
            await op.press("f2")
            (folder / "gears.toml").unlink()
            await op.press("6", "5")
            await op.sees("NOT JUDGED: limits", "gears.toml' were not found")

    run(way)
    words = shlex.split(lines[-1])
    assert words[words.index("--judge") + 1] == str(folder / "gears.toml")


def test_limits_of_unit_judge_by_themselves(tmp_path):
    unit = tmp_path / "own.toml"
    text = config_path("units", "adss").read_text()
    unit.write_text(text + "\n[acceptance]\nrf_hz = { upper = 50 }\n")
    db = tmp_path / "bench.db"
    assert main(["measure", "--unit", str(unit), "--db", str(db), *SWEEP, "--instrument", "sim:",
                 "--serial", "SN 7"]) == 0  # fmt: skip

    async def way():
        async with operated(db, (140, 40)) as op:
            await opens(op, 1)
            await op.sees("FAIL by limits ADSS; out of limits: RF at 2.5 V.", "at most 50 Hz")
            await op.press("7", "u")
            await op.sees("FAIL", "#1: FAIL  RF at 2.5 V")

    run(way)


def test_total_backlash_is_estimated_for_its_limit(db, tmp_path):
    limits(tmp_path, "b_t_deg = { upper = 0.08 }\n")
    asked, going_on = [], threading.Event()

    def total(response, unit, progress):
        asked.append(unit.name)
        progress(0.5, "")
        assert going_on.wait(20.0)
        changed = {
            "b_t_deg": {"value": 0.066, "std": 0.004},
            "b1_deg": {"value": 0.22, "std": 0.05},
        }
        return ESTIMATE | changed

    async def way():
        analyses = quick_analyses(total=total)
        async with operated(db, analyses=analyses, judge="limits.toml") as op:
            await opens(op, 1)
            await op.sees("UNDECIDED by limits outgoing", "estimating the total backlash, too, 50")
            going_on.set()
            await op.sees("PASS by limits outgoing.")
            said = op.app.screen.copy_text()
            assert "PASS  b_t: 0.0660 \u00b1 0.0040 deg" in said
            # The numbers told are those that are judged.
            assert "b1 = 0.2200" in said
            await op.press("6", "5")
            await op.sees("PASS by limits outgoing.")
            assert asked == ["ADSS"]
            await op.press("7", "down")
            await op.sees("UNDEC.", "(the total backlash was taken")

    run(way)
