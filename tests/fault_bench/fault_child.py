"""The measuring program of one run of the fault campaign, in a process of its own.

It measures as the command line does, tells each record to whoever started it
before it goes on, and does to itself what the case asks for. It must be
importable without side effects: the campaign's fork server preloads it.
"""

from __future__ import annotations

import ctypes
import os
import random
import resource
import shutil
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from contextlib import closing, suppress
from datetime import UTC, datetime, timedelta
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from fault_bench.fault_cases import LEVELS_VPK, Case
from instruments.bench_server import simulated
from instruments.fake_analyser import known_gain
from worlds.frozen_files import hold

from daq.control import SessionControl
from daq.drivers import driver_at
from daq.errors import LashbenchError
from daq.session_events import Finished, Opened, PointStored
from sim.instrument.plant import LinearPlant, PlantDwell
from sim.loopback import Loopback
from sim.unit import load_unit
from tui.bench import bench_session
from tui.measure_options import PlanOptions, session_request
from tui.signals import listening

BUSY_S = 1.0
_SHORT = {"_BUDGET_S": 4.0, "_RESET_S": 4.0}
_SHORT_TIMING = {"reply_s": 1.0, "block_s": 1.5, "overhead_s": 3.0, "point_s": 0.1}
SOCKET = "freezer"
"""Where a program hands its file system over to whoever may freeze it."""
_SIGNALS = {
    "sigint": signal.SIGINT,
    "sigterm": signal.SIGTERM,
    "sighup": signal.SIGHUP,
    "kill": signal.SIGKILL,
    "birth": signal.SIGKILL,
    "suspend": signal.SIGSTOP,
    "stopped": signal.SIGSTOP,
}


class Graded:
    """A device whose gain depends on the level as well, so that a wrong level shows in a point."""

    def dwell(self, frequency_hz, source_vpk, offset_v, settle_cycles, integrate_cycles):
        plant = LinearPlant(lambda hz: true_gain(hz, source_vpk) if hz else 0.0)
        dwell: PlantDwell = plant.dwell(
            frequency_hz, source_vpk, offset_v, settle_cycles, integrate_cycles
        )
        return dwell


def true_gain(frequency_hz: float, source_vpk: float) -> complex:
    """What a right point holds."""
    return known_gain(frequency_hz) * (1.0 + 0.1 * source_vpk)


def instrument_of(fault: str | None, driver: str = "") -> tuple[Any, Any]:
    """A noiseless instrument with the device behind it, and the board of its faults."""
    instrument = simulated(driver, Graded(), [fault] if fault else [])
    return instrument, instrument.faults


def drives(instrument: Any) -> bool:
    """What is true of the source, whatever anybody says of it."""
    return instrument.driven_v > 0.0


def preload() -> None:
    """Touch what is slow the first time, before forking."""
    load_unit("adss")
    np.isfinite(1.0)


def measure(pipe: Any, url: str, db: str, resume: int, case: Case, plain: bool) -> None:
    """Run one session; `plain` ones go without the case's disturbance."""
    shorten_waits()
    disturbance = None if plain else case.disturbance
    place = Path(db)
    surround(disturbance, place.parent)
    pipe.send(("started", os.getpid()))
    if disturbance == "full-disk":
        small_disk(place.parent)
    trouble = Trouble(disturbance, case, place, pipe)
    unit, instrument, board = load_unit("adss"), None, None
    if case.wire == "loopback":
        instrument, board = instrument_of(None if plain else case.fault, case.driver)
        replace_instrument(instrument)
    began, finished, error = time.monotonic(), None, None
    control = SessionControl()
    try:
        request = session_request(
            PlanOptions() if resume else options(case.points), "adss", unit, url, place,
            recipe=None, bench="default", resume=resume or None, remeasure=None, run_in=None,
            remarks={"serial": "", "operator": "", "notes": ""},
        )  # fmt: skip
        with (
            listening(control, lambda line: None),
            closing(bench_session(url, unit, place, request, control)) as events,
        ):
            for event in events:
                match event:
                    case Opened():
                        pipe.send(("opened", event.measurement))
                        trouble.begin()
                    case PointStored():
                        pipe.send(("told", _told(event)))
                        trouble.told()
                    case Finished():
                        finished = event
    except BaseException as fault:  # everything is judged by whoever started this
        error = fault
    elapsed_s = time.monotonic() - began
    trouble.end()
    verdict = _verdict(finished, error, elapsed_s)
    verdict["driving"] = None if instrument is None else drives(instrument)
    verdict["struck"] = board is not None and any(fault.struck for fault in board.faults)
    pipe.send(("ended", verdict))
    pipe.close()


