"""Room and colours of the bench screen: nothing is cut at 80x24, more stands side by side."""

import shutil
from pathlib import Path

import pytest
from outputs.screen import DIAGNOSIS, ESTIMATE, Diagnosed, operated, quick_analyses, run
from textual.color import Color

from daq.store import Store
from tui.app.plot.palette import LEAST_CONTRAST, contrast
from tui.cli import main
from tui.measurements.stored_answers import keep_estimate

HERTZ = [120.0, 125.0, 130.0, 135.0, 140.0, 145.0, 150.0, 155.0, 160.0]


@pytest.fixture
def db(measured, tmp_path):
    """The same history for each test: what one keeps in it is not another's."""
    return Path(shutil.copy(measured, tmp_path / "bench.db"))


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A complete session with an estimate."""
    path = tmp_path_factory.mktemp("layout") / "bench.db"
    words = ["measure", "--unit", "adss", "--db", str(path), "--instrument", "sim:?seed=1"]
    words += ["--level", "2.5", "--start", "120", "--stop", "160", "--points", "9"]
    words += ["--settle-cycles", "3", "--integrate-cycles", "3", "--serial", "SN-2026-0007"]
    assert main(words) == 0
    with Store(path) as store:
        session = store.measurement(1)
    keep_estimate(path, session, ESTIMATE)
    return path


def predicted(offset):
    part = {"gain_db": [-10.0 - offset] * 9, "gain_std_db": [1.0] * 9}
    return part | {"phase_deg": [-90.0] * 9, "phase_std_deg": [5.0] * 9}


def judged():
    told = {
        "source_vpk": [2.5] * 9, "frequency_hz": HERTZ, "sweep": [0] * 9,
        "gain_db": [-10.0] * 9, "phase_deg": [-90.0] * 9,
        "baseline": predicted(3.0), "extended": predicted(0.5),
    }  # fmt: skip
    return quick_analyses(diagnose=lambda *_: Diagnosed(DIAGNOSIS | {"prediction": told}))


@pytest.mark.parametrize(
    "size",
    [(80, 24), *(pytest.param(one, marks=pytest.mark.long) for one in ((140, 40), (200, 60)))],
)
def test_the_history_shows_every_answer_whole(db, size):
    async def way():
        async with operated(db, size) as op:
            await op.press("7")
            screen = await op.sees("0.31+-0.05", "0.215+-0.035", "0.045+-0.003", "SN-2026")
            assert "SN-2026-0007" in screen
            assert "SIM" in screen
            table, chart = op.app.screen.query_one("#sessions"), op.app.screen.query_one("#trend")
            beside = chart.region.x >= table.region.right
            assert beside == (size[0] >= 140)
            op.app.theme = "textual-light"
            await op.pilot.pause()
            # The plot has the colours of the theme that was chosen while it was shown.
            (title, *_) = chart.render_line(0)
            assert title.style.bgcolor.name == chart.palette.background.lower()
            assert title.style.bgcolor.name != "#121212"

    run(way)


def test_diagnosis_draws_models_below_points(db):
    async def way():
        async with operated(db, (140, 40), analyses=judged()) as op:
            await op.press("7")
            await op.sees("0.31+-0.05")
            await op.press("enter")
            await op.sees("[5 Result]", "r = 0.310")
            assert "band model" not in op.screen
            await op.press("6", "d")
            await op.sees(
                "VERDICT", "measured - plain model", "measured - model with the cause",
                "before (plain model), after (with the cause)",
            )  # fmt: skip
            await op.press("5")
            await op.sees("band model with the cause")
            await op.press("m")
            await op.sees("band plain model")
            await op.press("m")
            await op.pilot.pause()
            assert "band model" not in op.screen
            assert "band plain" not in op.screen

    run(way)


def test_key_switches_text_and_plots_when_small(db):
    async def way():
        async with operated(db, (80, 24), analyses=judged()) as op:
            await op.press("7")
            await op.sees("0.31+-0.05")
            await op.press("enter")
            await op.sees("r = 0.310")
            await op.press("6", "d")
            screen = await op.sees("VERDICT", "NEXT:", "0.55  load-inertia")
            assert "measured -" not in screen
            await op.press("v")
            screen = await op.sees("measured - model with the cause", "before (plain model)")
            assert "VERDICT" not in screen
            assert "measured - plain model" not in screen
            await op.press("v")
            await op.sees("VERDICT")

    run(way)


@pytest.mark.parametrize(
    "theme", ["textual-dark", pytest.param("textual-light", marks=pytest.mark.long)]
)
def test_every_word_can_be_read(db, theme):
    def faint(op):
        found = []
        for strip in op.app.screen._compositor.render_strips():
            for segment in strip:
                style = segment.style
                words = any(sign.isalnum() for sign in segment.text)
                if not words or style is None or style.color is None or style.bgcolor is None:
                    continue
                pair = Color.from_rich_color(style.color), Color.from_rich_color(style.bgcolor)
                if contrast(*pair) < LEAST_CONTRAST:
                    found.append((segment.text.strip(), round(contrast(*pair), 1)))
        return found

    async def way():
        async with operated(db, (80, 24), analyses=judged()) as op:
            op.app.theme = theme
            for step in ("1", "2", "7"):
                await op.press(step)
                await op.sees(f"[{step} ")
                assert faint(op) == [], step
            await op.press("enter")
            await op.sees("r = 0.310")
            assert faint(op) == []

    run(way)
