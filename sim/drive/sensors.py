"""Sensors that a clock samples, as elements of a drivetrain.

Owns encoder and sampled tachometer: what is counted, held and read. They never step time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from sim.engine.system import Assembly, Law

__all__ = ["Encoder", "SampledTachometer", "add_filter", "read_late"]


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