def surround(disturbance: str | None, folder: Path) -> None:
    """What the program finds about it when it begins."""
    if disturbance in ("frozen", "frozen-sigterm"):
        with socket.socket(socket.AF_UNIX) as wire:
            wire.connect(str(folder / SOCKET))
            hold(wire)
    elif disturbance == "birth":
        beside = folder / "beside"
        (beside / "daq").mkdir(parents=True)
        for place in (beside / "daq" / "__init__.py", beside / "numpy.py"):
            place.write_text("raise SystemExit('not the one')", encoding="ascii")
        os.chdir(beside)
        os.environ["PYTHONPATH"] = f".{os.pathsep}{beside}"
    elif disturbance == "foreign-cache":
        cache = folder / "cache" / "lashbench"
        cache.mkdir(parents=True)
        for place in (cache.parent, cache):
            place.chmod(0o777)
        (cache / "index.code").write_bytes(b"not the one")
        os.environ["XDG_CACHE_HOME"] = str(cache.parent)


def _told(event: PointStored) -> tuple[int, float, float, complex, int]:
    stored = event.stored
    point = stored.point
    return stored.id, stored.source_vpk, stored.requested_hz, point.gain, int(point.flags)


def _verdict(
    finished: Finished | None, error: BaseException | None, elapsed_s: float
) -> dict[str, Any]:
    if isinstance(error, LashbenchError):
        code = error.exit_code
    elif error is not None:
        code = -1
    else:
        code = 0 if finished is not None and finished.state == "complete" else 130
    return {
        "code": code,
        "kind": type(error).__name__ if error is not None else "",
        "said": str(error) if error is not None else "",
        "state": finished.state if finished else "",
        "source": finished.source_state.value if finished else "",
        "elapsed_s": elapsed_s,
    }


def options(points: int) -> PlanOptions:
    """The plan of every run."""
    return PlanOptions(LEVELS_VPK, 130.0, 170.0, points, settle_cycles=3, integrate_cycles=4)


def shorten_waits() -> None:
    """The same outcomes as with the driver's own limits, sooner."""
    import daq.store.file

    for entry in Path(daq.__file__).parent.glob("*/driver.py"):
        _shorten_those_of(f"daq.{entry.parent.name}")
    daq.store.file._BUSY_S = BUSY_S


def _shorten_those_of(room: str) -> None:
    """Of one driver, where it has its limits under the names that the others have."""
    for part in ("analyser", "safe"):
        if find_spec(f"{room}.{part}") is None:
            continue
        module = import_module(f"{room}.{part}")
        for name, value in _SHORT.items():
            if hasattr(module, name):
                setattr(module, name, value)
        if timing := getattr(module, "Timing", None):
            own = timing.__dataclass_fields__
            chosen = {name: value for name, value in _SHORT_TIMING.items() if name in own}
            module.Timing = partial(timing, **chosen)


def replace_instrument(instrument: Any) -> None:
    """Let ``sim:`` mean this one."""
    import tui.bench

    tui.bench.connect = lambda url, unit, transcript=None, fault=None: driver_at(url)[0].drive(
        Loopback(instrument)
    )


