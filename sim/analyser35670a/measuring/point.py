"""One measured point: drive the device, range the inputs, average, add the bench's noise.

Owns the arithmetic from the device's cycles to what the instrument reads, and
how long that takes. It sets no status bit and lets no time pass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.driving.variance import normalised_variance
from sim.analyser35670a.choices import NOISE_REFERENCE_CYCLES
from sim.analyser35670a.inputs import (
    OVERLOAD_RATIO,
    autorange,
    clipped_gain,
    coupling_gain,
    in_unit,
    nearest_range,
    range_vpk,
)
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.units import Quantity, from_volts_peak, volts_peak
from sim.instrument.plant import Dwell

__all__ = ["CHANNELS", "Point", "Timing", "dwell_cycles", "take_point"]

CHANNELS = 4
_MOST_CYCLES = 1000
_LONGEST_MOTION_S = 60.0
"""[S] Bounds of what is really driven while a point settles, and while it integrates; the rest of
longer times is only waited for."""
_LEVEL_TRIES = 4
_BURST = 4.0


@dataclass(frozen=True, slots=True)
class Timing:
    """How long the phases of a point take, s."""

    settle_s: float
    ranging_s: float
    integrate_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """What was read at one frequency.

    `amplitudes` (4,): complex amplitude at each input, V peak. `variances`
    (4,): normalised variance. `harmonics` (4, 4): per input the coefficients
    of harmonics 0 to 3 of one period, V. `overloaded` and `above_half` hold a
    bit per input.
    """

    frequency_hz: float
    amplitudes: NDArray[np.complex128]
    variances: NDArray[np.float64]
    harmonics: NDArray[np.complex128]
    ranges_dbvrms: tuple[int, ...]
    overloaded: int
    above_half: int
    timing: Timing


def dwell_cycles(instrument: InstrumentCore, frequency_hz: float) -> tuple[int, int, float, float]:
    """Settle cycles, integrate cycles, and both in seconds."""
    settle: Quantity = instrument.settings.get("SWE:STIM")
    dwell: Quantity = instrument.settings.get("SWE:DWEL")
    settle_s = settle.value if settle.unit == "S" else settle.value / frequency_hz
    asked = dwell.value * frequency_hz if dwell.unit == "S" else dwell.value
    integrate = max(1, round(min(asked, 1e12)))
    most = max(1, min(_MOST_CYCLES, int(_LONGEST_MOTION_S * frequency_hz)))
    settling = max(0, math.ceil(min(settle_s * frequency_hz - 1e-9, most)))
    return settling, min(integrate, most), settle_s, integrate / frequency_hz


def take_point(instrument: InstrumentCore, frequency_hz: float, key: tuple[int, int]) -> Point:
    """Measure at one frequency.

    Parameters
    ----------
    key
        Running numbers of measurement and point; with the seed they fix the noise.
    """
    settle, integrate, settle_s, integrate_s = dwell_cycles(instrument, frequency_hz)
    dwell = _drive(instrument, frequency_hz, settle, integrate)
    cycles, harmonics, peaks = _at_inputs(instrument, dwell, frequency_hz)
    ranges, steps = _range_inputs(instrument, peaks)
    cycles = cycles + _noise(instrument, ranges, cycles.shape, key)
    burst = instrument.faults.take("overload-burst") is not None
    overloaded = above_half = 0
    for channel, step in enumerate(ranges):
        full_scale = range_vpk(step)
        peak = _BURST * full_scale if burst and channel < 2 else float(peaks[channel])
        cycles[channel] *= clipped_gain(peak, full_scale)
        overloaded |= (1 << channel) * (peak > OVERLOAD_RATIO * full_scale)
        above_half |= (1 << channel) * (peak > 0.5 * full_scale)
    return Point(
        frequency_hz=frequency_hz,
        amplitudes=cycles.mean(axis=1),
        variances=np.array([normalised_variance(each) for each in cycles]),
        harmonics=harmonics,
        ranges_dbvrms=ranges,
        overloaded=overloaded,
        above_half=above_half,
        timing=Timing(settle_s, steps * instrument.choices.ranging_step_s, integrate_s),
    )


def _drive(instrument: InstrumentCore, frequency_hz: float, settle: int, integrate: int) -> Dwell:
    """Drive the device, with the level that auto level finds if that is on."""
    choices, settings = instrument.choices, instrument.settings
    divider = choices.device_ohm / (choices.device_ohm + choices.source_ohm)
    offset = settings.get("SOUR:VOLT:OFFS").value * divider
    level = volts_peak(settings.get("SOUR:VOLT"))
    dwell = instrument.plant.dwell(frequency_hz, level * divider, offset, settle, integrate)
    if not settings.get("SOUR:VOLT:AUTO"):
        return dwell
    for _ in range(_LEVEL_TRIES):
        better = _levelled(instrument, dwell, level)
        if better == level:
            break
        level = better
        dwell = instrument.plant.dwell(frequency_hz, level * divider, offset, settle, integrate)
    # What auto level found is where the source now stands.
    settings.put("SOUR:VOLT", from_volts_peak(level, settings.get("SOUR:VOLT").unit))
    instrument.refresh_source()
    return dwell


def _levelled(instrument: InstrumentCore, dwell: Dwell, level: float) -> float:
    """The next level to try; `level` itself when the reference is within tolerance."""
    settings = instrument.settings
    held = int(settings.get("SOUR:VOLT:REF:CHAN")[-1])
    seen = [float(abs(dwell.source_cycles.mean())), float(abs(dwell.output_cycles[:, 1].mean()))]
    reference = seen[held - 1] if held <= 2 else 0.0
    others = [amplitude for index, amplitude in enumerate(seen) if index != held - 1]
    wanted = volts_peak(settings.get("SOUR:VOLT:REF"))
    tolerance = 10.0 ** (settings.get("SOUR:VOLT:REF:TOL").value / 20.0)
    ratio = wanted / reference if reference > 0 else math.inf
    if 1.0 / tolerance <= ratio <= tolerance:
        ratio = 1.0
    most = volts_peak(settings.get("SOUR:VOLT:LIM:INP"))
    for other in others:
        if other * ratio > most and other > 0:
            ratio = most / other
    return min(level * ratio, volts_peak(settings.get("SOUR:VOLT:LIM")))


def _at_inputs(
    instrument: InstrumentCore, dwell: Dwell, frequency_hz: float
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.float64]]:
    """Cycles (4, n), harmonics (4, 4) and peaks (4,) behind the coupling of each input."""
    count = len(dwell.source_cycles)
    cycles = np.zeros((CHANNELS, count), dtype=complex)
    harmonics = np.zeros((CHANNELS, 4), dtype=complex)
    peaks = np.zeros(CHANNELS)
    cycles[0], cycles[1] = dwell.source_cycles, dwell.output_cycles[:, 1]
    harmonics[0, :2] = instrument.settings.get("SOUR:VOLT:OFFS").value, cycles[0].mean()
    harmonics[1] = dwell.output_cycles.mean(axis=0)
    peaks[:2] = dwell.source_peak_v, dwell.output_peak_v
    for channel in range(2):
        coupling = instrument.settings.get("INP#:COUP", channel + 1)
        gain = coupling_gain(frequency_hz, coupling)
        cycles[channel] *= gain
        harmonics[channel, 1:] *= gain
        if coupling == "AC":
            peaks[channel] = max(0.0, peaks[channel] - abs(harmonics[channel, 0]))
            harmonics[channel, 0] = 0.0
        if not instrument.settings.get("INP#", channel + 1):
            cycles[channel] = harmonics[channel] = peaks[channel] = 0.0
    return cycles, harmonics, peaks


def _range_inputs(
    instrument: InstrumentCore, peaks: NDArray[np.float64]
) -> tuple[tuple[int, ...], int]:
    """Range of each input, and the 2 dB steps of the one that moved most."""
    settings = instrument.settings
    ranges, most = [], 0
    for channel in range(1, CHANNELS + 1):
        kept = settings.get("VOLT#:RANG", channel)
        step = nearest_range(kept)
        if settings.get("VOLT#:RANG:AUTO", channel):
            found = autorange(step, float(peaks[channel - 1]))
            if settings.get("INP#", channel):
                most = max(most, abs(found - step) // 2)
            step = found
            settings.put("VOLT#:RANG", in_unit(step, kept.unit), channel)
        ranges.append(step)
    return tuple(ranges), most


def _noise(
    instrument: InstrumentCore,
    ranges: tuple[int, ...],
    shape: tuple[int, ...],
    key: tuple[int, int],
) -> NDArray[np.complex128]:
    """Noise of every cycle, fixed by seed and running numbers alone."""
    choices = instrument.choices
    generator = np.random.default_rng((choices.seed, *key))
    parts = generator.standard_normal((2, *shape))
    output = choices.noise_v * math.sqrt(NOISE_REFERENCE_CYCLES)
    sigma = np.array([choices.converter_noise * range_vpk(step) for step in ranges])
    sigma[1] = math.hypot(float(sigma[1]), output)
    noise: NDArray[np.complex128] = (parts[0] + 1j * parts[1]) * sigma[:, None]
    return noise
