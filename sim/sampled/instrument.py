"""A converter at 48 kHz with a device under test behind it, as a controller meets it.

Owns its clock, its samples (what the device does, delayed as a converter delays, with noise and
clipping) and its bus. The language is `daq.sampled.converter`'s.
"""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from daq.sampled.converter import Interpreter
from sim.instrument.agenda import Agenda, Entry
from sim.instrument.bus import Talk, TalkState
from sim.instrument.damage import Damage
from sim.instrument.output import Source
from sim.instrument.plant import Dwell, Plant
from sim.models import Bench

__all__ = ["SimulatedConverter"]

_RATE_HZ = 48_000.0
_DELAY_FRAMES = 96
"""2 ms: buffers, and the filters of both converters."""
_FULL_SCALE_V = 10.0
_REFERENCE_CYCLES = 30
_BURST = 4.0
_MOST_CYCLES = 1000


class SimulatedConverter:
    """One output, two inputs: the source itself, and the device's answer to it."""

    def __init__(self, plant: Plant, bench: Bench) -> None:
        self.name = "simulated at 48 kHz"
        self.rate_hz, self.full_scale_v = _RATE_HZ, _FULL_SCALE_V
        self.plant, self._bench = plant, bench
        self.faults = bench.board
        self.agenda = Agenda()
        # By the wall clock: in fast operation the agenda stands still while somebody only waits.
        self.damage = Damage(self.faults, time.monotonic)
        self.source = Source()
        self.remote = self.local_lockout = False
        self.measurements_begun = self.points_begun = 0
        self.repeats = False
        self.gpib_address = 12
        self.service_request = False
        self._line = bytearray()
        self._reply = b""
        self._forget()
        self._interpreter = Interpreter(self, f"SIM{bench.seed}")

    def _forget(self) -> None:
        self._frames: NDArray[np.float64] = np.zeros((0, 2))
        self._wanted = 0
        self._in = True
        self._entry: Entry | None = None
        self._over = 0
        self._before: NDArray[np.float64] = np.zeros((_DELAY_FRAMES, 2))

    # ------------------------------------------------------------ the converter

    def aim(self, level_vpk: float, offset_v: float, slew_v_per_s: float) -> None:
        """Head for a level and an offset."""
        self.source.aim(self.agenda.now_s, level_vpk, slew_v_per_s)
        self.source.offset_v = offset_v
        if left_s := self.source.remaining_s(self.agenda.now_s):
            self.agenda.after(left_s, lambda: None)

    def now(self) -> tuple[float, float]:
        """Level and offset at the output now."""
        return self.source.level(self.agenda.now_s), self.source.offset_v

    def step(self, frequency_hz: float, frames: int) -> None:
        """Begin this frequency, and record; the samples are there when their time has come."""
        self.halt()
        self.measurements_begun += 1
        level, offset = self.now()
        if level > 0:
            self.points_begun += 1
        self._strike()
        cycles = max(1, min(_MOST_CYCLES, math.ceil(frames * frequency_hz / _RATE_HZ)))
        dwell = self.plant.dwell(frequency_hz, level, offset, 0, cycles)
        direct = self._samples(dwell, frequency_hz, frames, offset)
        whole = np.concatenate([self._before, direct])
        self._before = whole[-_DELAY_FRAMES:]
        heard = whole[:frames] + self._noise(frequency_hz, frames)
        if self.faults.take("overload-burst"):
            heard[frames // 2 :] *= _BURST * _FULL_SCALE_V
        self._over = sum(
            1 << channel for channel in (0, 1) if np.abs(heard[:, channel]).max() > _FULL_SCALE_V
        )
        self._frames = np.clip(heard, -_FULL_SCALE_V, _FULL_SCALE_V)
        self._in, self._wanted = False, frames
        self._entry = self.agenda.after(frames / _RATE_HZ, self._finish)

    def _finish(self) -> None:
        self._in, self._entry = True, None

    def _samples(
        self, dwell: Dwell, frequency_hz: float, frames: int, offset: float
    ) -> NDArray[np.float64]:
        """What leaves and comes back, without delay, shape (frames, 2)."""
        turns = frequency_hz / _RATE_HZ * np.arange(frames)
        cycle = np.minimum(turns.astype(int), len(dwell.source_cycles) - 1)
        rotating = np.exp(2j * np.pi * turns)
        source = offset + (np.asarray(dwell.source_cycles)[cycle] * rotating).imag
        coefficients = np.asarray(dwell.output_cycles)
        output = coefficients[cycle, 0].real.copy()
        for harmonic in range(1, coefficients.shape[1]):
            output += (coefficients[cycle, harmonic] * rotating**harmonic).imag
        return np.column_stack([source, output])

    def _noise(self, frequency_hz: float, frames: int) -> NDArray[np.float64]:
        """White, so large that a cycle's amplitude scatters as that of the other instruments."""
        rng = np.random.default_rng((self._bench.seed, self.measurements_begun))
        per_cycle = _RATE_HZ / frequency_hz
        converter = self._bench.converter_noise * _FULL_SCALE_V
        single = self._bench.noise_v * math.sqrt(_REFERENCE_CYCLES)
        scale = np.array([converter, math.hypot(converter, single)]) * math.sqrt(per_cycle / 2)
        return np.asarray(rng.standard_normal((frames, 2)) * scale)

    def recorded(self) -> int:
        """All frames once the time is over, before that none."""
        return self._wanted if self._in else 0

    def frames(self, first: int, count: int) -> NDArray[np.float64]:
        """Recorded volts, shape (count, 2)."""
        self.faults.phase = "read-out"
        return self._frames[first : first + count]

    def trouble(self) -> tuple[int, int]:
        """No frame is lost; inputs that were overdriven."""
        return 0, self._over

    def halt(self) -> None:
        """Give up a recording."""
        if self._entry is not None:
            self._entry.cancelled = True
            self._entry = None
        self._in, self._wanted = True, 0

    # ------------------------------------------------------------ the bus

    @property
    def driven_v(self) -> float:
        """Largest magnitude of amplitude and offset at the connector now, V; 0 if off."""
        return max(abs(value) for value in self.now())

    def listen(self, data: bytes, end: bool = False) -> int:
        """Take bytes; a line feed or EOI ends a message."""
        if self.damage.dead:
            return 0
        for at, byte in enumerate(data):
            if byte != 10:
                self._line.append(byte)
            if byte == 10 or (end and at == len(data) - 1):
                self._execute(bytes(self._line))
                self._line.clear()
                if self.damage.dead:
                    return at + 1
        return len(data)

    def _execute(self, line: bytes) -> None:
        if not line.strip():
            return
        self._strike()
        if self.damage.dead:
            return
        # A message before the last reply was read takes its place.
        self._reply = b""
        reply = self._interpreter.run(line)
        if reply is not None:
            self._reply = self.damage.to_reply(reply)

    def _strike(self) -> None:
        self.faults.points_begun = self.points_begun
        self.faults.phase = "sweep" if self.driven_v else "prepare"
        self.damage.strike()
        if self.damage.power_failed():
            self.source.off(self.agenda.now_s)
            self._forget()
            self._line.clear()
            self._reply = b""
            self._interpreter.begin()

    def talk(self, limit: int | None = None) -> Talk:
        """Send up to `limit` bytes of the reply."""
        if self.damage.dead or self.damage.late:
            return Talk(TalkState.WAITING)
        if not self._reply:
            return Talk(TalkState.NOTHING)
        data, self._reply = self._reply[:limit], self._reply[len(self._reply[:limit]) :]
        end = not self._reply and not self.damage.end_lost()
        return Talk(TalkState.DATA, data, end)

    def serial_poll(self) -> int | None:
        """16 where a reply is there; None where nobody answers."""
        return None if self.damage.dead else 16 * bool(self._reply)

    @property
    def reply_ready(self) -> bool:
        """Whether a reply could be read now."""
        return bool(self._reply) and not self.damage.dead and not self.damage.late

    @property
    def reply_due(self) -> bool:
        """Whether a reply is there."""
        return bool(self._reply)

    def device_clear(self) -> None:
        """Empty both buffers."""
        self._line.clear()
        self._reply = b""
        self.damage.free_parser()

    def trigger(self) -> None:
        """Nothing is triggered."""
