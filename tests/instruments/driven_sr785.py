"""The SR785's driver on a simulated SR785, over a wire that remembers what crossed it."""

import numpy as np
from instruments.fake_analyser import known_gain

from daq.analyser import PointSettings
from daq.errors import BenchTimeout
from daq.plan import spaced_frequencies
from daq.sr785 import SR785
from daq.sr785.setup import Timing
from sim.faults import FaultBoard
from sim.instrument.plant import LinearPlant
from sim.loopback import Loopback
from sim.sr785 import Choices, instrument
from sim.sr785.model import MODEL

QUIET = Choices(noise_v=0.0, converter_noise=0.0)
SETTINGS = PointSettings(source_vpk=1.5, settle_cycles=3, integrate_cycles=4, slew_vpk_per_s=0.0)
GRID = spaced_frequencies(120.0, 160.0, 17)
SHORT = Timing(reply_s=0.3, block_s=0.3, overhead_s=0.5, point_s=0.02)


class Tap:
    """A wire that remembers what crossed it."""

    def __init__(self, wire, swaps=False):
        self._wire, self._swaps = wire, swaps
        self.address = wire.address
        self.acts = []

    @property
    def lines(self):
        return [act for act in self.acts if act not in ("poll", "clear", "read")]

    def write(self, line, deadline):
        self.acts.append(line)
        self._wire.write(line, deadline)

    def read(self, deadline):
        self.acts.append("read")
        return self._wire.read(deadline)

    def read_block(self, deadline):
        return self._wire.read_block(deadline)

    def read_bytes(self, count, deadline):
        self.acts.append("read")
        data = self._wire.read_bytes(count, deadline)
        return np.frombuffer(data, "<f4").byteswap().tobytes() if self._swaps else data

    def serial_poll(self, deadline):
        self.acts.append("poll")
        return self._wire.serial_poll(deadline)

    def device_clear(self, deadline):
        self.acts.append("clear")
        return self._wire.device_clear(deadline)

    def pause(self, seconds):
        self._wire.pause(seconds)

    def close(self):
        self._wire.close()


class Line(Tap):
    """An RS-232 line: no poll, no clear, other interface."""

    def __init__(self, instrument):
        super().__init__(Loopback(instrument))
        self.address = "serial:/dev/nowhere"
        self._instrument = instrument
        self._heard = b""

    def write(self, line, deadline):
        self.acts.append(line)
        self._instrument.serial_in(line.encode() + b"\n")

    def read(self, deadline):
        while b"\r" not in self._heard:
            self._heard += self._instrument.serial_out()
            self._wire.pause(0.01)
            if deadline.expired:
                raise BenchTimeout(f"nothing came within {deadline.span_s:g} s")
        line, _, self._heard = self._heard.partition(b"\r")
        return line.decode()

    def serial_poll(self, deadline):
        return None

    def device_clear(self, deadline):
        self._heard = b""
        self._instrument.serial_out()
        return False


def bench(choices=QUIET, faults=(), timing=None, wire=Tap, gain=known_gain, **options):
    board = FaultBoard([MODEL.parse_fault(fault) for fault in faults])
    simulated = instrument.SR785(LinearPlant(gain), choices, board)
    tap = Line(simulated) if wire is Line else wire(Loopback(simulated), **options)
    return simulated, SR785(tap, timing=timing), tap


def prepared(*words, settings=SETTINGS, **options):
    instrument, analyser, tap = bench(*words, **options)
    analyser.identify()
    analyser.prepare(100.0, 200.0, settings)
    return instrument, analyser, tap


def assert_right(points, frequencies):
    assert len(points) == len(frequencies)
    for point in points:
        true = known_gain(point.frequency_hz)
        assert abs(point.gain - true) <= 1e-4 * abs(true)
