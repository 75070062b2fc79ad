"""A sampled bench as a swept-sine analyser: steps of a sine, read by a lock-in.

Owns the order of things: level last and by a ramp, the delay of the loop-back measured before the
first point, points, quiet again, safe. What is said to the converter is in `converter`, what its
samples mean in `lockin`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.analyser import Identity, PointSettings, SourceState, SweepPoint
from daq.driving.driven import DrivenAnalyser, Guard
from daq.driving.replies import parse_number
from daq.driving.safe_off import SafeOff
from daq.driving.scpi_connection import Dialogue
from daq.driving.variance import gain_standard_error, normalised_variance
from daq.errors import (
    BenchTimeout,
    InstrumentError,
    LashbenchError,
    LimitError,
    MeasurementError,
    ProtocolError,
)
from daq.frf import PointFlag
from daq.sampled.limits import BLIND_S, FASTEST_HZ, LEAST_SAMPLES, check_settings
from daq.sampled.lockin import amplitudes, delay_of
from daq.sampled.safe import make_safe
from daq.transports.base import Deadline, Transport

__all__ = ["SampledBench"]

_AT_ONCE = 16_384
_DELAY_STEP_HZ = 5.0
"""Difference of the two frequencies of the delay's measurement: up to 0.2 s is told."""
_DELAY_CYCLES = 8
_LEVEL_SHARE = 0.05
"""How far the loop-back may be from the level that was set."""
_MARGIN_S = 10.0
_RAMP_S = 30.0
_POWER_ON, _ERRORS = 128, 32 | 16


@dataclass(frozen=True, slots=True)
class _SetUp:
    settings: PointSettings
    start_hz: float
    stop_hz: float


