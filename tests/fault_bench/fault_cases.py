"""What may go wrong in one run of the fault campaign, drawn at random; nothing is done here.

A case is a driver and a wire, a fault of the instrument, a disturbance on this side, or
both at once. The first cases go through every fault and every disturbance once on every wire
of every driver that it can strike, and every fault in every phase; the rest are drawn.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

from sim.faults import PHASES
from sim.models import model_of, models

WIRES = ("loopback", "tcp", "prologix_tcp", "prologix_pty", "ar488_pty")
BENCHES = tuple(
    (model.scheme, wire)
    for model in models()
    for wire in WIRES + (("serial_pty",) if model.has_serial else ())
)
"""Schemes of drivers, each with every wire that its instrument has."""
GATEWAYS = ("vxi11", "hislip")
GATEWAY_BENCHES = tuple((model.scheme, wire) for model in models() for wire in GATEWAYS)
"""The same behind LAN gateways, which are drawn for themselves: a seed keeps its other runs."""
LEVELS_VPK = (1.0, 2.0)
_POINTS, _MORE_POINTS = 7, 11
_TRIAL_POINTS = 12
"""Points that other drivers than the preset may take for the trial point."""

DISTURBANCES = {
    "sigint": "Ctrl-C",
    "sigterm": "SIGTERM",
    "sighup": "SIGHUP, the terminal is closed",
    "kill": "kill -9 of the program",
    "kill-both": "kill -9 of the program and of its watchdog",
    "suspend": "SIGSTOP, and SIGCONT a while later",
    "stopped": "SIGSTOP, and SIGCONT when the watchdog took over",
    "watchdog": "kill -9 of the watchdog",
    "birth": "`daq` and `numpy.py` in the working directory and on PYTHONPATH; kill -9",
    "frozen": "the file system of the database does not answer any more",
    "frozen-sigterm": "the same, and SIGTERM",
    "lock-link": "a link to somebody's file lies in place of the lock",
    "lock-foreign": "somebody's file lies in place of the lock",
    "foreign-cache": "others may write into the cache folder, and did",
    "full-disk": "the disk is full (a small tmpfs; a file size limit where none can be mounted)",
    "file-limit": "a limit on the size of files (RLIMIT_FSIZE)",
    "read-only": "the database may suddenly not be written",
    "held-briefly": "another program holds the database for a moment",
    "held-long": "another program holds the database for longer than is waited",
    "reader": "another program reads the database all the time",
    "second-session": "a second session is started on the same database",
    "clock-jumps": "the clock jumps by days at every look",
    "unplugged": "the wire is gone for good until the next start",
    "intruder": "another program talks to the instrument in between",
}
NEEDS_WIRE = {"kill", "kill-both", "birth", "stopped", "watchdog", "unplugged", "intruder"}
"""What makes no sense where instrument and program are one process."""

RUNS_INTO_TIME_LIMITS = ("silence", "slow-reply", "lost-power", "adapter-reset")
_SECONDS = {
    "silence": (0.3, 2.0, 1e6),
    "slow-reply": (0.2, 0.8, 3.0),
    "lost-power": (0.3, 1.5),
    "adapter-reset": (0.3, 1.5),
}


@dataclass(frozen=True)
class Case:
    """One run."""

    number: int
    driver: str
    """Scheme of the driver."""
    wire: str
    fault: str | None
    """As `sim.faults.parse_fault` reads it."""
    disturbance: str | None
    after: int
    """Points told before the disturbance strikes."""
    delay_s: float
    """How long after the last of them."""
    seed: int
    """Of whatever else the run draws."""

    @property
    def fault_name(self) -> str | None:
        """Without its parameters."""
        return self.fault.partition(":")[0] if self.fault else None

    @property
    def points(self) -> int:
        """Of each level; enough for a sweep that the instrument runs by itself."""
        return points_of(self.driver)

    def __str__(self) -> str:
        parts = [self.driver or "preset", self.wire]
        if self.fault:
            parts.append(self.fault)
        if self.disturbance:
            parts.append(f"{self.disturbance} after {self.after} points + {self.delay_s:.3f} s")
        return f"{self.number}: " + ", ".join(parts)


def points_of(driver: str) -> int:
    """Points of each level in the plan."""
    return _MORE_POINTS if driver else _POINTS


def draw_cases(count: int, seed: int, gateways: int = 0) -> Iterator[Case]:
    """So many cases, and so many more behind gateways; the same for the same seed."""
    yield from _drawn(BENCHES, range(1, count + 1), random.Random(seed))
    numbers = range(count + 1, count + gateways + 1)
    yield from _drawn(GATEWAY_BENCHES, numbers, random.Random(seed + 1))


_Benches = tuple[tuple[str, str], ...]


def _drawn(benches: _Benches, numbers: range, chance: random.Random) -> Iterator[Case]:
    wanted = _every_one_once(benches)
    chance.shuffle(wanted)
    for number in numbers:
        kind = wanted.pop() if wanted else _any(benches, chance)
        driver, wire, name, phase, disturbance = kind
        yield Case(
            number=number,
            driver=driver,
            wire=wire,
            fault=None if name is None else _fault(driver, name, phase, chance),
            disturbance=disturbance,
            after=chance.randrange(0, 2 * points_of(driver)),
            delay_s=chance.choice((0.0, chance.uniform(0.0, 0.03), chance.uniform(0.0, 0.3))),
            seed=chance.randrange(1 << 30),
        )


_Kind = tuple[str, str, str | None, str | None, str | None]


def _every_one_once(benches: _Benches) -> list[_Kind]:
    faults: list[_Kind] = []
    for place, (driver, wire) in enumerate(benches):
        for number, name in enumerate(model_of(driver).faults):
            faults.append((driver, wire, name, PHASES[(place + number) % len(PHASES)], None))
    others = [
        (driver, wire, None, None, one)
        for (driver, wire), one in product(benches, DISTURBANCES)
        if can_strike(one, wire)
    ]
    return [*faults, *others]


def can_strike(disturbance: str, wire: str) -> bool:
    """Whether the disturbance makes sense on that wire."""
    return wire != "loopback" or disturbance not in NEEDS_WIRE


def _any(benches: _Benches, chance: random.Random) -> _Kind:
    driver, wire = chance.choice(benches)
    disturbance = chance.choice([d for d in DISTURBANCES if can_strike(d, wire)])
    kind = chance.choice(("fault", "disturbance", "both"))
    name = None if kind == "disturbance" else chance.choice(list(model_of(driver).faults))
    return driver, wire, name, chance.choice(PHASES), None if kind == "fault" else disturbance


def _fault(driver: str, name: str, phase: str | None, chance: random.Random) -> str:
    if name in ("missing-option", "calibration-failure"):  # these know one moment only
        return name
    point = 0 if phase == "prepare" else chance.randrange(1, 2 * points_of(driver) + 1)
    point += _TRIAL_POINTS if driver and point else 0
    words = [f"phase={phase}", f"point={point}", f"times={chance.choice((1, 1, 1, 2, 0))}"]
    words.append(f"skip={chance.choice((0, 0, chance.randrange(40)))}")
    if name in _SECONDS:
        words.append(f"seconds={chance.choice(_SECONDS[name])}")
    if model_of(driver).faults[name].size is not None:
        words.append(f"size={chance.randrange(1, 40)}")
    return f"{name}:{','.join(words)}"
