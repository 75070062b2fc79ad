"""What a converter can be set to, checked before the first byte.

Owns the ranges. It sends nothing.
"""

from __future__ import annotations

from daq.analyser import PointSettings
from daq.errors import LimitError
from daq.plan import SweepPlan
from daq.sampled.converter import MOST_FRAMES

__all__ = ["BLIND_S", "FASTEST_HZ", "LEAST_SAMPLES", "check_settings", "check_sweep"]

LEAST_SAMPLES = 4.0
"""Samples in a period of the highest frequency: anti-alias filters end below half the rate."""
FASTEST_HZ = 192_000.0
"""Taken for the rate until it is known."""
BLIND_S = 0.1
"""Dropped of a recording before the delay is known."""
_LOWEST_HZ = 0.01
_HIGHEST_V = 10.0
_MOST_CYCLES = 100_000


def check_sweep(
    plan: SweepPlan,
    slew_vpk_per_s: float,
    input_range_vpk: tuple[float | None, float | None],
) -> None:
    """Refuse a sweep that no converter takes; raises `LimitError`, nothing is sent."""
    for level in plan.levels_vpk:
        settings = PointSettings(
            level, plan.settle_cycles, plan.integrate_cycles, plan.dc_offset_v,
            slew_vpk_per_s, input_range_vpk,
        )  # fmt: skip
        check_settings(min(plan.frequencies_hz), max(plan.frequencies_hz), settings, FASTEST_HZ)


def check_settings(low_hz: float, high_hz: float, settings: PointSettings, rate_hz: float) -> None:
    """Refuse what is out of range, all of it at once; raises `LimitError`, nothing is sent."""
    ranges = {
        "frequency (Hz)": (low_hz, _LOWEST_HZ, rate_hz / LEAST_SAMPLES),
        "highest frequency (Hz)": (high_hz, _LOWEST_HZ, rate_hz / LEAST_SAMPLES),
        "source level (V peak)": (settings.source_vpk, 1e-6, _HIGHEST_V),
        "source offset (V)": (settings.dc_offset_v, -_HIGHEST_V, _HIGHEST_V),
        "level and offset (V)": (
            settings.source_vpk + abs(settings.dc_offset_v), 0.0, _HIGHEST_V,
        ),
        "slew (V peak/s)": (settings.slew_vpk_per_s, 0.0, 1e6),
        "settle cycles": (settings.settle_cycles, 0, _MOST_CYCLES),
        "integrate cycles": (settings.integrate_cycles, 1, _MOST_CYCLES),
    }  # fmt: skip
    for channel, wanted in enumerate(settings.input_range_vpk, start=1):
        if wanted is not None:
            ranges[f"range of input {channel} (V peak)"] = wanted, 1e-3, _HIGHEST_V
    for name, (value, low, high) in ranges.items():
        if not low <= value <= high:
            raise LimitError(
                f"{name} {value:g} is not within {low:g} to {high:g}; nothing was sent"
            )
    cycles = settings.settle_cycles + settings.integrate_cycles
    if (cycles / low_hz + 2 * BLIND_S) * min(rate_hz, 48_000.0) > MOST_FRAMES:
        raise LimitError(
            f"{cycles} cycles at {low_hz:g} Hz are more than a recording holds; nothing was sent"
        )
