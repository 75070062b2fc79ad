"""One run of the fault campaign: start it, disturb it, judge it, and go on where it ended.

The simulated analyser lives here, where the truth of its source can be looked
at; the measuring program is a child (`fault_child`). Five things are judged:
no told point is lost or changed, nothing waits beyond its bound, the source is
what is said of it, every unflagged point is right, and the measurement can be
resumed to its end.
"""

from __future__ import annotations

import os
import random
import signal
import socket
import tempfile
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fault_bench import fault_child
from fault_bench.fault_bench import Child, Programs, Served
from fault_bench.fault_beside import Beside
from fault_bench.fault_cases import LEVELS_VPK, Case
from worlds.frozen_files import Freezer, freezer_of

from daq.errors import LashbenchError
from daq.frf import PointFlag
from daq.session.bench_lock import BenchLock
from daq.store import Store

END_S = 60.0
"""Bound of a session, time limits shortened as in `fault_child.shorten_waits`; the time in which
program or instrument was ready and got no processor is the machine's and does not count."""
LASTING_END_S = 240.0
"""The same where the fault strikes at every reply: each is waited for, and none for ever."""
OFF_S = 60.0
"""Bound from the end of a killed program to the source off and the bench free again."""
DIES = ("kill", "kill-both", "birth", "stopped")
"""Disturbances after which a program may end without a word: a stopped one may be ended by its
watchdog, where it keeps the wire."""
SPOILS = int(PointFlag.OVERLOAD | PointFlag.SPOILT)
_COLLEAGUES = b"This is a colleague's.\n"
_RESUMES = 3
"""Sessions within which a measurement must be complete once everything is mended; a starved
machine may lose one to a time-out."""


@dataclass
class Outcome:
    """How a run went; `wrongs` is empty where every promise was kept."""

    case: Case
    code: int | None = None
    """Exit code; None for a program that was killed."""
    said: str = ""
    source: str = ""
    """What was said of the source, at last in the history."""
    kept: int = 0
    fault_struck: bool = False
    disturbed: bool = False
    """Whether the moment of the disturbance came before the end."""
    resumes: int = 0
    """Further sessions that it took to complete the measurement."""
    elapsed_s: float = 0.0
    """How long the disturbed session took."""
    starved_s: float = 0.0
    """How much of that the program, or the instrument, was ready and got no processor."""
    off_after_s: float | None = None
    """From the end of the program to the source off; None if it was cut off from it."""
    stopped_s: float | None = None
    """From the stop of the program to the source off by its watchdog."""
    wrongs: list[str] = field(default_factory=list)


class Campaign:
    """Many runs, with measuring programs from one fork server."""

    def __init__(self) -> None:
        self.programs = Programs()

    def run(self, case: Case) -> Outcome:
        """One run, in a folder of its own."""
        with tempfile.TemporaryDirectory(prefix="faults-") as folder:
            run = Run(self.programs, case, Path(folder))
            try:
                run.go()
            except Exception as error:  # one run must not end the campaign
                run.wrong(f"the campaign itself failed: {type(error).__name__}: {error}")
            return run.outcome


