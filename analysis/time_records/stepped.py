"""The response at each dwell of a stepped sine, as an analyser takes it.

Owns settling, the sine fits of each dwell, and their errors from cycle to cycle. Where a dwell
begins is not its business.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.time_records.cycles import Dwell
from analysis.time_records.points import Points
from daq.errors import AnalysisError
from daq.time_records.record import TimeRecord

__all__ = ["stepped_response"]

_SETTLE_SHARE = 0.5
_SAMPLES_PER_BLOCK = 12
"""Fewest samples of a block of whole cycles."""
_SAME_LEVEL = 0.03
_SAME_FREQUENCY = 2e-4


def stepped_response(
    record: TimeRecord,
    dwells: Sequence[Dwell],
    *,
    settle_cycles: int | None = None,
    integrate_cycles: int | None = None,
) -> Points:
    """Gain at every dwell.

    Parameters
    ----------
    settle_cycles
        Cycles of each dwell that are left out; None for the first half.
    integrate_cycles
        Cycles that are used; None for all that are left.

    Raises
    ------
    AnalysisError
        If no dwell is long enough.
    """
    rows, short, moving = [], 0, 0
    for dwell in dwells:
        settle = (
            int(np.ceil(_SETTLE_SHARE * dwell.cycles)) if settle_cycles is None else settle_cycles
        )
        used = dwell.cycles - settle if integrate_cycles is None else integrate_cycles
        if used < 3 or settle + used > dwell.cycles:
            short += 1
            continue
        row = _point(record, dwell, settle, used)
        if row is None:
            short += 1
            continue
        moving += row[4]
        rows.append((*row[:4], dwell.amplitude))
    if not rows:
        raise AnalysisError(
            "no dwell of the stepped sine holds the cycles that are asked for; "
            "give fewer --settle-cycles or --integrate-cycles"
        )
    notes = []
    if short:
        notes.append(f"{short} dwells are too short and were left out")
    if moving:
        notes.append(
            f"at {moving} dwells the output still settles or drifts; their error bars say so"
        )
    f, gain, along, across, amplitude = (np.array(part) for part in zip(*rows, strict=True))
    level = _levels(amplitude)
    groups = _alike(f, level)
    return Points(
        np.array([f[g].mean() for g in groups]),
        np.array([level[g[0]] for g in groups]),
        np.array([gain[g].mean() for g in groups]),
        np.array([np.sqrt(np.sum(along[g] ** 2)) / len(g) for g in groups]),
        np.array([np.sqrt(np.sum(across[g] ** 2)) / len(g) for g in groups]),
        "sine fits at each dwell",
        tuple(notes),
        settle_cycles,
        integrate_cycles,
    )


def _point(
    record: TimeRecord, dwell: Dwell, settle: int, used: int
) -> tuple[float, complex, float, float, bool] | None:
    """Frequency, gain, its errors along and across as shares, and whether it still moves."""
    f, rate = dwell.frequency_hz, record.rate_hz
    cycles = max(1, int(np.ceil(_SAMPLES_PER_BLOCK * f / rate)))
    blocks = used // cycles
    if blocks < 3:
        return None
    start = dwell.start_s + settle / f
    x, y = (_phasors(v, rate, f, start, cycles, blocks) for v in (record.input_v, record.output_v))
    if x is None or y is None or not np.abs(np.sum(x)) > 0.0:
        return None
    gain = np.sum(y) / np.sum(x)
    off = (y - gain * x) / (np.mean(x) * gain if gain != 0.0 else 1.0)
    if blocks > 6:
        # What drifts from block to block is no scatter of single blocks.
        memory = float(
            np.real(np.sum(off[1:] * np.conj(off[:-1]))) / max(np.sum(np.abs(off) ** 2), 1e-300)
        )
    else:
        memory = 0.0
    memory = float(np.clip(memory, 0.0, 0.9))
    widen = (1.0 + memory) / (1.0 - memory)
    n = blocks
    along, across = (
        float(np.sqrt(np.sum(part**2) / (n - 1) / n * widen)) for part in (off.real, off.imag)
    )
    half = n // 2
    apart = np.mean(off[:half]) - np.mean(off[half:])
    chance = 2.0 * float(np.hypot(along, across)) / float(np.sqrt(widen))
    moving = bool(abs(apart) > 3.0 * chance)
    if moving:
        along, across = (float(np.hypot(v, abs(apart) / 2.0)) for v in (along, across))
    # The scatter of few blocks is itself uncertain.
    wide = float(np.sqrt((n - 1) / max(n - 3, 1)))
    return f, complex(gain), along * wide, across * wide, moving


def _phasors(
    values: NDArray[np.float64], rate: float, f: float, start: float, cycles: int, blocks: int
) -> NDArray[np.complex128] | None:
    """Complex amplitude in each block of whole cycles, by a fit of sine, cosine and mean."""
    found = np.empty(blocks, dtype=complex)
    for k in range(blocks):
        first = int(np.ceil((start + k * cycles / f) * rate - 1e-9))
        last = int(np.ceil((start + (k + 1) * cycles / f) * rate - 1e-9))
        if first < 0 or last > values.size or last - first < 6:
            return None
        turn = 2.0 * np.pi * f * (np.arange(first, last) / rate - start)
        basis = np.stack([np.cos(turn), -np.sin(turn), np.ones_like(turn)], axis=1)
        part = np.linalg.lstsq(basis, values[first:last], rcond=None)[0]
        found[k] = part[0] + 1j * part[1]
    return found


def _levels(amplitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """Amplitudes gathered to the levels that were set."""
    order = np.argsort(amplitude)
    level = np.empty_like(amplitude)
    first = 0
    for k in range(1, order.size + 1):
        if k == order.size or amplitude[order[k]] > (1 + _SAME_LEVEL) * amplitude[order[k - 1]]:
            rows = order[first:k]
            level[rows] = float(f"{np.median(amplitude[rows]):.4g}")
            first = k
    return level


def _alike(f: NDArray[np.float64], level: NDArray[np.float64]) -> list[list[int]]:
    """Dwells of one frequency and level together, ascending by level and frequency."""
    groups: list[list[int]] = []
    for k in np.lexsort((f, level)):
        first = groups[-1][0] if groups else k
        near = abs(f[k] - f[first]) < _SAME_FREQUENCY * f[first]
        if groups and near and level[first] == level[k]:
            groups[-1].append(int(k))
        else:
            groups.append([int(k)])
    return groups
