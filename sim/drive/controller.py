"""A speed or position controller around a drive, as an element of a drivetrain.

Owns what a controller makes of its sensor's readings and of the source, and how its command reaches
the amplifier. It never steps time, and judges no stability.

Analogue, with e the error of the speed, in V:

    command = K_p (e + integral of e dt / T_i)        e = u - y   or   K_v (u - y) - dy/dt

At a clock e and the integral are held from tick to tick, and the integral is the sum of all errors
before, times the period: K_p (e_k + (T / T_i) (e_0 + ... + e_(k-1))).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from sim.engine.system import Assembly, Law

__all__ = ["Controller", "Feed", "add_late"]


@dataclass(slots=True)
class Feed:
    """What an amplifier gets, in V: of states, of the source, and of earlier laws, by name."""

    states: dict[str, float] = field(default_factory=dict)
    source: float = 0.0
    laws: dict[str, float] = field(default_factory=dict)

    def times(self, factor: float) -> Feed:
        """The same, so many times as large."""
        return Feed(
            {state: factor * share for state, share in self.states.items()},
            factor * self.source,
            {law: factor * share for law, share in self.laws.items()},
        )

    def into(self, assembly: Assembly, signal: str, gain: float) -> None:
        """Let it drive the rate of a signal."""
        for state, share in self.states.items():
            assembly.add_coupling(signal, state, gain * share)
        if self.source != 0.0:
            assembly.add_input(signal, gain * self.source)
        for law, share in self.laws.items():
            assembly.let_act(law, signal, gain * share)


def add_late(assembly: Assembly, source: Feed, delay_s: float, signal: str) -> dict[str, float]:
    """Pade's approximation of second order of a delay, with two signals; what to add to a source.

    exp(-s T) = 1 - s T / (1 + s T/2 + (s T)^2/12); what is taken off is T times the rate.
    """
    rate = f"{signal}'"
    assembly.add_signal(signal)
    assembly.add_signal(rate)
    assembly.add_coupling(signal, rate, 1.0)
    source.into(assembly, rate, 12.0 / delay_s**2)
    assembly.add_coupling(rate, signal, -12.0 / delay_s**2)
    assembly.add_coupling(rate, rate, -6.0 / delay_s)
    return {rate: -delay_s}


@dataclass(frozen=True, slots=True)
class Controller:
    """A controller with gains K_p, T_i_s, K_v (see `sim.drive.sections.Loop`).

    `speed`: the reading of an analogue sensor in V, over state names. `coordinate`, `k_ts`,
    `counts`: of an encoder, whose law is named ``encoder``. `rate_hz` above 0 is that of the clock
    it runs at.
    """

    K_p: float
    T_i_s: float | None
    K_v: float | None
    is_reference: bool
    speed: Mapping[str, float] = field(default_factory=dict)
    coordinate: str = ""
    k_ts: float = 1.0
    counts: float | None = None
    rate_hz: float = 0.0
    computing_s: float = 0.0

    def feed(self, assembly: Assembly) -> Feed:
        """Add its states and laws; what the amplifier gets."""
        assembly.closed = True
        source = 1.0 if self.is_reference else 0.0
        found = self._sampled(assembly, source) if self.rate_hz else self._smooth(assembly, source)
        if self.computing_s:
            found.states |= add_late(assembly, found, self.computing_s, "V_D")
        if not self.is_reference:
            if self.rate_hz:
                found.laws["command"] = found.laws.get("command", 0.0) + 1.0
            else:
                found.source += 1.0
        return found

    def _smooth(self, assembly: Assembly, source: float) -> Feed:
        error = Feed({state: -share for state, share in self.speed.items()}, source)
        return self._with_integral(assembly, error)

    def _sampled(self, assembly: Assembly, source: float) -> Feed:
        clock = (self.rate_hz,)
        assembly.add_law("command", Law.HOLD, {}, {}, feedthrough=1.0, parameters=clock)
        if self.counts is None:
            assembly.add_law("reading", Law.HOLD, {}, self.speed, parameters=clock)
            errors = {"command": source, "reading": -1.0}
        elif self.K_v is None:
            errors = {"command": source, "encoder": -self.k_ts}
        else:
            count = (self.rate_hz, 2.0 * math.pi / self.counts)
            sees = {self.coordinate: 1.0}
            assembly.add_law("encoder_speed", Law.COUNT_RATE, {}, sees, parameters=count)
            errors = {
                "command": source * self.K_v,
                "encoder": -self.k_ts * self.K_v,
                "encoder_speed": -self.k_ts,
            }
        return self._with_integral(assembly, Feed(laws=errors))

    def _with_integral(self, assembly: Assembly, error: Feed) -> Feed:
        found = error.times(self.K_p)
        if self.T_i_s is None:
            return found
        assembly.add_signal("V_I")
        error.into(assembly, "V_I", 1.0)
        if self.rate_hz:
            assembly.add_law("integral", Law.HOLD, {}, {"V_I": 1.0}, parameters=(self.rate_hz,))
            found.laws["integral"] = self.K_p / self.T_i_s
        else:
            found.states["V_I"] = self.K_p / self.T_i_s
        return found
