"""A production line on a simulated analyser: units with known answers, and the program on it.

The units are servos without play; a load that is too heavy lowers the anti-resonance.
"""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from fault_bench.fault_child import drives
from instruments.bench_server import linear_analyser, served

from daq.errors import FileFormatError, InputError
from daq.store import Store
from sim.effects import drivetrain_with
from sim.unit import load_unit

GOOD, BAD = 2.75e-3, 3.4e-3
"""Inertia of the load of a good and of a bad unit, kg.m^2: ARF at 149 and at 134 Hz."""
RECIPE = """
schema = 1
name = "ADSS"
[sweep]
levels_vpk = [2.0]
start_hz = 110.0
stop_hz = 190.0
points = 21
settle_cycles = 2
integrate_cycles = 3
"""
LIMITS = """
schema = 1
name = "outgoing"
[acceptance]
arf_hz = { lower = 142, upper = 155 }
"""


class Unit:
    """What stands on the bench."""

    def __init__(self) -> None:
        self.inertia = GOOD
        self.wait_s = 0.0
        self.is_dead = False
        unit = load_unit("adss")
        self._answers = {
            inertia: drivetrain_with(unit.with_parameters(J_L=inertia), 0.4, ()).system().transfer
            for inertia in (GOOD, BAD)
        }

    def __call__(self, hz: float) -> complex:
        time.sleep(self.wait_s)
        if self.is_dead or hz <= 0.0:
            return 1e-9 + 0j
        return complex(self._answers[self.inertia](np.array([hz]))[0])


class LineBench:
    """A folder with recipe, limits and history, and an analyser served on a socket."""

    def __init__(self, folder: Path, address: str, unit: Unit, instrument) -> None:
        self.folder, self.address, self.unit, self.instrument = folder, address, unit, instrument
        self.db, self.out = folder / "bench.db", folder / "results.jsonl"
        (folder / "recipe.toml").write_text(RECIPE)
        (folder / "limits.toml").write_text(LIMITS)

    def words(self, *words: str) -> list:
        """The verb with what every line of this bench has."""
        return [
            "line", "--recipe", self.folder / "recipe.toml", "--judge",
            self.folder / "limits.toml", "--instrument", self.address, "--db", self.db, "--yes",
            *words,
        ]  # fmt: skip

    def start(self, *words: str) -> subprocess.Popen:
        """The program, waiting for serial numbers."""
        command = [sys.executable, "-m", "tui.cli", *self.words("--out", self.out, *words)]
        return subprocess.Popen(
            list(map(str, command)), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True, bufsize=1,
        )  # fmt: skip

    def scan(self, process: subprocess.Popen, text: str, inertia: float = GOOD) -> str:
        """Put a unit on the bench and scan it; its label."""
        self.unit.inertia = inertia
        process.stdin.write(f"{text}\n")
        return process.stdout.readline()

    def kill_in_mid_unit(self, process: subprocess.Popen, text: str, inertia: float) -> None:
        """Scan a unit, and kill the program while the unit is swept."""
        number = self.measurements() + 1
        self.unit.inertia, self.unit.wait_s = inertia, 0.05
        process.stdin.write(f"{text}\n")
        wait_until(lambda: 2 < self.points(number) < 18)
        os.kill(process.pid, signal.SIGKILL)
        process.communicate()
        self.unit.wait_s = 0.0

    def measurements(self) -> int:
        """How many the history has; none while it is being made."""
        try:
            with Store(self.db, read_only=True) as store:
                return store.count()
        except (FileFormatError, InputError):
            return 0

    def points(self, number: int) -> int:
        """How many points a measurement has."""
        if self.measurements() < number:
            return 0
        with Store(self.db, read_only=True) as store:
            return len(store.points(number))

    def results(self) -> list[dict]:
        """Every result, first to last."""
        return [json.loads(line) for line in self.out.read_text().splitlines()]

    @property
    def drives(self) -> bool:
        """Whether the source is on."""
        return drives(self.instrument)


@contextmanager
def line_bench(folder: Path):
    """A bench with the analyser served as long as the block lasts."""
    unit = Unit()
    instrument = linear_analyser(unit, noise_v=1e-5)
    with served(instrument) as address:
        yield LineBench(folder, address, unit, instrument)


def wait_until(is_so, bound_s: float = 300.0) -> None:
    """Look until something is so."""
    deadline_s = time.monotonic() + bound_s
    while not is_so():
        assert time.monotonic() < deadline_s, "it never came to be"
        time.sleep(0.02)


def ended(process: subprocess.Popen) -> tuple[int, str, str]:
    """End the input and wait; exit code, stdout and stderr."""
    out, err = process.communicate(timeout=300)
    return process.returncode, out, err
