"""How long Ctrl+X takes to the source being off, on a real terminal and over a real socket.

The analyser is simulated in this process, by the clock, so that what its source does is known;
the bench screen is a process of its own on a pseudo-terminal. Run as a script, with the numbers
of measurements in the history if others than 1 and 10000 are meant; prints a line per situation.
"""

import os
import pty
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from instruments.bench_server import gimbal_analyser, url

from sim.serve import Server
from tui.cli import main as command

_TRIES = 3
_PROGRAM = """
import sys
from pathlib import Path
from sim.unit import load_unit
from tui.app.application import BenchApp
from tui.measure_options import PlanOptions

class Driven(BenchApp):
    def on_mount(self):
        super().on_mount()
        self.desk.choose_unit("adss")
        self.desk.url = sys.argv[2]
        self.desk.options = PlanOptions((2.0,), 120.0, 160.0, 2500, None, None, 4, 4)
        if sys.argv[3]:
            self.analyses.view(1)
            self.analyses.begin(sys.argv[3])
        self.keeper.start(hold=False)

Driven(Path(sys.argv[1]), find=lambda post: None).run()
"""
SITUATIONS = {
    "sweep": ("", b"4"),
    "step 1 begins to show": ("", b"41"),
    "step 7 begins to show": ("", b"47"),
    "an estimate runs": ("result", b"4"),
    "a diagnosis runs": ("diagnosis", b"4"),
}
"""What runs beside, and the keys before Ctrl+X."""


def history(path: Path, count: int) -> None:
    """A history with so many complete measurements of one sweep."""
    plan = ["--level", "2.5", "--level", "1.5", "--start", "115", "--stop", "165", "--points", "26"]
    cycles = ["--settle-cycles", "6", "--integrate-cycles", "6"]
    words = ["measure", "--unit", "adss", "--instrument", "sim:", "--db", str(path), "--quiet"]
    assert command([*words, *plan, *cycles, "--json"]) == 0
    with sqlite3.connect(path) as db:
        numbers = "WITH RECURSIVE n(i) AS (SELECT 2 UNION ALL SELECT i + 1 FROM n WHERE i < ?)"
        for table, key in (("measurements", "id"), ("points", "measurement_id")):
            names = [row[1] for row in db.execute(f"PRAGMA table_xinfo({table})")
                     if row[6] == 0 and row[1] not in ("id", key)]  # fmt: skip
            columns = ", ".join(names)
            db.execute(
                f"INSERT INTO {table} ({key}, {columns}) {numbers} "
                f"SELECT n.i, {columns} FROM n, {table} WHERE {key} = 1 AND n.i <= ?",
                (count, count),
            )


@contextmanager
def screen(*words: str):
    """The bench screen on a terminal that is read all the time; yields how to press keys."""
    ours, theirs = pty.openpty()
    subprocess.run(["stty", "rows", "40", "cols", "140"], stdin=theirs, check=True)
    process = subprocess.Popen(
        [sys.executable, "-c", _PROGRAM, *words],
        stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
    )  # fmt: skip
    os.close(theirs)

    def read():
        try:
            while os.read(ours, 65536):
                pass
        except OSError:
            return

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    try:
        yield lambda keys: os.write(ours, keys)
    finally:
        process.kill()
        process.wait()
        reader.join(5.0)
        os.close(ours)


def took_s(db: Path, job: str, keys: bytes) -> float:
    """From the key to the source off, s; a minute at most."""
    analyser = gimbal_analyser()
    with Server(analyser, realtime=True, tcp=0) as server:
        thread = threading.Thread(target=server.run)
        thread.start()
        try:
            with screen(str(db), url("tcp", server.addresses["tcp"]), job) as press:
                _until(lambda: analyser.output_vpk > 1.9, 60.0)
                time.sleep(1.0)
                for key in keys:
                    press(bytes([key]))
                    time.sleep(0.5 if key == ord("4") else 0.02)
                began_s = time.monotonic()
                press(b"\x18")
                _until(lambda: analyser.output_vpk == 0.0, 60.0)
                return time.monotonic() - began_s
        finally:
            server.stop()
            thread.join()


def _until(holds, within_s: float) -> None:
    end = time.monotonic() + within_s
    while not holds() and time.monotonic() < end:
        time.sleep(0.002)


def main() -> None:
    """Measure and print."""
    counts = [int(word) for word in sys.argv[1:]] or [1, 10000]
    with tempfile.TemporaryDirectory() as scratch:
        for count in counts:
            db = Path(scratch) / f"{count}.db"
            history(db, count)
            for name, (job, keys) in SITUATIONS.items():
                took = sorted(took_s(db, job, keys) for _ in range(_TRIES))
                print(f"{count:6d} measurements, {name:24s} {took[len(took) // 2]:6.2f} s, "
                      f"at most {took[-1]:.2f} s", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
