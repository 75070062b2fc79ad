"""A controller on the simulated analyser's bus, for tests that look from outside."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from instruments.known_device import known_answer

from sim.analyser35670a import Analyser35670A, Choices, LinearPlant, TalkState
from sim.faults import FaultBoard, parse_fault

pytest.register_assert_rewrite("instruments.simulated_sr785")

SWEPT_SINE = (
    "INST:SEL SINE",
    "INIT:CONT OFF",
    "FREQ:RES:AUTO OFF",
    "FREQ:STAR 100 HZ",
    "FREQ:STOP 200 HZ",
    "FREQ:RES 5 PNT/SWP",
    "SWE:STIM 2 CYCLE",
    "SWE:DWEL 3 CYCLE",
    "SOUR:VOLT 1 VPK",
    "FORM REAL,64",
)


class Controller:
    """Writes, reads and lets time pass, and can look at nothing but the bus."""

    def __init__(self, instrument: Analyser35670A) -> None:
        self.instrument = instrument

    def write(self, *messages: str | bytes, end: bool = False) -> None:
        for message in messages:
            data = message if isinstance(message, bytes) else message.encode() + b"\n"
            while data:
                taken = self.instrument.listen(data, end)
                data = data[taken:]
                if not taken and not self.instrument.agenda.run_next():
                    raise AssertionError("the bus is stuck")

    def read(self, limit: int | None = None) -> bytes | None:
        """The reply, or None if the instrument has nothing to say."""
        reply = b""
        for _ in range(100_000):
            talk = self.instrument.talk(limit)
            reply += talk.data
            if talk.end:
                return reply
            if talk.state is TalkState.NOTHING:
                return None
            if talk.state is TalkState.WAITING and not self.instrument.agenda.run_next():
                return None
        raise AssertionError("no end of the reply")

    def ask(self, message: str) -> str | None:
        self.write(message)
        reply = self.read()
        return None if reply is None else reply.decode("latin-1").removesuffix("\n")

    def number(self, message: str) -> float:
        return float(self.ask(message) or "nan")

    def integer(self, message: str) -> int:
        return int(self.ask(message) or "no reply")

    def reals(self, message: str, kind: str = ">f8") -> np.ndarray:
        self.write(message)
        block = self.read() or b""
        digits = int(block[1:2])
        length = int(block[2 : 2 + digits])
        assert len(block) == 2 + digits + length + 1
        assert block.endswith(b"\n")
        return np.frombuffer(block[2 + digits : -1], dtype=kind)

    def complexes(self, message: str) -> np.ndarray:
        pairs = self.reals(message)
        return pairs[0::2] + 1j * pairs[1::2]

    def error(self) -> int:
        """Number of the oldest entry of the error queue."""
        return int((self.ask("SYST:ERR?") or "").split(",")[0])

    def errors(self) -> list[int]:
        """All of them, the queue left empty."""
        numbers = []
        while number := self.error():
            numbers.append(number)
        return numbers

    def refusal(self, message: str) -> list[int]:
        """Errors that a message raises."""
        self.errors()
        self.write(message)
        return self.errors()

    def run(self) -> None:
        """Let everything that is under way finish."""
        while self.instrument.agenda.run_next():
            pass

    def wait(self, seconds: float) -> None:
        """Let the instrument's time pass."""
        agenda = self.instrument.agenda
        agenda.run_until(agenda.now_s + seconds)

    def sweep(self, *changes: str) -> None:
        """A whole swept-sine measurement of the known device."""
        self.write("*RST", *SWEPT_SINE, *changes, "ABOR;:INIT")
        self.run()


@pytest.fixture
def bench() -> Callable[..., Controller]:
    """Makes controllers; choices by keyword, faults as on the command line."""

    def make(*faults: str, plant: Any = None, clock: Any = None, **choices: Any) -> Controller:
        more = {} if clock is None else {"clock": clock}
        instrument = Analyser35670A(
            plant or LinearPlant(known_answer),
            Choices(**choices),
            FaultBoard([parse_fault(text) for text in faults]),
            **more,
        )
        controller = Controller(instrument)
        controller.write("*RST;*CLS")
        controller.run()
        return controller

    return make


@pytest.fixture
def controller(bench: Callable[..., Controller]) -> Controller:
    """A controller of a plain instrument, after ``*RST`` and ``*CLS``."""
    return bench()


@pytest.fixture
def swept(controller: Controller) -> Controller:
    """The same, set up for five points from 100 Hz, not started."""
    controller.write(*SWEPT_SINE)
    controller.run()
    assert controller.errors() == []
    return controller
