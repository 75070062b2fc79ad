"""The plan of a measurement by one signal that drives all frequencies at once.

Owns what differs from a stepped sweep: cycles are periods or segments of the signal, and a level
is that of a sine of the same rms. It drives nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

from daq.errors import InputError
from daq.excitation.signal import Excitation
from daq.plan import SweepPlan

__all__ = ["ExcitedPlan"]


@dataclass(frozen=True, slots=True)
class ExcitedPlan(SweepPlan):
    """A signal at one or more levels, and the frequencies at which its response is read.

    `levels_vpk` are those of a sine of the signal's rms. `settle_cycles` and `integrate_cycles`
    count periods of a periodic signal that are left out and averaged; of noise `integrate_cycles`
    segments, half overlapped, are averaged after `settle_cycles` whole ones. Every level starts
    from rest. `realisation` draws the noise of a simulation.

    Raises
    ------
    InputError
        If a frequency is none of the signal's, or fewer than two are averaged.
    """

    excitation: Excitation | None = None
    realisation: int = 0

    def __post_init__(self) -> None:
        # A dataclass with slots is made anew: super() without arguments would name the old one.
        SweepPlan.__post_init__(self)
        if self.excitation is None:
            raise InputError("plan: an excitation is missing; a plan without one is a sweep")
        if self.integrate_cycles < 2:
            raise InputError(
                f"plan: {self.integrate_cycles} averages of a signal show no scatter; use 2 or more"
            )
        self.signal.nearest(self.frequencies_hz)

    @property
    def signal(self) -> Excitation:
        """The excitation."""
        assert self.excitation is not None
        return self.excitation

    @property
    def duration_s(self) -> float:
        """Time that the signal drives the servo, at all levels, s."""
        averaged = float(self.integrate_cycles)
        if self.signal.kind == "noise":
            averaged = 0.5 * (averaged + 1.0)
        return (self.settle_cycles + averaged) * self.signal.period_s * len(self.levels_vpk)

    @property
    def parts(self) -> int:
        """Stretches of the signal at each level: periods, or half segments of noise."""
        if self.signal.kind == "noise":
            return 2 * self.settle_cycles + self.integrate_cycles + 1
        return self.settle_cycles + self.integrate_cycles
