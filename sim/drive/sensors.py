"""Sensors other than the paper's tachometer, as elements of a drivetrain.

Owns encoder, sampled tachometer, accelerometer and current sensor: what is counted, held and read.
They never step time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from sim.engine.system import Assembly, Law

__all__ = ["AnalogueSensor", "Encoder", "SampledTachometer", "add_filter", "read_late"]


def add_filter(assembly: Assembly, numerator: float, denominator: tuple[float, float, float],
               source: Mapping[str, float]) -> None:  # fmt: skip
    """A filter of second order, equation (4), with the states ``V_o`` and its rate.

    `source`: what it filters, over state names.
    """
    d2, d1, d0 = denominator
    assembly.add_signal("V_o")
    assembly.add_signal("V_o'")
    assembly.add_coupling("V_o", "V_o'", 1.0)
    assembly.add_coupling("V_o'", "V_o", -d0 / d2)
    assembly.add_coupling("V_o'", "V_o'", -d1 / d2)
    for name, gain in source.items():
        assembly.add_coupling("V_o'", name, numerator * gain / d2)


def read_late(assembly: Assembly, delay_s: float, sample_s: float = 0.0) -> None:
    """Let the output be read late, and as samples of a period where one is given."""
    late = assembly.reading.delay_s + delay_s
    assembly.reading = replace(assembly.reading, delay_s=late, sample_s=sample_s)


@dataclass(frozen=True, slots=True)
class Encoder:
    """An encoder on a coordinate: its position in counts, or their change from tick to tick.

    `gain` is V per rad, or V.s per rad of a speed. A filter, if any, follows it. `held` says
    whether an analogue output is read that holds each sample. Delays are exact.
    """

    coordinate: str
    gain: float
    rate_hz: float
    counts: float
    speed: bool
    held: bool = False
    numerator: float | None = None
    denominator: tuple[float, float, float] | None = None
    delay_s: float = 0.0
    T_d: float = 0.0

    def enter(self, assembly: Assembly) -> None:
        """Add the law that counts, and the filter."""
        acts_on: dict[str, float] = {}
        if self.numerator is not None and self.denominator is not None:
            add_filter(assembly, self.numerator, self.denominator, {})
            acts_on = {"V_o'": self.numerator / self.denominator[0] * self.gain}
        else:
            assembly.output = {}
        assembly.add_law(
            "encoder",
            Law.COUNT_RATE if self.speed else Law.COUNT,
            acts_on,
            {self.coordinate: 1.0},
            parameters=(self.rate_hz, 2.0 * math.pi / self.counts),
            read=0.0 if acts_on else self.gain,
        )
        read_late(assembly, self.delay_s + self.T_d, 0.0 if self.held else 1.0 / self.rate_hz)


@dataclass(frozen=True, slots=True)
class SampledTachometer:
    """A tachometer and its filter, equations (3) and (4), that a clock samples."""

    coordinate: str
    k_ts: float
    numerator: float
    denominator: tuple[float, float, float]
    rate_hz: float
    held: bool = False
    delay_s: float = 0.0
    T_d: float = 0.0

    def enter(self, assembly: Assembly) -> None:
        """Add the filter, and the law that samples its output."""
        source = {f"{self.coordinate}'": self.k_ts}
        add_filter(assembly, self.numerator, self.denominator, source)
        assembly.add_law(
            "converter", Law.HOLD, {}, {"V_o": 1.0}, parameters=(self.rate_hz,), read=1.0
        )
        assembly.output = {}
        read_late(assembly, self.delay_s + self.T_d, 0.0 if self.held else 1.0 / self.rate_hz)


@dataclass(frozen=True, slots=True)
class AnalogueSensor:
    """An accelerometer on a coordinate, or a sensor of the motor's current.

    `gain` is V.s^2/rad of an acceleration, V/A of a current. Between the sensor's corners, each of
    first order, and behind a filter of second order, if any, it is read as it is, or sampled at
    `rate_hz` where that is above 0. Delays are exact.

    The acceleration is exact, too: w' behind a low-pass of corner c is c (w - w_c), where w_c is
    the speed w behind the same low-pass, and behind the filter it is the rate of the filtered
    speed. So neither torques nor laws need be known, and jumps of either lose nothing.
    """

    reads: Literal["acceleration", "current"]
    coordinate: str
    gain: float
    low_pass_hz: float | None = None
    high_pass_hz: float | None = None
    numerator: float | None = None
    denominator: tuple[float, float, float] | None = None
    rate_hz: float = 0.0
    held: bool = False
    delay_s: float = 0.0
    T_d: float = 0.0

    def enter(self, assembly: Assembly) -> None:
        """Add the sensor's corners and the filter, and the law that samples what is read."""
        read = self._low_passed(assembly)
        if self.numerator is not None and self.denominator is not None:
            add_filter(assembly, self.numerator, self.denominator, read)
            read = {"V_o'" if self._is_derived_by_filter else "V_o": 1.0}
        if self.high_pass_hz is not None:
            corner = 2.0 * math.pi * self.high_pass_hz
            _follow(assembly, "V_h", read, corner)
            read = {**read, "V_h": -1.0}
        period = 0.0
        if self.rate_hz > 0.0:
            assembly.add_law("converter", Law.HOLD, {}, read, parameters=(self.rate_hz,), read=1.0)
            read, period = {}, 0.0 if self.held else 1.0 / self.rate_hz
        assembly.output = read
        read_late(assembly, self.delay_s + self.T_d, period)

    @property
    def _is_derived_by_filter(self) -> bool:
        """Whether the filter alone limits the band of an acceleration."""
        return self.reads == "acceleration" and self.low_pass_hz is None

    def _low_passed(self, assembly: Assembly) -> dict[str, float]:
        """What is sensed, over states; the speed where the filter makes an acceleration of it."""
        source = "i_a" if self.reads == "current" else f"{self.coordinate}'"
        if self.low_pass_hz is None:
            return {source: self.gain}
        corner = 2.0 * math.pi * self.low_pass_hz
        if self.reads == "current":
            _follow(assembly, "V_c", {source: self.gain}, corner)
            return {"V_c": 1.0}
        _follow(assembly, "w_c", {source: 1.0}, corner)
        return {source: self.gain * corner, "w_c": -self.gain * corner}


def _follow(assembly: Assembly, signal: str, source: Mapping[str, float], corner: float) -> None:
    """A low-pass of first order of a sum over states; `corner` in rad/s."""
    assembly.add_signal(signal)
    assembly.add_coupling(signal, signal, -corner)
    for name, gain in source.items():
        assembly.add_coupling(signal, name, corner * gain)
