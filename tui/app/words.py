"""Plans, points and times in the words that the screens share.

Owns the wording. It draws nothing and computes nothing but sums of durations.
"""

from __future__ import annotations

import math
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

from daq.drivers import is_simulated
from tui.app.plot.traces import FLAG_MARKS

if TYPE_CHECKING:
    from daq.plan import SweepPlan
    from daq.store_records import StoredPoint

__all__ = ["clock_in", "levels_words", "plan_words", "point_words", "span_words"]

_OVERHEAD_S = 0.5
"""What an analyser takes at a point besides its cycles; the 35670A takes about as much."""


def plan_words(plan: SweepPlan, url: str, done: int = 0) -> list[str]:
    """What a plan does and how long it will take, in two lines."""
    lowest, highest = min(plan.frequencies_hz), max(plan.frequencies_hz)
    left = max(0, plan.points - done)
    share = left / plan.points
    driving_s = plan.duration_s * share
    total_s = driving_s + _OVERHEAD_S * left
    resumed = f", {done} of them stored" if done else ""
    first = (
        f"{plan.points} points{resumed}: {len(plan.frequencies_hz)} from {lowest:g} to "
        f"{highest:g} Hz, {plan.direction}, at {levels_words(plan)} V peak"
    )
    cycles = f"{plan.settle_cycles}+{plan.integrate_cycles} cycles a point"
    if is_simulated(url) and "realtime" not in url:
        return [
            first,
            f"{cycles}; simulated, faster than the {span_words(total_s)} of a real sweep",
        ]
    return [
        first,
        f"{cycles}; {span_words(driving_s)} driving, about {span_words(total_s)} in all: "
        f"done about {clock_in(total_s)}",
    ]


def levels_words(plan: SweepPlan) -> str:
    """The levels, with commas."""
    return ", ".join(f"{level:g}" for level in plan.levels_vpk)


def point_words(stored: StoredPoint) -> str:
    """A point as a line: frequency, level, gain, error, phase, what is odd."""
    point = stored.point
    odd = "".join(f" {words.upper()}" for flag, _, words in FLAG_MARKS if point.flags & flag)
    where = f"{point.frequency_hz:.2f} Hz at {stored.source_vpk:g} V:"
    size = abs(point.gain)
    if not (size > 0 and math.isfinite(size)):
        return f"{where} no reading{odd}"
    error = "" if point.gain_std_db is None else f" +-{point.gain_std_db:.2f}"
    angle = math.degrees(math.atan2(point.gain.imag, point.gain.real))
    return f"{where} {20 * math.log10(size):.2f}{error} dB {angle:.0f} deg{odd}"


def span_words(seconds: float) -> str:
    """A duration as m:ss or h:mm:ss."""
    whole = round(max(0.0, seconds))
    hours, rest = divmod(whole, 3600)
    minutes, secs = divmod(rest, 60)
    return f"{hours}:{minutes:02d}:{secs:02d}" if hours else f"{minutes}:{secs:02d}"


def clock_in(seconds: float) -> str:
    """The time of day after a duration."""
    return (datetime.now() + timedelta(seconds=seconds)).strftime("%H:%M:%S")
