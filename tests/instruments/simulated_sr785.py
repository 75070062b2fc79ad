"""A controller on the bus of a simulated SR785, for tests that look from outside."""

from instruments.fake_analyser import known_gain

from sim.faults import FaultBoard
from sim.instrument.bus import TalkState
from sim.instrument.plant import LinearPlant
from sim.sr785 import SR785, Choices
from sim.sr785.model import MODEL

DISP, SRQ, IFC = 2, 64, 128
"""Bits of the status byte."""


class Bench:
    """A controller on the bus, with a clock of its own."""

    def __init__(self, faults=(), gain=known_gain, **choices):
        wanted = {"noise_v": 0.0, "converter_noise": 0.0} | choices
        board = FaultBoard([MODEL.parse_fault(fault) for fault in faults])
        self.wall_s = 0.0
        self.box = SR785(LinearPlant(gain), Choices(**wanted), board, clock=lambda: self.wall_s)

    def send(self, line):
        self.box.listen(line.encode("latin-1"), end=True)
        self.rest()

    def rest(self, seconds=0.02):
        """Let commands be worked off."""
        self.box.agenda.run_until(self.box.agenda.now_s + seconds)

    def take(self, limit=None):
        found = bytearray()
        while True:
            talk = self.box.talk(limit)
            found += talk.data
            if talk.end or talk.state is not TalkState.DATA:
                return bytes(found)

    def ask(self, line):
        self.send(line)
        return self.take().decode("latin-1").removesuffix("\n")

    def events(self):
        return int(self.ask("*ESR?"))

    def swept(self, points=12, **settings):
        """Sweep to the end."""
        lines = {
            "MGRP": "2,3", "MEAS": "2,47", "VIEW": "2,3", "UNDB": "2,0", "SSTR": "2,100",
            "SSTP": "2,200", "SSTY": "2,0", "SNPS": f"2,{points}", "SSAM": "1 V", "SRCO": "1",
        } | settings  # fmt: skip
        for name, value in lines.items():
            self.send(f"{name} {value}")
        assert self.events() & 0x3C == 0
        self.send("*CLS")
        self.send("STRT")
        self.rest(200.0)

    def trace(self, display=0):
        return [float(word) for word in self.ask(f"DSPY? {display}").split(",")]
