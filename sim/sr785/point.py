"""One measured point of the SR785: drive, range, average over whole cycles, add the bench's noise.

Owns the arithmetic from the device's cycles to what is read, and how long that takes. It sets no
status bit and lets no time pass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.driving.variance import normalised_variance
from sim.instrument.plant import Dwell
from sim.sr785.choices import NOISE_REFERENCE_CYCLES
from sim.sr785.parts import InstrumentCore

__all__ = ["Point", "dwell_cycles", "take_point"]

_MOST_CYCLES = 1000
_LONGEST_MOTION_S = 60.0
"""[S] Bounds of what is really driven; the rest of longer times is only waited for."""
_LOWEST_DB, _HIGHEST_DB = -50, 34
_FORCED_DB = 35.0
_AC_CORNER_HZ = 0.16
_LEVEL_TRIES = 4
_BURST = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """What was read at one frequency; arrays hold both channels, shape (2,)."""

    frequency_hz: float
    amplitudes: NDArray[np.complex128]
    """V peak, phase relative to the source."""
    variances: NDArray[np.float64]
    integrated_s: float
    above_half: tuple[bool, bool]
    overloaded: tuple[bool, bool]
    forced: tuple[bool, bool]
    ranged: tuple[bool, bool]
    settle_s: float
    ranging_s: float


def dwell_cycles(instrument: InstrumentCore, frequency_hz: float) -> tuple[int, int]:
    """Cycles that a point settles and integrates: time or cycles, whichever is longer.

    The integration is rounded up to whole cycles.
    """
    get = instrument.settings.get
    settle_s = max(get("SSTM"), get("SSCY") / frequency_hz)
    integrate_s = max(get("SITM"), get("SICY") / frequency_hz)
    return (
        math.ceil(settle_s * frequency_hz - 1e-9),
        max(1, math.ceil(integrate_s * frequency_hz - 1e-9)),
    )


def take_point(instrument: InstrumentCore, frequency_hz: float, key: tuple[int, int]) -> Point:
    """Measure at one frequency.

    Parameters
    ----------
    key
        Running numbers of sweep and point; with the seed they fix the noise.
    """
    settle, integrate = dwell_cycles(instrument, frequency_hz)
    most = max(1, min(_MOST_CYCLES, int(_LONGEST_MOTION_S * frequency_hz)))
    driven = min(settle, most), min(integrate, most)
    dwell = _levelled(instrument, frequency_hz, *driven)
    cycles, peaks = _at_inputs(instrument, dwell, frequency_hz)
    burst = instrument.faults.take("overload-burst") is not None
    ranged, forced, steps = [], [], 0
    for channel in (0, 1):
        before, after, over = _range(instrument, channel, float(peaks[channel]))
        steps = max(steps, abs(after - before) // 2)
        ranged.append(after != before)
        forced.append(over)
    cycles = cycles + _noise(instrument, cycles.shape, key)
    above, overloaded = [], []
    for channel in (0, 1):
        full_v = 10.0 ** (instrument.settings.get(f"I{channel + 1}RG") / 20.0)
        peak = _BURST * full_v if burst else float(peaks[channel])
        cycles[channel] *= _clipped(peak, full_v)
        above.append(peak > 0.5 * full_v)
        overloaded.append(peak > full_v)
    return Point(
        frequency_hz=frequency_hz,
        amplitudes=cycles.mean(axis=1),
        variances=np.array([normalised_variance(each) for each in cycles]),
        integrated_s=integrate / frequency_hz,
        above_half=(above[0], above[1]),
        overloaded=(overloaded[0], overloaded[1]),
        forced=(forced[0], forced[1]),
        ranged=(ranged[0], ranged[1]),
        settle_s=settle / frequency_hz,
        ranging_s=steps * instrument.choices.ranging_step_s,
    )


def _levelled(
    instrument: InstrumentCore, frequency_hz: float, settle: int, integrate: int
) -> Dwell:
    """Drive the device, with the level that auto level finds if that is on."""
    get = instrument.settings.get

    def drive(level_v: float) -> Dwell:
        offset_v = instrument.source.offset_v
        return instrument.plant.dwell(frequency_hz, level_v, offset_v, settle, integrate)

    level_v = instrument.source.target_vpk
    dwell = drive(level_v)
    held = int(get("SSAL"))
    for _ in range(_LEVEL_TRIES if held and level_v > 0 else 0):
        seen_v = float(abs((dwell.source_cycles, dwell.output_cycles[:, 1])[held - 1].mean()))
        ratio = get("SSRF") / seen_v if seen_v > 0 else math.inf
        if get("SSLL") <= -20.0 * math.log10(max(ratio, 1e-9)) <= get("SSUL"):
            break
        level_v = min(level_v * ratio, get("SMAX"))
        dwell = drive(level_v)
    instrument.levelled_vpk = level_v if held else None
    return dwell


def _at_inputs(
    instrument: InstrumentCore, dwell: Dwell, frequency_hz: float
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Cycles (2, n) and peaks (2,) behind coupling and weighting of each input."""
    cycles = np.array([dwell.source_cycles, dwell.output_cycles[:, 1]], dtype=complex)
    means = instrument.source.offset_v, float(dwell.output_cycles[:, 0].mean().real)
    peaks = np.array([dwell.source_peak_v, dwell.output_peak_v])
    for channel in (0, 1):
        if instrument.settings.get(f"I{channel + 1}CP"):
            ratio = 1j * frequency_hz / _AC_CORNER_HZ
            cycles[channel] *= ratio / (1.0 + ratio)
            peaks[channel] = max(0.0, peaks[channel] - abs(means[channel]))
        if instrument.settings.get(f"I{channel + 1}AW"):
            cycles[channel] *= _a_weighting(frequency_hz)
    return cycles, peaks


