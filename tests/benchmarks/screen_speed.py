"""How quick the bench screen is: first paint, key to reaction in a sweep and in a diagnosis, idle.

Run as a script; prints four lines beside the bounds that hold for them.
"""

import asyncio
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from outputs.screen import operated
from textual.events import Key

from tui.app.plot.bode import BodePlot
from tui.app.state.analyses import Analyses
from tui.cli import main as lashbench

_KEYS = 60
_IDLE_S = 5.0
_PRACTICE = Path(__file__).parents[1] / "data/practice/practice-08.csv"
_STARTS = 5
_FIRST = """
import sys, time
from pathlib import Path
from tui.app.application import BenchApp
class Timed(BenchApp):
    def _painted(self):
        print(time.time() - float(sys.argv[2]), file=sys.__stdout__, flush=True)
        self.exit(0)
    def on_mount(self):
        super().on_mount()
        self.call_after_refresh(self._painted)
sys.exit(Timed(Path(sys.argv[1]), find=lambda post: None).run(headless=True))
"""


def first_paint_s(db: Path) -> float:
    """From the start of Python to the first screen; the best of some starts."""
    took = []
    for _ in range(_STARTS):
        words = [sys.executable, "-c", _FIRST, str(db), str(time.time())]
        run = subprocess.run(words, check=True, capture_output=True, text=True)
        took.append(float(run.stdout))
    return min(took)


async def reactions(db: Path) -> tuple[list[float], float]:
    """Times from key to moved cursor in a sweep as fast as it goes, s; share of a core at rest."""
    async with operated(db, (120, 40)) as op:
        await op.connects("sim:")
        await op.plans(points="2500", cycles=("4", "4"))
        await op.checks()
        await op.press("ctrl+n", "s")
        plot, took = op.app.screen.query_one(BodePlot), []
        for count in range(_KEYS):
            before, began_s = plot.cursor_hz, time.perf_counter()
            op.app.post_message(Key("right" if count % 2 else "left", None))
            while plot.cursor_hz == before and time.perf_counter() - began_s < 2.0:
                await asyncio.sleep(0.001)
            took.append(time.perf_counter() - began_s)
            await asyncio.sleep(0.02)
        await op.press("space")
        await op.sees("Paused")
        used_s, began_s = time.process_time(), time.perf_counter()
        await asyncio.sleep(_IDLE_S)
        return took, (time.process_time() - used_s) / (time.perf_counter() - began_s)


async def reactions_diagnosing(db: Path) -> list[float]:
    """Times from key to moved cursor while a measurement is diagnosed, s."""
    async with operated(db, (120, 40), analyses=Analyses()) as op:
        await op.press("7")
        await op.sees("[7 Report]", "complete")
        await op.press("enter")
        await op.sees("[5 Result]", "r = 0.", within_s=60.0)
        await op.press("6", "d", "5")
        await op.sees("[5 Result]")
        plot, took = op.app.screen.query_one(BodePlot), []
        plot.focus()
        while "diagnosis" in op.app.screen.bench.analyses.progress and len(took) < _KEYS:
            before, began_s = plot.cursor_hz, time.perf_counter()
            op.app.post_message(Key("right" if len(took) % 2 else "left", None))
            while plot.cursor_hz == before and time.perf_counter() - began_s < 2.0:
                await asyncio.sleep(0.001)
            took.append(time.perf_counter() - began_s)
            await asyncio.sleep(0.1)
        assert len(took) == _KEYS, "the diagnosis ended before the keys"
        return took


def measured(db: Path) -> None:
    """A measurement that can be diagnosed."""
    words = ["measure", "--unit", "adss", "--db", str(db), "--instrument", "sim:?seed=1"]
    words += ["--level", "2", "--level", "3.5", "--start", "110", "--stop", "160"]
    if lashbench([*words, "--points", "31", "--quiet"]):
        raise SystemExit("the simulated bench did not measure")


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as scratch:
        print(f"first paint        {first_paint_s(Path(scratch) / 'none.db'):.2f} s    below 1 s")
        took, idle = asyncio.run(reactions(Path(scratch) / "bench.db"))
        measured(Path(scratch) / "diagnosed.db")
        diagnosing = asyncio.run(reactions_diagnosing(Path(scratch) / "diagnosed.db"))
    for what, times, bound_ms in (("sweep", took, 100), ("diagnosis", diagnosing, 50)):
        middle, last = 1e3 * sorted(times)[len(times) // 2], 1e3 * max(times)
        print(f"key in a {what:<10}{middle:.0f} ms, at most {last:.0f} ms    below {bound_ms} ms")
    print(f"idle, paused sweep {100 * idle:.1f} %    below 20 % of a core")


if __name__ == "__main__":
    main()