class Trouble:
    """Does the disturbance of a case when its moment has come."""

    def __init__(self, name: str | None, case: Case, db: Path, pipe: Any) -> None:
        self._name = name
        self._case = case
        self._db = db
        self._pipe = pipe
        self._points = 0
        self._filler = db.parent / "filler"

    def begin(self) -> None:
        """The measurement is open."""
        if self._name == "clock-jumps":
            jump_clock(random.Random(self._case.seed))
        self._strike_if_due()

    def told(self) -> None:
        """A point was told."""
        self._points += 1
        self._strike_if_due()

    def _strike_if_due(self) -> None:
        if self._points != self._case.after or self._name is None:
            return
        acts: dict[str, Callable[[], None]] = {
            "full-disk": self._fill,
            "file-limit": self._limit,
            "read-only": forbid_writing,
            "kill-both": self._kill_both,
            "watchdog": self._kill_watchdog,
        }
        if number := _SIGNALS.get(self._name):
            acts[self._name] = lambda: os.kill(os.getpid(), number)
        act = acts.get(self._name)
        if act is None:
            return
        if self._name in ("full-disk", "file-limit", "read-only") or self._case.delay_s == 0.0:
            act()
            return
        timer = threading.Timer(self._case.delay_s, act)
        timer.daemon = True
        timer.start()

    def _kill_watchdog(self) -> None:
        for child in children_of(os.getpid()):
            os.kill(child, signal.SIGKILL)

    def _kill_both(self) -> None:
        self._kill_watchdog()
        os.kill(os.getpid(), signal.SIGKILL)

    def _fill(self) -> None:
        if not self._db.parent.is_mount():
            self._limit()
            return
        block = b"\0" * 4096
        with suppress(OSError), self._filler.open("wb", buffering=0) as file:
            while True:
                file.write(block)

    def _limit(self) -> None:
        # SIGXFSZ is ignored by Python, so the write fails, as on a full disk.
        log = self._db.with_name(self._db.name + "-wal")
        size = max(path.stat().st_size for path in (self._db, log) if path.exists())
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))

    def end(self) -> None:
        """Bring what is on a small disk where it can be looked at."""
        if self._filler.parent.is_mount():
            self._filler.unlink(missing_ok=True)
            for path in self._db.parent.iterdir():
                if path.is_file():
                    shutil.copy(path, self._db.parent.parent / path.name)


def jump_clock(chance: random.Random) -> None:
    """From now on the wall clock says anything within a year."""
    import daq.store

    def offset() -> float:
        return chance.uniform(-180.0, 180.0) * 86400.0

    class Jumping(datetime):
        @classmethod
        def now(cls, tz=None):
            return datetime.now(tz or UTC) + timedelta(seconds=offset())

    daq.store.store.datetime = Jumping
    honest = time.time
    time.time = lambda: honest() + offset()


def forbid_writing() -> None:
    """Every further write to any history meets SQLITE_READONLY, as on a disk gone read-only."""
    import gc
    import sqlite3

    for found in gc.get_objects():
        if isinstance(found, sqlite3.Connection):
            with suppress(sqlite3.Error):
                found.execute("PRAGMA query_only = ON")


def children_of(process: int) -> list[int]:
    """Processes started by one."""
    found = Path(f"/proc/{process}/task/{process}/children").read_text(encoding="ascii")
    return [int(word) for word in found.split()]


def small_disk(folder: Path) -> None:
    """A disk of 1 MiB at that folder, for this process alone; nothing where that is refused."""
    libc = ctypes.CDLL(None, use_errno=True)
    newns, newuser, private = 0x00020000, 0x10000000, (1 << 18) | (1 << 14)
    if libc.unshare(newns) and libc.unshare(newuser | newns):
        return
    libc.mount(None, b"/", None, private, None)
    libc.mount(b"none", os.fsencode(folder), b"tmpfs", 0, b"size=1m")


if __name__ == "__main__":
    sys.exit("this is a part of tests/campaigns/faults.py")