def _range(instrument: InstrumentCore, channel: int, peak_v: float) -> tuple[int, int, bool]:
    """Range before and after, in dBVpk, and whether the input was forced to the highest."""
    settings, n = instrument.settings, channel + 1
    before = after = int(settings.get(f"I{n}RG"))
    peak_db = 20.0 * math.log10(max(peak_v, 1e-6))
    if settings.get(f"A{n}RG") or settings.get("SSAL"):
        fitting = min(max(_LOWEST_DB, 2 * math.ceil(peak_db / 2)), _HIGHEST_DB)
        after = max(before, fitting)
        if settings.get(f"I{n}AR") and peak_db < before - 20.0 * math.log10(2.0):
            after = fitting
    forced = peak_db > _FORCED_DB
    after = _HIGHEST_DB if forced else after
    settings.put(f"I{n}RG", after)
    return before, after, forced


def _noise(
    instrument: InstrumentCore, shape: tuple[int, ...], key: tuple[int, int]
) -> NDArray[np.complex128]:
    choices = instrument.choices
    parts = np.random.default_rng((choices.seed, *key)).standard_normal((2, *shape))
    full_v = [10.0 ** (instrument.settings.get(f"I{n}RG") / 20.0) for n in (1, 2)]
    sigma = choices.converter_noise * np.array(full_v)
    sigma[1] = math.hypot(sigma[1], choices.noise_v * math.sqrt(NOISE_REFERENCE_CYCLES))
    noise: NDArray[np.complex128] = (parts[0] + 1j * parts[1]) * sigma[:, None]
    return noise


def _clipped(peak_v: float, full_v: float) -> float:
    """Fundamental left of a sine that exceeds the range: the describing function of a limiter."""
    if peak_v <= full_v:
        return 1.0
    q = full_v / peak_v
    return 2.0 / math.pi * (math.asin(q) + q * math.sqrt(1.0 - q * q))


def _a_weighting(hz: float) -> float:
    square = hz * hz
    shape = 12194.0**2 * square * square / (
        (square + 20.6**2)
        * math.sqrt((square + 107.7**2) * (square + 737.9**2))
        * (square + 12194.0**2)
    )  # fmt: skip
    return shape * 10.0 ** (2.0 / 20.0)
