"""Take pictures of every step of the bench screen, in several sizes, dark and light.

``python tests/screen_pictures.py docs/pictures`` runs a session on a simulated bench that hides a
cause, with the real analyses, which takes some minutes, and writes the three pictures that the
documentation shows. ``--every FOLDER`` writes all steps in all sizes and themes, too. ``--kept``
shows result and diagnosis of the session before, in seconds (``tests/data/pictured.sql``).
"""

import argparse
import asyncio
import tempfile
from contextlib import suppress
from pathlib import Path

from outputs.pictured import keep_history, make_history
from outputs.screen import nothing_found, operated
from textual.pilot import WaitForScreenTimeout

from tui.app.state.analyses import Analyses

SIZES = ((80, 24), (120, 35), (200, 60))
THEMES = {"dark": "textual-dark", "light": "textual-light"}
SHOWN = ((120, 35), "dark")
"""What the documentation shows, of these steps."""

IN_DOCS = ("sweep", "result", "diagnosis")
URL = "sim:?ratio=0.3&seed=1&effect=load-viscous-damping:B_L=0.15"
PATIENCE_S = 3600.0
SETTLED_S = 0.4


class Camera:
    """Takes each step in every size and theme.

    Parameters
    ----------
    docs
        Folder of the documentation's pictures.
    every
        Folder of all of them; None for none.
    """

    def __init__(self, docs, every):
        self.docs, self.every = docs, every

    async def take(self, op, name):
        """One step, as it stands."""
        wanted = [(size, theme) for size in SIZES for theme in THEMES] if self.every else [SHOWN]
        for size, theme in wanted:
            if self.every is None and name not in IN_DOCS:
                continue
            await op.pilot.resize_terminal(*size)
            op.app.theme = THEMES[theme]
            op.app.clear_notifications()
            with suppress(WaitForScreenTimeout):
                await op.pilot.pause(SETTLED_S)
            svg = op.app.export_screenshot(title="lashbench", simplify=True)
            if self.every is not None:
                file = self.every / f"{name}-{size[0]}x{size[1]}-{theme}.svg"
                file.write_text(svg, encoding="utf-8")
            if (size, theme) == SHOWN and name in IN_DOCS:
                (self.docs / f"screen-{name}.svg").write_text(svg, encoding="utf-8")


async def hold_at(app, points: int) -> None:
    """Pause the sweep when it has some points."""
    while app.desk.run.done < points:
        await asyncio.sleep(0.001)
    app.keeper.pause()


async def sweep(op, camera) -> None:
    """From the unit to a complete sweep."""
    await op.types("#serial", "SN 7")
    await op.types("#operator", "Ada")
    op.app.screen.leave_field()
    await camera.take(op, "unit")
    await op.connects(URL)
    await camera.take(op, "instrument")
    await op.plans(levels="1.5 2.2 3", start="108", stop="172", points="33", cycles=("20", "30"))
    await op.checks()
    await camera.take(op, "check")
    await op.press("ctrl+n")
    holding = asyncio.create_task(hold_at(op.app, 52))
    await op.press("s")
    await op.sees("Paused", within_s=PATIENCE_S)
    await holding
    await op.press(*["left"] * 3)
    await camera.take(op, "sweep")
    await op.press("space")
    await op.sees("complete", within_s=PATIENCE_S)
    await op.press("ctrl+n")


async def judge(op, camera) -> None:
    """Result, diagnosis, result once more, history."""
    while op.app.desk.results.estimate is None:
        assert "result" not in op.app.desk.results.faults, op.screen
        await asyncio.sleep(0.5)
    if op.app.desk.results.diagnosis is None:
        await camera.take(op, "result-before")
        await op.press("m")
        await op.sees("simulated units", within_s=PATIENCE_S)
        await camera.take(op, "result-datasheet")
        await op.press("m")
        await op.press("6", "d")
        while not (op.app.analyses.progress.get("diagnosis", (0.0, ""))[0] > 0.3):
            await asyncio.sleep(0.2)
        await camera.take(op, "diagnosis-running")
        while op.app.desk.results.diagnosis is None:
            assert "diagnosis" not in op.app.desk.results.faults, op.screen
            await asyncio.sleep(0.5)
        await op.press("5")
    await op.sees("[5 Result]")
    op.app.screen.query_one("#bode").focus()
    await op.press(*["right"] * 2)
    await camera.take(op, "result")
    await op.press("m")
    await camera.take(op, "result-plain-model")
    await op.press("m", "m", "v")
    await camera.take(op, "result-index")
    await op.press("v", "6")
    await op.sees("VERDICT", within_s=PATIENCE_S)
    await camera.take(op, "diagnosis")
    await op.press("v")
    await camera.take(op, "diagnosis-plots")
    await op.press("v", "7")
    await op.sees("[7 Report]", "session", within_s=PATIENCE_S)
    await camera.take(op, "history")
    await op.press("f1")
    await camera.take(op, "help")
    await op.press("escape")


async def take(docs: Path, every: Path | None, db: Path) -> None:
    """Everything, or the judgement of what a history has already."""
    camera, known = Camera(docs, every), db.exists()
    async with operated(db, SHOWN[0], analyses=Analyses(), find=nothing_found) as op:
        if known:
            await op.press("7")
            await op.sees("[7 Report]", "complete", within_s=PATIENCE_S)
            await op.press("enter")
            await op.sees("[5 Result]", within_s=PATIENCE_S)
        else:
            await sweep(op, camera)
        await judge(op, camera)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("docs", type=Path)
    parser.add_argument("--every", type=Path)
    parser.add_argument("--kept", action="store_true")
    given = parser.parse_args()
    if given.every is not None:
        given.every.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        history = Path(scratch) / "bench.db"
        if given.kept:
            make_history(history)
        asyncio.run(take(given.docs, given.every, history))
        if not given.kept:
            keep_history(history)