class SampledBench(DrivenAnalyser[Dialogue, _SetUp]):
    """The `Analyser` protocol over a converter.

    Parameters
    ----------
    transport
        Open wire to the converter; closed with the driver.
    """

    def __init__(self, transport: Transport) -> None:
        super().__init__(transport, Dialogue(transport))
        self._rate_hz = 0.0
        self._delay_s: float | None = None

    def identify(self) -> Identity:
        """Ask who is there, and refuse anything but a converter."""
        from daq.drivers import stranger

        dialogue = self._dialogue
        with dialogue.lock:
            # Whoever is there may speak another language: nothing else is asked before.
            dialogue.transport.device_clear(dialogue.soon())
            reply = dialogue.ask("*IDN?")
            fields = [field.strip() for field in reply.split(",")]
            if len(fields) != 4 or fields[:2] != ["LASHBENCH", "SAMPLED"]:
                raise InstrumentError(
                    f"{self._transport.address}: {reply!r} answers '*IDN?', a sampled bench was "
                    f"due; {stranger(reply, 'sampled')}"
                )
            dialogue.recover()
            dialogue.ask_integer("*ESR?")
        simulated = fields[2].startswith("simulated")
        return Identity("lashbench", "SAMPLED", fields[3], fields[2], (), simulated)

    def prepare(
        self, start_hz: float, stop_hz: float, settings: PointSettings
    ) -> Mapping[str, str]:
        """Set everything but level and offset, read it back, and return what was read.

        Raises
        ------
        LimitError
            If any value is outside the converter's range; nothing was sent.
        InstrumentError
            If it reads back something else.
        """
        check_settings(start_hz, stop_hz, settings, self._rate_hz or FASTEST_HZ)
        self._setup = None
        dialogue = self._dialogue
        with dialogue.lock:
            if not dialogue.trusted:
                dialogue.recover()
                dialogue.send("*RST")
                self._delay_s = None
            dialogue.send("*CLS")
            self._rate_hz, full_v = self._pair("CONF?")
            check_settings(start_hz, stop_hz, settings, self._rate_hz)
            if settings.source_vpk + abs(settings.dc_offset_v) > full_v:
                raise LimitError(
                    f"{settings.source_vpk:g} V peak and {settings.dc_offset_v:g} V exceed the "
                    f"full scale of {full_v:g} V; nothing was driven"
                )
            dialogue.send(f"SOUR:SLEW {settings.slew_vpk_per_s:.9g}")
            read_back = {
                "rate (Hz)": f"{self._rate_hz:g}",
                "full scale (V)": f"{full_v:g}",
                "slew (V peak/s)": f"{dialogue.ask_number('SOUR:SLEW?'):g}",
                "level (V peak)": f"{dialogue.ask_number('SOUR:VOLT?'):g}",
            }
            if not math.isclose(float(read_back["slew (V peak/s)"]), settings.slew_vpk_per_s,
                                rel_tol=1e-5, abs_tol=1e-9):  # fmt: skip
                raise InstrumentError(f"the slew reads back {read_back['slew (V peak/s)']}")
            self._check_events("set-up")
            dialogue.trusted = True
        self._setup = _SetUp(settings, start_hz, stop_hz)
        return read_back

    def sweep(self, frequencies_hz: Sequence[float]) -> Iterator[SweepPoint]:
        """Drive the source and yield each point as it is finished, in the order given.

        Raises
        ------
        MeasurementError
            At once if `prepare` has not been called since the last trouble; in the run if the
            source was made safe from elsewhere.
        LimitError
            At once if a frequency is outside the band that was prepared.
        """
        frequencies = [float(frequency_hz) for frequency_hz in frequencies_hz]
        setup = self._setup
        if setup is None or not self._dialogue.trusted:
            raise MeasurementError("the bench is not set up; prepare it before the sweep")
        for frequency_hz in frequencies:
            if not setup.start_hz <= frequency_hz <= setup.stop_hz:
                raise LimitError(
                    f"frequency {frequency_hz:g} Hz is outside the prepared band of "
                    f"{setup.start_hz:g} to {setup.stop_hz:g} Hz; nothing was sent"
                )
        return self._run(setup, frequencies)

    def source_state(self) -> SourceState:
        """What a read-back says of the source now."""
        try:
            with self._dialogue.lock:
                level, offset = self._pair("SOUR:NOW?")
                aimed = self._dialogue.ask_number("SOUR:VOLT?")
                away = self._dialogue.ask_number("SOUR:OFFS?")
        except LashbenchError:
            return SourceState.UNKNOWN
        is_off = level == offset == aimed == away == 0
        return SourceState.CONFIRMED_OFF if is_off else SourceState.ON

    def _switch_off(self) -> SafeOff:
        return make_safe(self._transport, self.on_exchange)

    def _resynchronise(self) -> None:
        self._dialogue.clear()

    # ------------------------------------------------------------ measuring

    def _run(self, setup: _SetUp, frequencies: Sequence[float]) -> Iterator[SweepPoint]:
        with self._driving() as guard:
            if frequencies:
                self._drive(setup, frequencies[0], guard)
            for frequency_hz in frequencies:
                yield self._point(setup, frequency_hz, guard)
        self._check_events("end of the sweep")

    def _drive(self, setup: _SetUp, first_hz: float, guard: Guard) -> None:
        """Step to the first frequency at level 0, ramp the level, and learn the delay."""
        settings, dialogue = setup.settings, self._dialogue
        self._record(first_hz, 1, guard)
        guard()
        dialogue.send(f"SOUR:OFFS {settings.dc_offset_v:.9g}")
        guard()
        dialogue.send(f"SOUR:VOLT {settings.source_vpk:.9g}")
        self._wait_for_level(settings.source_vpk, settings.dc_offset_v, guard)
        if self._delay_s is None:
            self._delay_s = self._measured_delay(setup, first_hz, guard)

    def _wait_for_level(self, level: float, offset: float, guard: Guard) -> None:
        deadline = Deadline.after(_RAMP_S + self._dialogue.reply_s)
        while True:
            guard()
            found, away = self._pair("SOUR:NOW?")
            if math.isclose(found, level, abs_tol=1e-9) and math.isclose(
                away, offset, abs_tol=1e-9
            ):
                return
            self._check_events("ramp")
            if deadline.expired:
                raise self._dialogue.failure(
                    BenchTimeout(f"the level stands at {found:g} V peak, {level:g} was set")
                )
            self._dialogue.pause(0.05)

    def _measured_delay(self, setup: _SetUp, first_hz: float, guard: Guard) -> float:
        """From the loop-back at two neighbouring frequencies; what comes back is the level, too."""
        step = min(_DELAY_STEP_HZ, 0.1 * first_hz)
        up = first_hz + step <= self._rate_hz / LEAST_SAMPLES
        pair = (first_hz, first_hz + step) if up else (first_hz - step, first_hz)
        found = []
        for frequency_hz in pair:
            blind = math.ceil(BLIND_S * self._rate_hz)
            count = blind + math.ceil(_DELAY_CYCLES * self._rate_hz / frequency_hz) + 1
            frames = self._record(frequency_hz, count, guard)
            cycles = amplitudes(frames, blind, frequency_hz, self._rate_hz, _DELAY_CYCLES)
            found.append(complex(cycles[0].mean()))
        level = setup.settings.source_vpk
        if abs(abs(found[0]) - level) > _LEVEL_SHARE * level:
            raise InstrumentError(
                f"the loop-back reads {abs(found[0]):.4g} V peak where {level:g} V was set; "
                "is the output connected to input 1, and is the full scale that of the address?"
            )
        return delay_of((found[0], found[1]), pair)

    def _point(self, setup: _SetUp, frequency_hz: float, guard: Guard) -> SweepPoint:
        settings, rate = setup.settings, self._rate_hz
        delay = math.ceil((self._delay_s or 0.0) * rate) + 1
        first = delay + settings.settle_cycles * rate / frequency_hz
        count = math.ceil(first + settings.integrate_cycles * rate / frequency_hz) + 1
        frames = self._record(frequency_hz, count, guard)
        lost, over = (round(value) for value in self._pair("ACQ:TROU?"))
        what = f"point at {frequency_hz:g} Hz"
        self._check_events(what)
        self._confirm_drive(settings)
        flags = PointFlag(0)
        if lost:
            return SweepPoint(
                frequency_hz, complex(math.nan, math.nan), flags=flags | PointFlag.SPOILT
            )
        limits = settings.input_range_vpk
        peaks = np.abs(frames).max(axis=0)
        beyond = any(r is not None and p > r for r, p in zip(limits, peaks, strict=True))
        if over or beyond:
            flags |= PointFlag.OVERLOAD
        cycles = amplitudes(frames, first, frequency_hz, rate, settings.integrate_cycles)
        means = cycles.mean(axis=1)
        if means[0] == 0:
            raise MeasurementError(f"{what}: input 1 is silent; is the loop-back connected?")
        variances = (normalised_variance(cycles[0]), normalised_variance(cycles[1]))
        error = gain_standard_error(*variances, settings.integrate_cycles)
        gain_std_db, phase_std_deg = error if error is not None else (None, None)
        return SweepPoint(
            frequency_hz=frequency_hz,
            gain=complex(means[1] / means[0]),
            gain_std_db=gain_std_db,
            phase_std_deg=phase_std_deg,
            flags=flags,
            variances=variances,
            detail={"source_vpk": float(abs(means[0])), "delay_s": self._delay_s or 0.0},
        )

    def _record(self, frequency_hz: float, count: int, guard: Guard) -> NDArray[np.float64]:
        """Step to a frequency and record from there, shape (count, 2)."""
        dialogue = self._dialogue
        guard()
        before = self._step()[0]
        dialogue.send(f"ACQ:STEP {frequency_hz:.12g},{count}")
        # A command that was lost would leave the recording before it to be read as this one.
        number, stepped_hz, frames = self._step()
        if (number, frames) != (before + 1, count) or abs(stepped_hz / frequency_hz - 1.0) > 1e-9:
            raise InstrumentError(
                f"the step to {frequency_hz:g} Hz was not made: the converter is at step "
                f"{number:g}, {stepped_hz:g} Hz; nothing was read"
            )
        deadline = Deadline.after(count / self._rate_hz + _MARGIN_S)
        while dialogue.ask_integer("ACQ?") < count:
            self._check_events(f"recording at {frequency_hz:g} Hz")
            if deadline.expired:
                raise dialogue.failure(
                    BenchTimeout(f"{count} frames did not come within {deadline.span_s:.3g} s")
                )
            dialogue.pause(0.02)
            guard()
        parts = []
        for first in range(0, count, _AT_ONCE):
            size = min(_AT_ONCE, count - first)
            values = dialogue.ask_reals(f"ACQ:DATA? {first},{size}")
            if len(values) != 2 * size or not np.isfinite(values).all():
                raise dialogue.failure(
                    ProtocolError(f"{len(values)} numbers came, {2 * size} were due")
                )
            parts.append(values.reshape(size, 2))
        return np.concatenate(parts)

    def _step(self) -> tuple[float, float, float]:
        """Number of the last step, its frequency in Hz and its frames."""

        def read(text: str) -> tuple[float, float, float]:
            parts = text.split(",")
            if len(parts) != 3:
                raise ProtocolError(f"three numbers were due, but {text!r} came")
            return parse_number(parts[0]), parse_number(parts[1]), parse_number(parts[2])

        return self._dialogue.parsed("ACQ:STEP?", read)

    def _confirm_drive(self, settings: PointSettings) -> None:
        """Raise `InstrumentError` if level or offset moved: another program's hand."""
        level, offset = self._pair("SOUR:NOW?")
        if abs(level - settings.source_vpk) > 1e-6 or abs(offset - settings.dc_offset_v) > 1e-6:
            raise InstrumentError(
                f"the source was set to {settings.source_vpk:g} V peak and "
                f"{settings.dc_offset_v:g} V and reads back {level:g} and {offset:g}"
            )

    def _quiet(self) -> None:
        for line in ("ACQ:HALT", "SOUR:VOLT 0", "SOUR:OFFS 0"):
            self._dialogue.send(line)
        self._wait_for_level(0.0, 0.0, lambda: None)

    def _check_events(self, what: str) -> None:
        events = self._dialogue.ask_integer("*ESR?")
        if events & _POWER_ON:
            self._dialogue.trusted = False
            raise InstrumentError(f"{what}: the converter started anew in between; set it up anew")
        if events & _ERRORS:
            self._dialogue.check(what)

    def _pair(self, line: str) -> tuple[float, float]:
        def read(text: str) -> tuple[float, float]:
            parts = text.split(",")
            if len(parts) != 2:
                raise ProtocolError(f"two numbers were due, but {text!r} came")
            return parse_number(parts[0]), parse_number(parts[1])

        return self._dialogue.parsed(line, read)
