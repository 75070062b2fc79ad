"""Ways through the bench screen that once led nowhere, or did what nobody meant."""

import pytest
from outputs.screen import operated, run
from textual.events import Key

from daq.configs import config_path
from daq.errors import ConfigurationError
from daq.store import Store
from sim.loopback import read_loopback_settings
from tui.app.screens import SCREENS
from tui.app.state.desk import NO_RECIPE, Desk
from tui.cli import main


@pytest.fixture
def weak_bench(tmp_path):
    """A bench file that allows 2 V peak."""
    text = config_path("benches", "default").read_text(encoding="utf-8")
    text = text.replace('name = "default"', 'name = "weak"')
    text = text.replace("source_vpk = 5.0", "source_vpk = 2.0")
    path = tmp_path / "weak.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_text_after_unit_is_its_serial_number(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.press("enter")
            await op.sees("Typing: serial number")
            await op.press(*"SN", "space", "7", "enter")
            await op.sees("Typing: operator")
            await op.press(*"Ada")
            assert (op.app.desk.serial, op.app.desk.operator) == ("SN 7", "Ada")
            await op.press("escape", "2")
            await op.sees("[2 Instrument]")
            await op.press("1", "2")
            await op.sees("[2 Instrument]")
            assert (op.app.desk.serial, op.app.desk.operator) == ("SN 7", "Ada")

    run(way)


