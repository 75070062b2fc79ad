"""The curve of one source level, ready to draw: in order of frequency, its phase unwrapped.

Owns the order, the gaps and the phase. It must never smooth, interpolate or drop a usable reading.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daq.frf import FrequencyResponse, PointFlag

__all__ = ["Trace", "level_traces", "on_one_branch"]

_TURN_DEG = 360.0
_LARGEST_STEP_DEG = 225.0
_PULL, _FORBIDDEN = 0.05, 1e9
"""Cost of a degree away from the steadiest trace, in degrees of step, and of a forbidden step."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """Readings of one level, all arrays (rows,), ascending frequency.

    `gain_db` and `phase_deg` are NaN where the reading is spoilt or unknown, so that a line breaks
    there; `spoilt_db` holds the gain of spoilt readings and NaN elsewhere. `phase_deg` has no jump
    of 360 degrees. Errors are one standard error, NaN where not stated. `source_vpk` is NaN where
    the level is not stated.
    """

    source_vpk: float
    frequency_hz: NDArray[np.float64]
    gain_db: NDArray[np.float64]
    gain_std_db: NDArray[np.float64]
    phase_deg: NDArray[np.float64]
    phase_std_deg: NDArray[np.float64]
    spoilt_db: NDArray[np.float64]


def level_traces(response: FrequencyResponse) -> list[Trace]:
    """The traces of a response, the lowest level first; a level that is not stated comes last."""
    stated = np.isfinite(response.source_vpk)
    parts = [(float(v), response.source_vpk == v) for v in np.unique(response.source_vpk[stated])]
    if not stated.all():
        parts.append((np.nan, ~stated))
    return [_trace(level, response.take(rows)) for level, rows in parts]


def on_one_branch(traces: Sequence[Trace]) -> list[Trace]:
    """Choose whole turns for each reading so that all phases lie close to the steadiest one.

    Two readings about half a turn apart, as in the noise of an anti-resonance, can be joined in
    either direction. Such a step of up to 225 degrees is taken where it leads back to the steadiest
    trace; no step is larger. The steadiest trace has the least mean step and is kept as it is.
    """
    stepped = [np.diff(trace.phase_deg[np.isfinite(trace.phase_deg)]) for trace in traces]
    steps = [float(np.mean(np.abs(one))) if len(one) else np.inf for one in stepped]
    known = [index for index, trace in enumerate(traces) if np.isfinite(trace.phase_deg).any()]
    if not known:
        return list(traces)
    chosen = min(known, key=steps.__getitem__)
    reference = traces[chosen]
    there = np.isfinite(reference.phase_deg)
    placed = []
    for index, trace in enumerate(traces):
        here = np.isfinite(trace.phase_deg)
        if index == chosen or not here.any():
            placed.append(trace)
            continue
        beside = np.interp(
            trace.frequency_hz[here], reference.frequency_hz[there], reference.phase_deg[there]
        )
        phase = trace.phase_deg.copy()
        phase[here] = _near(phase[here], beside)
        placed.append(replace(trace, phase_deg=phase))
    return placed


def _near(phase: NDArray[np.float64], beside: NDArray[np.float64]) -> NDArray[np.float64]:
    """Phases (rows,) moved by whole turns: the shortest path that stays near another (Viterbi)."""
    nearest = phase + np.round((beside - phase) / _TURN_DEG) * _TURN_DEG
    options = nearest[:, None] + _TURN_DEG * np.arange(-2.0, 3.0)
    away = _PULL * np.abs(options - beside[:, None])
    came = np.zeros(options.shape, dtype=np.intp)
    cost = away[0]
    for row in range(1, len(options)):
        step = np.abs(options[row][:, None] - options[row - 1][None, :])
        through = cost + np.where(step > _LARGEST_STEP_DEG, _FORBIDDEN, step)
        came[row] = np.argmin(through, axis=1)
        cost = np.min(through, axis=1) + away[row]
    best = np.empty(len(options))
    place = int(np.argmin(cost))
    for row in range(len(options) - 1, -1, -1):
        best[row] = options[row, place]
        place = int(came[row, place])
    return best


def _trace(source_vpk: float, part: FrequencyResponse) -> Trace:
    rows = np.argsort(part.frequency_hz, kind="stable")
    spoilt = (part.flags[rows] & PointFlag.SPOILT) != 0
    # A gain of nothing has no place on a scale in dB.
    gain_db = part.gain_db[rows]
    gain_db[~np.isfinite(gain_db)] = np.nan
    phase = np.where(spoilt, np.nan, part.phase_deg[rows])
    known = np.isfinite(phase)
    phase[known] = np.unwrap(phase[known], period=_TURN_DEG)
    return Trace(
        source_vpk=source_vpk,
        frequency_hz=part.frequency_hz[rows],
        gain_db=np.where(spoilt, np.nan, gain_db),
        gain_std_db=part.gain_std_db[rows],
        phase_deg=phase,
        phase_std_deg=part.phase_std_deg[rows],
        spoilt_db=np.where(spoilt, gain_db, np.nan),
    )
