"""What the driver of a sampled bench assumes, as checks on a real converter.

Owns the list of `docs/sampled.md`. A check that sets a level says that it drives, and is followed
by the safe-off recipe.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.analyser import PointSettings, SweepPoint
from daq.driving.first_day import WORDS, Check, FirstDay, at_rest
from daq.driving.variance import normalised_variance
from daq.frf import PointFlag

__all__ = ["CHECKS"]

_BAND_HZ = (100.0, 200.0)
_READINGS = 20
_SLEW_S = 1.0
"""Time in which the level is ramped up, s."""
_ALIKE_S = 2e-4
"""Measurements of the delay agree within this, in noise."""
_LONG_CYCLES = 2000
_NOISY = 0.1
"""Normalised variance above which its scale cannot be told."""


def _measured(
    day: FirstDay, frequencies_hz: Sequence[float], integrate_cycles: int = 10
) -> list[SweepPoint]:
    settings = PointSettings(
        day.level_vpk, 5, integrate_cycles, slew_vpk_per_s=day.level_vpk / _SLEW_S
    )
    day.analyser.prepare(*_BAND_HZ, settings)
    return list(day.analyser.sweep(frequencies_hz))


def _delay_of(point: SweepPoint) -> float:
    return float(point.detail["delay_s"])


def _identity(day: FirstDay) -> tuple[bool | None, str]:
    found = day.analyser.identify()
    return found.model == "SAMPLED", f"{found.serial}, revision {found.revision}"


def _loop_back(day: FirstDay) -> tuple[bool | None, str]:
    """The driver refuses by itself what is not within its limits."""
    (point,) = _measured(day, (150.0,))
    level = float(point.detail["source_vpk"])
    seen = f"{level:.5g} V peak on input 1 where {day.level_vpk:g} V was set"
    return abs(
        level / day.level_vpk - 1.0
    ) < 0.01, f"{seen}; delay {1000 * _delay_of(point):.4g} ms"


def _delay(day: FirstDay) -> tuple[bool | None, str]:
    """Each preparation after the safe-off recipe measures it anew."""
    found = []
    for _ in range(3):
        day.make_safe()
        day.listen()
        found += [_delay_of(point) for point in _measured(day, (150.0,))]
    told = ", ".join(f"{1000 * one:.4g}" for one in found)
    return max(found) - min(found) < _ALIKE_S, f"delays of three starts: {told} ms"


def _points(day: FirstDay) -> tuple[bool | None, str]:
    points = _measured(day, (110.0, 150.0, 190.0))
    known = all(np.isfinite(point.gain) and not point.flags for point in points)
    return known, ", ".join(
        f"{p.frequency_hz:g} Hz {abs(p.gain):.4g}" + (f" ({p.flags.name})" if p.flags else "")
        for p in points
    )


def _long(day: FirstDay) -> tuple[bool | None, str]:
    (point,) = _measured(day, (200.0,), _LONG_CYCLES)
    return not point.flags & PointFlag.SPOILT, f"{_LONG_CYCLES} cycles at 200 Hz, {point.flags!r}"


def _ramp(day: FirstDay) -> tuple[bool | None, str]:
    settings = PointSettings(day.level_vpk, 5, 10, slew_vpk_per_s=day.level_vpk / _SLEW_S)
    day.analyser.prepare(*_BAND_HZ, settings)
    between = None
    for number, _ in enumerate(day.analyser.sweep((150.0, 160.0))):
        if number == 0:
            between = day.drives("between two points")
    if between is None:
        return None, "not watched"
    day.make_safe()
    steps = day.look("the level rose and fell in a second: without a step?", False)
    if steps is None:
        return None, f"drives between points: {WORDS[between]}; ramp: not watched"
    seen = f"drives between points: {WORDS[between]}; level rises and falls without a step: "
    return between and steps, seen + WORDS[steps]


def _variance(day: FirstDay) -> tuple[bool | None, str]:
    near = (150.0 + np.arange(_READINGS) / 64.0).tolist()
    points = _measured(day, near)
    gains = np.array([point.gain for point in points])
    told = [point.gain_std_db for point in points if point.gain_std_db is not None]
    noise = [sum(point.variances) for point in points if point.variances is not None]
    if not told or not noise:
        return None, "no error came"
    if np.median(noise) > _NOISY:
        return None, f"normalised variance {np.median(noise):.3g}: measure a resistor divider"
    scatter = float(20 / np.log(10) * np.sqrt(normalised_variance(gains) / 2))
    bar = float(np.median(told))
    seen = f"gain scatters by {scatter:.3g} dB, its error bar is {bar:.3g} dB"
    return 0.5 < scatter / bar < 2.0, seen


CHECKS = (
    Check("identity", "a converter of lashbench's own", "daq/sampled/analyser.py", _identity),
    Check("safe-off", "the output is at rest after the recipe", "daq/sampled/safe.py", at_rest),
    Check("loop-back", "the output is on input 1, full scale as in the address",
          "daq/sampled/analyser.py", _loop_back, drives=True),
    Check("delay", "the same at every start", "daq/sampled/lockin.py", _delay, drives=True),
    Check("points", "each step of the sine is one point", "daq/sampled/analyser.py", _points,
          drives=True),
    Check("long record", "no sample is lost in 10 s", "daq/sampled/stream.py", _long, drives=True),
    Check("ramp", "the level is ramped, and driven between points", "daq/sampled/converter.py",
          _ramp, drives=True),
    Check("normalised variance", "cycles scatter independently", "daq/driving/variance.py",
          _variance, drives=True),
    Check("safe-off in the end", "the output is at rest after all that drove",
          "daq/sampled/safe.py", at_rest),
)  # fmt: skip
"""In the order in which they are made."""
