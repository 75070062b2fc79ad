"""Take the pictures of the bench screen that the documentation shows.

``python tests/screen_pictures.py docs/pictures`` runs a session on the simulated
bench with the real analyses, which takes some minutes, and writes one SVG a step.
"""

import asyncio
import sys
import tempfile
from pathlib import Path

from screen import nothing_found, operated

from tui.app.state.analyses import Analyses

SIZE = (104, 34)
"""A size that reads well in a page."""
PATIENCE_S = 600.0


async def hold_at(app, points: int) -> None:
    """Pause the sweep when it has some points."""
    while app.desk.run.done < points:
        await asyncio.sleep(0.001)
    app.keeper.pause()


async def take(folder: Path, db: Path) -> None:
    """Sweep, result, and the diagnosis where there is one."""
    async with operated(db, SIZE, analyses=Analyses(), find=nothing_found) as op:

        async def picture(name: str) -> None:
            op.app.clear_notifications()
            await op.pilot.pause(0.3)
            svg = op.app.export_screenshot(title="lashbench", simplify=True)
            (folder / f"screen-{name}.svg").write_text(svg, encoding="utf-8")

        await op.connects("sim:?ratio=0.3&seed=1&effect=load-viscous-damping:B_L=0.02")
        await op.plans(
            levels="1.5 2.2 3", start="108", stop="172", points="33", cycles=("20", "30")
        )
        await op.checks()
        await op.press("ctrl+n")
        holding = asyncio.create_task(hold_at(op.app, 52))
        await op.press("s")
        await op.sees("Paused")
        await holding
        await picture("sweep")
        await op.press("space")
        await op.sees("complete", within_s=PATIENCE_S)
        await op.press("ctrl+n")
        while not ("contribution ratio r" in op.screen or "No advice" in op.screen):
            await op.pilot.pause(0.5)
        await picture("result")
        await op.press("ctrl+n", "d")
        while not ("VERDICT" in op.screen or "NO DIAGNOSIS" in op.screen):
            await op.pilot.pause(0.5)
        if "VERDICT" in op.screen:
            await picture("diagnosis")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        asyncio.run(take(Path(sys.argv[1]), Path(scratch) / "bench.db"))
