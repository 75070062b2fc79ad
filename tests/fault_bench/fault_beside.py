"""What is done to a running session from outside: other programs, and the wire itself.

Each act runs beside the session and ends with it. What the measuring program
does to itself (signals, disk, clock) is `fault_child`'s part.
"""

from __future__ import annotations

import os
import random
import signal
import socket
import sqlite3
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from fault_bench.fault_bench import Child, Served
from fault_bench.fault_cases import Case
from fault_bench.fault_child import BUSY_S
from worlds.frozen_files import Freezer

from daq.store import Store

_SECOND_S = 30.0
_MEDDLING = {"": (
    b"*IDN?", b"SOUR:VOLT 4 VPK", b"SOUR:VOLT?", b"*RST", b"SYST:PRES", b"ABOR", b"*CLS",
    b"INST:SEL FFT", b"SOUR:VOLT:OFFS 2", b"SYST:ERR?", b"FREQ:MAN 60", b"INIT:CONT ON",
    b"\xff\x00garbage", b"CALC1:DATA?", b"STAT:QUES:VOLT?", b"*SRE 255", b"FORM:DATA ASC",
    b"SWE:CYCL 1", b"SOUR:VOLT 0 VPK",
), "sr785": (
    b"*IDN?", b"SSAM 4000 mV", b"SSAM?", b"*RST", b"PAUS", b"STRT", b"CONT", b"*CLS", b"MGRP 2,0",
    b"SOFF 2 V", b"*ESR?", b"SSTR 2,60 Hz", b"SRPT 2,1", b"\xff\x00garbage", b"DSPY? 0", b"INPS?",
    b"*SRE 255", b"PSDU 2,1", b"SNPS 2,30", b"SSAM 0 mV", b"SRCO 0", b"OUTX 1", b"DISP 2,0",
    b"MEAS 0,44", b"VIEW 1,0", b"SSAL 2", b"SARS 2,1", b"DSPS?", b"SSTY 2,1",
), "sampled": (
    b"*IDN?", b"SOUR:VOLT 4", b"SOUR:VOLT?", b"*RST", b"ACQ:HALT", b"*CLS", b"SOUR:OFFS 2",
    b"SOUR:NOW?", b"*ESR?", b"\xff\x00garbage", b"SOUR:VOLT 0", b"SOUR:OFFS 0",
)}  # fmt: skip
"""What another program may say to the instrument of each driver."""
_ANY = (b"*IDN?", b"*RST", b"*CLS", b"*ESR?", b"*SRE 255", b"\xff\x00garbage", b"?", b"*OPC")
"""The same, to one of which nothing is known."""


class Beside:
    """The acts of one run.

    Parameters
    ----------
    start_second
        Starts another session on the same history.
    """

    def __init__(
        self,
        case: Case,
        db: Path,
        served: Served | None,
        start_second: Callable[[], Child],
        wrong: Callable[[str], None],
    ) -> None:
        self._db = db
        self._served = served
        self._start_second = start_second
        self._wrong = wrong
        self._delay_s = case.delay_s
        self._meddling = _MEDDLING.get(case.driver, _ANY)
        self._chance = random.Random(case.seed)
        self._over = threading.Event()
        self.child: Child | None = None
        self.freezer: Freezer | None = None
        acts: dict[str, Callable[[], None]] = {
            "unplugged": self._unplug,
            "intruder": self._meddle,
            "second-session": self._second,
            "held-briefly": lambda: self._hold(BUSY_S * 0.3),
            "held-long": lambda: self._hold(BUSY_S * 4.0),
            "reader": self._read,
            "frozen": self._freeze,
            "frozen-sigterm": self._freeze,
        }
        self._signals = case.disturbance == "frozen-sigterm"
        self._act = acts.get(case.disturbance or "")

    @contextmanager
    def going_on(self) -> Iterator[None]:
        """The act begins, and ends at the latest with the block."""
        if self._act is None:
            yield
            return
        thread = threading.Thread(target=self._act)
        thread.start()
        try:
            yield
        finally:
            self._over.set()
            thread.join()

    def _unplug(self) -> None:
        assert self._served is not None
        self._served.unplug()

    def _freeze(self) -> None:
        """Nothing in the folder answers; a signal comes a little later, or not at all."""
        assert self.freezer is not None
        time.sleep(self._delay_s)
        self.freezer.freeze()
        if self._signals and self.child is not None and not self._over.wait(0.3):
            with suppress(OSError):
                os.kill(self.child.pid, signal.SIGTERM)

    def _meddle(self) -> None:
        """Another program says this and that, over the raw wire."""
        assert self._served is not None
        time.sleep(self._delay_s / 10.0)
        with suppress(OSError), socket.create_connection(self._served.raw, 2.0) as wire:
            wire.settimeout(0.05)
            for _ in range(self._chance.randrange(1, 4)):
                if self._over.is_set():
                    return
                wire.sendall(self._chance.choice(self._meddling) + b"\n")
                with suppress(TimeoutError):
                    wire.recv(100)

    def _second(self) -> None:
        """A session on the same database is refused before it touches the instrument."""
        began = time.monotonic()
        second = self._start_second()
        while second.verdict is None and second.listen(0.1):
            if time.monotonic() - began > _SECOND_S:
                break
        verdict = second.verdict or {"code": None, "said": "nothing"}
        second.end()
        if self._over.is_set():
            return  # the first was over before, or while, the second began
        if verdict["code"] != 1 or "another session" not in verdict["said"]:
            self._wrong(f"a second session ended with {verdict['code']}: {verdict['said']}")

    def _hold(self, seconds: float) -> None:
        with closing(sqlite3.connect(self._db, isolation_level=None, timeout=5.0)) as other:
            other.execute("BEGIN IMMEDIATE")
            self._over.wait(seconds)
            other.execute("ROLLBACK")

    def _read(self) -> None:
        while not self._over.is_set():
            with Store(self._db, read_only=True) as store:
                for found in store.measurements():
                    store.points(found.id)
                    store.events(found.id)
            time.sleep(0.005)
