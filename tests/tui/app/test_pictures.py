"""The pictures of the documentation say what the screen says today.

The numbers are those of the day on which they were taken (`tests/data/pictured.sql`); the words,
the order and the layout are today's. Where this fails, take them again of the same history, in
seconds: ``python tests/screen_pictures.py docs/pictures --kept``. ``make pictures`` makes all anew.
"""

from contextlib import suppress
from pathlib import Path

import pytest
from outputs.pictured import make_history, said_by, words_of
from outputs.screen import operated, run, some_points
from textual.pilot import WaitForScreenTimeout

PICTURES = Path(__file__).parents[3] / "docs" / "pictures"
SIZE = (120, 35)
PLAN = {
    "levels": "1.5 2.2 3",
    "start": "108",
    "stop": "172",
    "points": "33",
    "cycles": ("20", "30"),
}


def picture(step):
    return said_by((PICTURES / f"screen-{step}.svg").read_text(encoding="utf-8"))


def seen(op):
    return said_by(op.app.export_screenshot(title="lashbench", simplify=True))


async def settled(op):
    """Wait until the screen stays as it is."""
    op.app.clear_notifications()
    before = None
    while (now := seen(op)) != before:
        before = now
        with suppress(WaitForScreenTimeout):
            await op.pilot.pause(0.3)


@pytest.fixture
def pictured(tmp_path):
    """The history that the pictures show."""
    make_history(tmp_path / "bench.db")
    return tmp_path / "bench.db"


def test_pictures_match_result_and_diagnosis_screens(pictured):
    async def look():
        async with operated(pictured, SIZE) as op:
            await op.press("7")
            await op.sees("[7 Report]", "complete")
            await op.press("enter")
            await op.sees("[5 Result]", "contribution ratio")
            op.app.screen.query_one("#bode").focus()
            await op.press("right", "right")
            await settled(op)
            assert seen(op) == picture("result")
            await op.press("6")
            await op.sees("VERDICT")
            await settled(op)
            assert seen(op) == picture("diagnosis")

    run(look)


@pytest.mark.slow
def test_the_sweep_is_pictured_with_todays_words(tmp_path):
    async def look():
        async with operated(tmp_path / "bench.db", SIZE) as op:
            await op.types("#serial", "SN 7")
            await op.connects("sim:?ratio=0.3&seed=1&speed=realtime")
            await op.plans(**PLAN)
            await op.checks()
            await op.press("ctrl+n", "s")
            await some_points(op)
            op.app.keeper.pause()
            await op.sees("Paused")
            await op.press("left")
            await settled(op)
            now, then = (
                [row.partition("cursor:")[1] or row for row in words_of(rows)]
                for rows in (seen(op), picture("sweep"))
            )
            assert now == then

    run(look)


def test_a_picture_of_other_words_is_found(tmp_path):
    svg = (PICTURES / "screen-sweep.svg").read_text(encoding="utf-8")
    older = svg.replace("Paused", "Stopped")
    assert words_of(said_by(older)) != words_of(said_by(svg))
    assert len(words_of(said_by(svg))) >= 4