class Run:
    """A case, from its instrument to its outcome."""

    def __init__(self, programs: Programs, case: Case, folder: Path) -> None:
        self._programs = programs
        self._case = case
        self._chance = random.Random(case.seed)
        self._db = folder / ("disk" if case.disturbance == "full-disk" else ".") / "bench.db"
        self._db.parent.mkdir(exist_ok=True)
        self._folder = folder
        self.instrument, self._board = fault_child.instrument_of(case.fault, case.driver)
        self._served: Served | None = None
        self._freezer: Freezer | None = None
        self.outcome = Outcome(case)

    def wrong(self, what: str) -> None:
        """A promise was broken."""
        self.outcome.wrongs.append(what)

    def go(self) -> None:
        """The whole run."""
        try:
            if self._case.wire != "loopback":
                self._served = Served(self.instrument, self._case.wire, self._case.driver)
            child = self._first()
            if self._case.disturbance == "full-disk" and not self._db.exists():
                self._db = self._folder / "bench.db"
            self.judge_end(child)
            self.judge_points(child.measurement, child.told)
            self._mend_lock()
            self._resume(child)
        finally:
            if self._freezer is not None:
                self._freezer.end()
            if self._served is not None:
                self._served.unplug()

    # ------------------------------------------------------------ the disturbed session

    def _first(self) -> Child:
        self._spoil_lock()
        child = self._started_held() if "frozen" in self._kind else self._start(0, plain=False)
        bound_s = LASTING_END_S if "times=0" in (self._case.fault or "") else END_S
        watch, struck = Stopwatch(child, self._served), False
        beside = Beside(
            self._case, self._db, self._served, lambda: self._start(0, plain=True), self.wrong
        )
        beside.child, beside.freezer = child, self._freezer
        with ExitStack() as stack:
            while child.listen(0.05):
                if not struck and child.measurement and len(child.told) >= self._case.after:
                    struck = True
                    stack.enter_context(beside.going_on())
                if self._case.disturbance == "suspend":
                    self._wake(child, self._chance.choice((0.1, 0.5, 2.5)))
                if self._kind == "stopped":
                    self._wake_late(child, watch)
                if child.verdict is not None:
                    break
                if watch.own_s() > bound_s:
                    self.wrong(f"did not end within {bound_s:g} s")
                    break
            self.outcome.elapsed_s, self.outcome.starved_s = watch.elapsed_s(), watch.starved_s
        child.end()
        if self._freezer is not None:
            self._freezer.thaw()
        if child.verdict is None and self._kind not in DIES:
            self.wrong("ended without a word")
        return child

    @property
    def _kind(self) -> str:
        return self._case.disturbance or ""

    def _started_held(self) -> Child:
        """A program whose file system can be frozen."""
        with socket.socket(socket.AF_UNIX) as gate:
            gate.bind(str(self._folder / fault_child.SOCKET))
            gate.listen(1)
            gate.settimeout(60.0)
            child = self._start(0, plain=False)
            wire, _ = gate.accept()
            with wire:
                self._freezer = freezer_of(wire, self._folder)
        return child

    def _spoil_lock(self) -> None:
        """Something of a colleague's lies where the lock goes."""
        self._lock = self._db.with_name(self._db.name + "-lock")
        self._colleagues = self._folder / "colleagues.txt"
        self._colleagues.write_bytes(_COLLEAGUES)
        if self._kind == "lock-link":
            self._lock.symlink_to(self._colleagues)
        elif self._kind == "lock-foreign":
            self._lock.write_bytes(_COLLEAGUES)

    def _mend_lock(self) -> None:
        if self._colleagues.read_bytes() != _COLLEAGUES:
            self.wrong("a colleague's file was written over")
        if self._kind not in ("lock-link", "lock-foreign"):
            return
        if self._lock.is_symlink() != (self._kind == "lock-link"):
            self.wrong("what lay in place of the lock was replaced")
        elif self._lock.read_bytes() != _COLLEAGUES:
            self.wrong("what lay in place of the lock was written over")
        if self.outcome.code != 2:
            self.wrong(f"something in place of the lock gave {self.outcome.code}")
        self._lock.unlink(missing_ok=True)

    def _start(self, resume: int, *, plain: bool) -> Child:
        lead = f"{self._case.driver}:" if self._case.driver else ""
        url = f"{lead}sim:" if self._served is None else self._served.url
        return self._programs.start(url, str(self._db), resume, self._case, plain)

    def _wake(self, child: Child, after_s: float) -> None:
        if self._is_stopped(child):
            time.sleep(after_s)
            with suppress(OSError):
                os.kill(child.pid, signal.SIGCONT)

    def _wake_late(self, child: Child, watch: Stopwatch) -> None:
        """Once the watchdog has switched the source off, which it must."""
        if not self._is_stopped(child):
            return
        began, drove = time.monotonic(), self._drives()
        while self._drives() and time.monotonic() - began < OFF_S:
            time.sleep(0.02)
        if self._drives() and not self.instrument.damage.dead:
            self.wrong(f"the source still drives {OFF_S:g} s after the program was stopped")
        self.outcome.stopped_s = time.monotonic() - began if drove else None
        watch.leave_out(time.monotonic() - began)
        self._wake(child, 0.5)

    @staticmethod
    def _is_stopped(child: Child) -> bool:
        with suppress(OSError):
            place = Path(f"/proc/{child.pid}/stat")
            return place.read_text(encoding="ascii").rsplit(")", 1)[1].split()[0] == "T"
        return False

    # ------------------------------------------------------------ judging

    def judge_end(self, child: Child) -> None:
        outcome, verdict = self.outcome, child.verdict
        self._note_strikes(child)
        if verdict is None:
            self._judge_killed(child)
            return
        outcome.code, outcome.said = verdict["code"], verdict["said"]
        outcome.source = verdict["source"]
        if outcome.code == -1:
            self.wrong(f"{verdict['kind']} went through: {outcome.said}")
        if "\n" in outcome.said or (outcome.code not in (0, 130) and not outcome.said):
            self.wrong(f"said, in more or fewer than one line: {outcome.said!r}")
        is_on = verdict["driving"] if verdict["driving"] is not None else self._drives()
        if outcome.source == "confirmed-off" and is_on:
            self.wrong("the source was called off and drives")
        reachable = self._case.disturbance != "unplugged" and not self.instrument.damage.dead
        if is_on and reachable and outcome.source not in ("unknown", "unconfirmed", "on"):
            self.wrong(f"the source drives and was called {outcome.source!r}")
        if not is_on:
            outcome.off_after_s = 0.0

    def _judge_killed(self, child: Child) -> None:
        """The watchdog, or without it the next session, has to see to the source."""
        began = time.monotonic()
        if self._case.disturbance == "kill-both":
            return
        while self._drives() and time.monotonic() - began < OFF_S:
            time.sleep(0.005)
        reachable = not self.instrument.damage.dead
        if not self._drives():
            self.outcome.off_after_s = time.monotonic() - began
        elif reachable:
            self.wrong(f"the source still drives {OFF_S:g} s after the program was killed")
        try:
            BenchLock(self._db, patience_s=OFF_S).release()
        except LashbenchError as error:
            self.wrong(f"the bench is not free again: {error}")
        self.outcome.source = self._recorded(child.measurement)
        if self.outcome.source == "confirmed-off" and self._drives():
            self.wrong("the history calls the source off and it drives")

    def _recorded(self, measurement: int) -> str:
        if not measurement:
            return ""
        with Store(self._db, read_only=True) as store:
            return store.measurement(measurement).source_state.value

    def _drives(self) -> bool:
        return fault_child.drives(self.instrument)

    def _note_strikes(self, child: Child) -> None:
        faults = any(fault.struck for fault in self._board.faults)
        verdict = child.verdict
        self.outcome.fault_struck = faults or (verdict is not None and verdict["struck"])
        came = child.measurement > 0 and len(child.told) >= self._case.after
        dies = self._kind in ("kill", "kill-both", "birth")
        self.outcome.disturbed = came and not (dies and verdict is not None)
        if self._kind in ("lock-link", "lock-foreign", "foreign-cache"):
            self.outcome.disturbed = True

    def judge_points(self, measurement: int, told: list[Any]) -> None:
        if not measurement:
            return
        with Store(self._db) as store:
            kept = {point.id: point for point in store.points(measurement, superseded=True)}
        self.outcome.kept = max(self.outcome.kept, len(kept))
        for number, level, hz, gain, flags in told:
            point = kept.get(number)
            if point is None:
                self.wrong(f"the point at {hz:g} Hz and {level:g} V peak was told and is lost")
            elif not _same(point.point.gain, gain) or int(point.point.flags) != flags:
                self.wrong(f"the point at {hz:g} Hz and {level:g} V peak was told otherwise")
        for point in kept.values():
            true = fault_child.true_gain(point.point.frequency_hz, point.source_vpk)
            if not int(point.point.flags) & SPOILS and not abs(
                point.point.gain - true
            ) <= 1e-4 * abs(true):
                self.wrong(
                    f"the point at {point.requested_hz:g} Hz and {point.source_vpk:g} V peak "
                    f"is wrong by a factor of {abs(point.point.gain / true):.4g} and not flagged"
                )

    # ------------------------------------------------------------ the next start

    def _resume(self, first: Child) -> None:
        """Whatever was broken is mended; the measurement goes on to its end."""
        self._board.disarm()
        # RS-232 has no device clear: whose parser hangs there is switched off and on by hand.
        hangs = self._case.wire == "serial_pty" and self.instrument.damage.parser_stuck
        if self.instrument.damage.dead or hangs or self._case.fault_name == "missing-option":
            self.instrument, self._board = fault_child.instrument_of(None, self._case.driver)
        if self._served is not None:
            self._served.unplug()
            self._served = Served(self.instrument, self._case.wire, self._case.driver)
        measurement, told = first.measurement, list(first.told)
        for number in range(1, _RESUMES + 1):
            self.outcome.resumes = number
            child = self._go_on(measurement)
            measurement = child.measurement or measurement
            told += child.told
            verdict = child.verdict or {"code": None, "said": "nothing", "source": ""}
            if verdict["code"] == 0:
                break
        else:
            self.wrong(f"going on ended with {verdict['code']}: {verdict['said']}")
        if verdict["code"] == 0 and verdict["source"] != "confirmed-off":
            self.wrong(f"after going on the source is {verdict['source']}")
        if self._served is not None and self._drives():
            self.wrong("the source drives after the next session")
        self.judge_points(measurement, told)
        total = len(LEVELS_VPK) * self._case.points
        with Store(self._db) as store:
            if measurement and len(store.points(measurement)) != total:
                self.wrong(f"{len(store.points(measurement))} of {total} points after going on")

    def _go_on(self, measurement: int) -> Child:
        child = self._start(measurement, plain=True)
        watch = Stopwatch(child, self._served)
        while child.verdict is None and child.listen(0.1):
            if watch.own_s() > 2 * END_S:
                self.wrong(f"going on did not end within {2 * END_S:g} s")
                break
        child.end()
        return child


class Stopwatch:
    """Times a program, without the time in which there was no processor for it."""

    def __init__(self, child: Child, served: Served | None) -> None:
        self._parts = [part for part in (child, served) if part is not None]
        self._began = time.monotonic()
        self._last = [part.starved_s() for part in self._parts]
        self._waited = [0.0] * len(self._parts)
        self._left_out_s = 0.0

    def elapsed_s(self) -> float:
        """By the clock."""
        return time.monotonic() - self._began

    @property
    def starved_s(self) -> float:
        """How long the one of the two that waited longer has waited: they do so side by side."""
        return max(self._waited)

    def own_s(self) -> float:
        """By the clock, less what the machine owed it."""
        for number, part in enumerate(self._parts):
            waited = part.starved_s()
            # What ends takes its account with it.
            self._waited[number] += max(0.0, waited - self._last[number])
            self._last[number] = waited
        return self.elapsed_s() - self.starved_s - self._left_out_s

    def leave_out(self, seconds: float) -> None:
        """Time in which the program was kept from running on purpose."""
        self._left_out_s += seconds


def _same(one: complex, other: complex) -> bool:
    return one == other or (one != one and other != other)