def test_digit_after_connecting_selects_step(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.connects("sim:?seed=3")
            await op.press("3")
            await op.sees("[3 Check]")
            assert op.app.desk.url == "sim:?seed=3"

    run(way)


def test_unconfirmed_input_blocks_the_next_step(tmp_path, weak_bench):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.types("#file", "no.toml")
            await op.press("ctrl+n")
            await op.sees("[1 Unit]", "the unit file was typed")
            await op.types("#file", "")
            await op.connects("sim:")
            await op.types("#url", "sim:?seed=8")
            await op.press("ctrl+n")
            await op.sees("[2 Instrument]", "the address was typed")
            await op.types("#url", "sim:")
            await op.types("#bench", str(weak_bench))
            await op.press("ctrl+n")
            await op.sees("[2 Instrument]", "the bench file was typed")
            await op.press("enter")
            await op.sees("up to 2 V peak")
            await op.press("ctrl+n")
            await op.sees("[3 Check]", "1.5, 2 V peak")

    run(way)


def test_bench_file_limits_sweep_and_is_stored(tmp_path, weak_bench):
    db = tmp_path / "bench.db"

    async def way():
        async with operated(db, bench=str(weak_bench)) as op:
            await op.connects("sim:")
            await op.sees("bench weak: up to 2 V peak")
            await op.goes_to(3)
            await op.press("p")
            await op.sees("The sweep")
            op.app.screen.query_one("#plan-levels").value = "2.5"
            await op.press("enter")
            await op.sees("above the 2 V peak of bench weak")
            await op.press("escape")
            await op.plans(levels="1.5", points="3", cycles=("3", "3"))
            await op.checks()
            await op.press("ctrl+n", "s")
            await op.sees("3 of 3 points stored; complete")
            await op.goes_to(2)
            await op.types("#bench", "nowhere.toml")
            await op.press("enter")
            await op.sees("The bench file cannot be used", "nowhere.toml")
            assert op.app.desk.bench == str(weak_bench)

    run(way)
    with Store(db, read_only=True) as store:
        kept = store.measurements()[-1].header.configurations["bench"]
    assert kept == weak_bench.read_text(encoding="utf-8")


def test_missing_bench_file_is_refused_before_screen(capsys):
    assert main(["bench", "--bench", "nowhere.toml"]) == 2
    assert "nowhere.toml" in capsys.readouterr().err


def test_enter_takes_all_that_was_typed(tmp_path):
    """Keys that come faster than the screen works them off."""

    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.connects("sim:")
            await op.goes_to(3)
            await op.press("p")
            await op.sees("The sweep")
            levels = op.app.screen.query_one("#plan-levels")
            levels.value = ""
            levels.focus()
            await op.pilot.pause()
            for key, sign in (("1", "1"), ("full_stop", "."), ("5", "5"), ("enter", "\r")):
                op.app.post_message(Key(key, sign))
            await op.sees("[3 Check]", "at 1.5 V peak")

    run(way)


def test_refused_plan_keeps_dialog_and_recipe_optional(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.connects("sim:")
            await op.goes_to(3)
            await op.sees("recipe adss (P: another or none)")
            await op.press("p")
            await op.sees("The sweep")
            assert "name, file, none" in op.screen
            levels = op.app.screen.query_one("#plan-levels")
            levels.value = "1 4"
            await op.press("enter")
            await op.sees("The sweep", "above the 3 V peak of recipe ADSS")
            assert levels.value == "1 4"
            op.app.screen.query_one("#plan-recipe").value = NO_RECIPE
            await op.press("enter")
            await op.sees("[3 Check]", "at 1, 4 V peak", "no recipe", "wants 3 levels")
            await op.press("p")
            await op.sees("The sweep")
            assert op.app.screen.query_one("#plan-recipe").value == NO_RECIPE
            op.app.screen.query_one("#plan-recipe").value = "edss"
            await op.press("enter")
            # Nothing else was typed, so it is the recipe's own sweep.
            await op.sees("[3 Check]", "from 30 to 120 Hz", "recipe edss")

    run(way)


@pytest.mark.parametrize("unit", ["adss", "edss"])
def test_three_levels_are_proposed_within_the_recipe(tmp_path, unit):
    desk = Desk(tmp_path / "bench.db")
    desk.choose_unit(unit)
    plan = desk.plan()
    assert len(plan.levels_vpk) == 3
    assert max(plan.levels_vpk) <= 3.0
    assert min(b / a for a, b in zip(plan.levels_vpk, plan.levels_vpk[1:], strict=False)) > 1.18


def test_unit_without_recipe_gets_allowed_sweep(tmp_path):
    text = config_path("units", "adss").read_text(encoding="utf-8")
    text = text.replace('name = "ADSS"', 'name = "own"').replace(
        "source_vpk = 5.0", "source_vpk = 0.5"
    )
    text = text.replace("stop_hz = 500.0", "stop_hz = 180.0")
    own = tmp_path / "own.toml"
    own.write_text(text, encoding="utf-8")
    desk = Desk(tmp_path / "bench.db")
    desk.choose_unit(str(own))
    plan = desk.plan()
    assert (len(plan.levels_vpk), max(plan.levels_vpk)) == (3, 0.5)
    assert (plan.frequencies_hz[0], plan.frequencies_hz[-1]) == (50.0, 180.0)


def test_hidden_cause_is_chosen_measured_and_revealed(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db", (100, 30)) as op:
            await op.goes_to(2)
            screen = await op.sees("hides a cause:  sim:?hidden=")
            assert "effect" not in screen
            await op.press("down", "down", "enter")
            await op.sees("CONNECTED to sim:?hidden=")
            await op.plans(levels="1.5", points="3", cycles=("3", "3"))
            await op.checks()
            await op.press("ctrl+n", "s")
            await op.sees("complete")
            await op.press("6", "h")
            await op.sees("diagnose first")
            await op.press("d")
            await op.sees("VERDICT")
            await op.press("h")
            await op.sees("What was hidden", "Hidden was", "contribution ratio: true")

    run(way)


def test_address_with_hidden_cause_states_no_other():
    assert read_loopback_settings("?hidden=7").hidden == 7
    assert read_loopback_settings("?seed=7").hidden is None
    for wrong in ("?hidden=7&ratio=0.3", "?hidden=1&effect=amplifier-gain:k_a=5", "?hidden=x"):
        with pytest.raises(ConfigurationError, match="hidden"):
            read_loopback_settings(wrong)


def test_help_is_wrapped_once(tmp_path):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            for step in (1, 2, 7):
                await op.press(str(step), "f1")
                await op.sees(f"Step {step}:")
                rows = [row.partition("\u2502")[2] for row in op.screen.splitlines()]
                lines = [row.rpartition("\u2502")[0].strip() for row in rows]
                text = " ".join(SCREENS[list(SCREENS)[step - 1]]().HELP.split("\n\n")[0].split())
                start = next(at for at, line in enumerate(lines) if line == f"Step {step}: " + (
                    "unit", "instrument", "", "", "", "", "history")[step - 1])  # fmt: skip
                shown = lines[start + 1 : lines.index("", start)]
                assert " ".join(shown) == text
                widest = max(map(len, shown))
                for line, after in zip(shown, shown[1:], strict=False):
                    # No line is broken before its room is used.
                    assert len(line) + 1 + len(after.split()[0]) > widest, op.screen
                await op.press("escape")

    run(way)
