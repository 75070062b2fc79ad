"""Undoing the last entry on the bench screen, and the commands that do what it does."""

import shlex

from outputs.screen import operated, run

from daq.store import Store
from tui.cli import main
from tui.measure_options import PlanOptions


def test_z_undoes_entries_one_by_one(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.press("z")
            await op.sees("there is no entry to undo")
            await op.press("down", "enter")
            await op.press(*"SN", "7", "enter", *"Ada", "escape")
            desk = op.app.desk
            assert (desk.unit_name, desk.serial, desk.operator) == ("edss", "SN7", "Ada")
            await op.press("z")
            await op.sees("undone: operator")
            assert (desk.serial, desk.operator) == ("SN7", "")
            assert op.app.screen.query_one("#operator").value == ""
            op.app.screen.query_one("#serial").focus()
            await op.press("ctrl+z")
            await op.sees("undone: serial number")
            await op.press("escape", "z")
            assert (desk.unit_name, desk.unit.name) == ("adss", "ADSS")
            await op.sees("22.8")
            await op.press("z")
            assert desk.unit_name == "adss"

    run(way)


def test_plan_undo_leaves_running_session_alone(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.connects("sim:")
            await op.plans(levels="1.5", points="3", cycles=("3", "3"))
            await op.checks()
            await op.press("z")
            await op.sees("a session is under way")
            await op.press("ctrl+x")
            await op.sees("interrupted")
            await op.press("p")
            await op.sees("The sweep")
            op.app.screen.query_one("#plan-points").value = "5"
            await op.press("enter")
            await op.sees("[3 Check]", "5 from 115")
            await op.press("z")
            await op.sees("undone: plan")
            assert op.app.desk.options != PlanOptions()
            assert len(op.app.desk.plan().frequencies_hz) == 3

    run(way)


def test_printed_command_repeats_the_screen_step(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    db = tmp_path / "of the screen.db"
    lines = {}

    async def way():
        async with operated(db) as op:
            await op.press("f2")
            await op.sees("The same on the command line", "lashbench history")
            await op.press("f2")
            await op.types("#serial", "SN 7 'x'")
            await op.connects("sim:?ratio=0.4&seed=2")
            await op.plans(levels="1.5 2.5", points="3", cycles=("3", "3"))
            await op.press("f2")
            await op.sees("--dry-run")
            lines["measure"] = op.app.screen.text.splitlines()[-1]
            await op.press("escape")
            lines["plan"] = op.app.desk.plan()
            await op.press("4")

    run(way)
    words = shlex.split(lines["measure"])
    assert words.pop(0) == "lashbench"
    assert main(words) == 0
    with Store(db, read_only=True) as store:
        header = store.measurements()[-1].header
    assert header.plan == lines["plan"]
    assert (header.serial, header.address) == ("SN 7 'x'", "sim:?ratio=0.4&seed=2")

    async def later():
        async with operated(db, (100, 30)) as op:
            await op.press("7", "enter")
            await op.sees("[5 Result]", "r = 0.310")
            for step in (5, 6, 7):
                await op.press(str(step))
                await op.press("f2")
                await op.sees("The same on the command line")
                lines[step] = op.app.screen.text.splitlines()
                await op.press("escape")

    run(later)
    for line in lines[5][:2]:
        assert main(shlex.split(line)[1:]) == 0, line
    assert "no ARF" in capsys.readouterr().out or (tmp_path / "measurement-1.csv").exists()
    assert lines[6][-1] == "lashbench diagnose measurement-1.csv --unit adss"
    assert lines[7][0].startswith("lashbench report 1 ")
