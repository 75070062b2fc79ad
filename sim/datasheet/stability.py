"""Whether the loop of a drive is stable, by how much, and what its linear response shows.

Owns the judgement of closed-loop poles and the features of the linear closed loop. It steps no
motion, and says nothing of a drive without [loop].
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.drivetrain import paper_drivetrain
from sim.engine.linear import poles

if TYPE_CHECKING:
    from sim.drive.unit import Unit
    from sim.engine.system import PiecewiseLinearSystem

__all__ = ["MARGIN", "LoopFeatures", "find_unstable", "gain_margin", "loop_features", "unstable_at"]

_UNDAMPED = 1e-3
"""Negative damping ratio that any train's own damping, which the model lacks, makes up for."""

_SLOW = 0.1
"""Share of the lowest angular frequency of the limits below which a pole is taken for one at zero.
A drive has several of these, and they come out a little off."""

_NEAR = 2e-3
"""A pole that a loop moves by less than so many radians per radian is one of the train alone."""

_MOST = 1e3
"""Factor on K_p up to which a limit is looked for."""

MARGIN = 2.0
"""Factor on K_p that a loop should stand (6 dB): a usual gain margin."""

_POINTS = 2000


@dataclass(frozen=True, slots=True)
class LoopFeatures:
    """What the linear closed loop shows within the limits, Hz and dB; None where it shows none.

    `arf_hz`: the deepest point that has higher ground on both sides. `rf_hz`, `rf_db`: the highest
    above it.
    """

    arf_hz: float | None
    rf_hz: float | None
    rf_db: float | None


def unstable_at(unit: Unit, factor: float = 1.0) -> float | None:
    """Frequency, Hz, of what grows with K_p so many times as large; None where nothing does."""
    if unit.loop is None:
        return None
    if factor != 1.0:
        unit = unit.with_parameters(K_p=factor * unit.loop.K_p)
    plain = unit.model_copy(update={"loop": None})
    system, free = (paper_drivetrain(one, 1.0).system() for one in (unit, plain))
    slow = _SLOW * 2.0 * math.pi * unit.limits.start_hz
    for closed, alone in ((system, free), (system.opened(), free.opened())):
        for pole in _growing(closed, poles(alone), slow):
            return abs(pole.imag) / (2.0 * math.pi)
    return None


def gain_margin(unit: Unit) -> float | None:
    """Factor on K_p up to which the loop is stable; None if it is at any (to a thousandfold)."""
    low = high = 1.0
    if unstable_at(unit) is None:
        while unstable_at(unit, high) is None:
            low, high = high, 2.0 * high
            if high > _MOST:
                return None
    else:
        while unstable_at(unit, low) is not None:
            low, high = 0.5 * low, low
            if low < 1.0 / _MOST:
                return 0.0
    while high / low > 1.02:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if unstable_at(unit, middle) is None else (low, middle)
    return low


def find_unstable(unit: Unit, factor: float = 1.0) -> list[str]:
    """That the loop is unstable with so many times its K_p: key, value and what is plausible."""
    hertz = unstable_at(unit, factor)
    if hertz is None or unit.loop is None:
        return []
    margin = gain_margin(unit)
    most = (
        "with no K_p is it; see the signs and units of the drive, T_i_s and computing_s"
        if not margin
        else f"plausible: at most {margin * unit.loop.K_p / MARGIN:.3g}"
    )
    what = (
        f"the closed loop is unstable at {hertz:.4g} Hz" if factor == 1.0
        else f"the closed loop is unstable at {hertz:.4g} Hz with {factor:g} times as much"
    )  # fmt: skip
    return [f"loop.K_p {unit.loop.K_p:.4g}: {what} ({most})"]


def loop_features(unit: Unit) -> LoopFeatures:
    """ARF and RF of the linear closed loop, every mesh closed, without friction."""
    hertz = np.geomspace(unit.limits.start_hz, unit.limits.stop_hz, _POINTS)
    gain = np.log(np.abs(paper_drivetrain(unit, 1.0).system().transfer(hertz)))
    ground = np.minimum(np.maximum.accumulate(gain), np.maximum.accumulate(gain[::-1])[::-1])
    low = int(np.argmax(ground - gain))
    at_load = unit.sensor is not None and unit.sensor.at == "load"
    # What the load shows before its resonance is a hollow, and no anti-resonance.
    arf = float(hertz[low]) if ground[low] > gain[low] and not at_load else None
    high = low + int(np.argmax(gain[low:]))
    if high in (0, len(hertz) - 1):
        return LoopFeatures(arf, None, None)
    decibels = 20.0 / math.log(10.0) * float(gain[high])
    return LoopFeatures(arf, float(hertz[high]), decibels)


def _growing(
    closed: PiecewiseLinearSystem, alone: NDArray[np.complex128], slow: float
) -> Iterator[complex]:
    """Poles, rad/s, that grow for another reason than that the model of the train is undamped."""
    clock = max((law.parameters[0] for law in closed.sampled), default=0.0)
    found = poles(closed)
    for pole in found[np.argsort(-found.real)]:
        rate = abs(pole)
        if closed.closed and clock:
            # At a clock a pole above half of the rate is seen below: it is the one it came from.
            moved = np.abs(np.exp(alone / clock) - np.exp(pole / clock)) * clock
            near = alone[moved < _NEAR * np.abs(alone)]
            rate = max([rate, *np.abs(near)])
        if pole.real > _UNDAMPED * rate and abs(pole) > slow:
            yield complex(pole)
