"""What the network reads: a set of readings as arrays of fixed shape, whatever the sweep was.

Owns the scaling of readings and their order: one row per level of each sweep, points in ascending
frequency. Training runs and measurements pass through the same function. It must not simulate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["CHANNELS", "MOST_POINTS", "ROW_FACTS", "SweptLevels", "network_inputs"]

MOST_POINTS = 64
"""Points of a row; sweeps with more are averaged in bins of neighbouring points."""

CHANNELS = (
    "valid",
    "gain",
    "phase_sin",
    "phase_cos",
    "scatter",
    "noise",
    "phase_known",
    "scatter_known",
    "position",
    "spacing",
    "wave_sin_1",
    "wave_cos_1",
    "wave_sin_2",
    "wave_cos_2",
    "off_gain",
    "off_phase",
    "off_scatter",
    "off_known",
)
"""Channels of a point. `gain`: log gain over the reference. `phase_*`: of the phase beyond the
reference. `scatter`: log of the relative cycle-to-cycle scatter of one cycle. `noise`: log of the
relative reading noise. `position`: log frequency between ARF and RF. `wave_*`: of `position`.
`off_*`: departures from the datasheet's machine, see `analysis.inference.nominal`."""

ROW_FACTS = ("level", "down", "settle", "integrate", "offset")
"""Facts of a row: log of level over the unit's limit, direction, log of cycles, offset by level."""

_GAIN_LIMIT = 4.0
_WAVES = (0.5, 2.0)


@dataclass(frozen=True, slots=True, eq=False)
class SweptLevels:
    """Levels of one sweep, of n machines or measurements.

    `frequency_hz` (F,) ascending; `levels_vpk` (L,); `gain` (n, L, F) complex V_o/V_i, NaN where
    a point is missing; `scatter` (n, L, F): relative scatter of one cycle over both components,
    NaN where not known; `noise_v` (n,): reading noise per component of a mean, V;
    `phase_known`: of a shape that broadcasts to that of `gain`.
    """

    frequency_hz: NDArray[np.float64]
    levels_vpk: NDArray[np.float64]
    gain: NDArray[np.complex64]
    scatter: NDArray[np.float32]
    noise_v: NDArray[np.float32]
    phase_known: NDArray[np.bool_]
    down: bool
    settle_cycles: int
    integrate_cycles: int
    offset_v: float


def network_inputs(
    swept: SweptLevels,
    reference: NDArray[np.complex128],
    landmarks_hz: Sequence[float],
    most_v: float,
    departures: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Arrays (n, L, C, G) of points and (n, L, R) of rows.

    Parameters
    ----------
    reference
        Response (F,) that scales the gains; see `analysis.inference.plans.reference_response`.
    landmarks_hz
        ARF and RF that scale the frequencies.
    most_v
        Highest source level of the unit, V peak.
    departures
        (n, 4, L, F): log gain, phase and log scatter in standard deviations of single runs of the
        datasheet's machine, and the logarithm of that of the gain.
    """
    count, levels, points = swept.gain.shape
    quotient = swept.gain / reference
    present = np.isfinite(quotient.real)
    quotient = np.where(present, quotient, 1.0)
    size = np.maximum(np.abs(quotient), 1e-6)
    unit_phase = quotient / size
    volts = np.maximum(np.abs(swept.gain), 1e-9) * swept.levels_vpk[:, None]
    noise = np.log(np.maximum(swept.noise_v[:, None, None] / np.where(present, volts, 1.0), 1e-6))
    scatter_known = np.isfinite(swept.scatter) & (swept.scatter > 0.0) & present
    scatter = np.log(np.where(scatter_known, swept.scatter, 1.0) + 1e-6)
    phase_known = present & swept.phase_known
    arf, rf = np.log(landmarks_hz)
    position = (np.log(swept.frequency_hz) - arf) / (rf - arf)
    spacing = np.log(np.gradient(position) if points > 1 else np.ones(1))
    everywhere = (count, levels, points)
    parts = [
        present,
        np.clip(np.log(size), -_GAIN_LIMIT, _GAIN_LIMIT),
        np.where(phase_known, unit_phase.imag, 0.0),
        np.where(phase_known, unit_phase.real - 1.0, 0.0),
        np.where(scatter_known, np.clip(scatter, -12.0, 2.0) / 3.0 + 1.0, 0.0),
        np.clip(noise, -12.0, 2.0) / 3.0 + 1.5,
        phase_known,
        scatter_known,
        np.broadcast_to(position, everywhere),
        np.broadcast_to(spacing / 2.0 + 1.0, everywhere),
    ]
    for wave in _WAVES:
        turn = np.pi * wave * position
        parts += [
            np.broadcast_to(np.sin(turn), everywhere),
            np.broadcast_to(np.cos(turn), everywhere),
        ]
    parts += [np.arcsinh(np.nan_to_num(one)) / 2.0 for one in departures[:, :3].swapaxes(0, 1)]
    parts.append(np.nan_to_num(departures[:, 3]) / 2.0 + 1.0)
    stacked = np.stack([np.asarray(p, dtype=np.float32) for p in parts], axis=2)
    # Channels of a missing point are zero, and so is padding.
    stacked *= np.where(present, 1.0, 0.0).astype(np.float32)[:, :, None]
    facts = np.empty((count, levels, len(ROW_FACTS)), dtype=np.float32)
    facts[:, :, 0] = np.log(swept.levels_vpk / most_v)
    facts[:, :, 1] = swept.down
    facts[:, :, 2] = np.log(max(swept.settle_cycles, 1) / 20.0)
    facts[:, :, 3] = np.log(swept.integrate_cycles / 30.0)
    facts[:, :, 4] = swept.offset_v / swept.levels_vpk
    return _in_slots(stacked), facts


def _in_slots(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Bring (n, L, C, F) to (n, L, C, MOST_POINTS): pad, or average neighbours."""
    *shape, count = points.shape
    if count <= MOST_POINTS:
        padded = np.zeros((*shape, MOST_POINTS), dtype=np.float32)
        padded[..., :count] = points
        return padded
    edges = np.linspace(0, count, MOST_POINTS + 1).round().astype(int)[:-1]
    sums = np.add.reduceat(points, edges, axis=-1)
    held = np.maximum(sums[:, :, :1], 1.0)
    averaged = sums / held
    averaged[:, :, 0] = sums[:, :, 0] > 0.0
    return averaged.astype(np.float32)
