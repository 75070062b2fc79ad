"""Servos taken through a plan of a signal, and the response that the estimator of it reads.

Owns levels, periods and segments, in order. It knows no single sine and judges nothing.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from math import ceil

import numpy as np
from numpy.typing import NDArray

from daq.errors import AnalysisError
from daq.excitation.plan import ExcitedPlan
from sim.engine.by_signal import SignalDrive, shortest_step_s
from sim.engine.effort import spend
from sim.engine.engine import HARMONICS, LONGEST_STEP_S
from sim.excitation.readings import h1_values, lines_of, period_values
from sim.servo import Servo, groups_alike, linear_key, parameters_of, states_at_start

__all__ = ["cycles_by_signal"]


def cycles_by_signal(
    servos: Sequence[Servo],
    plan: ExcitedPlan,
    *,
    longest_step_s: float = LONGEST_STEP_S,
    shorter_steps_s: Sequence[float] = (),
    single: bool = False,
    workers: int | None = None,
    part_done: Callable[[float], None] = lambda share: None,
) -> list[NDArray[np.complex128]]:
    """What `sim.response.simulate_cycles` gives of a sweep, for a signal.

    Parameters
    ----------
    shorter_steps_s
        Longest steps that are tried in turn where a motion grows without bound.
    part_done
        Told the share done of each group, from the thread that simulated it.

    Returns
    -------
    list of ndarray
        One per servo, (levels, points, averages, 4): the gain in each average in column 1, the
        mean output over the level in column 0, NaN in the others.

    Raises
    ------
    AnalysisError
        If a motion grew without bound, at the last of the steps, or the signal is too long.
    """
    workers = workers or len(os.sched_getaffinity(0))
    groups = list(groups_alike(servos, len(plan.levels_vpk), workers))
    steps_s = (longest_step_s, *shorter_steps_s)

    def read(group: Sequence[int]) -> NDArray[np.complex128]:
        some = [servos[i] for i in group]
        for at, step_s in enumerate(steps_s):
            try:
                return _read(some, plan, step_s, single, part_done)
            except AnalysisError:
                if at == len(steps_s) - 1:
                    raise
        raise AssertionError

    with ThreadPoolExecutor(workers) as pool:
        done = list(pool.map(read, groups))
    spend(len(servos) * plan.duration_s, len(servos) * plan.duration_s / longest_step_s)
    results = [np.empty(0, dtype=complex)] * len(servos)
    for group, found in zip(groups, done, strict=True):
        for position, index in enumerate(group):
            results[index] = found[position]
    return results


def _read(
    servos: Sequence[Servo],
    plan: ExcitedPlan,
    step_s: float,
    single: bool,
    part_done: Callable[[float], None],
) -> NDArray[np.complex128]:
    """(servos, levels, points, averages, 4) of servos that share their linear part."""
    signal, levels = plan.signal, np.asarray(plan.levels_vpk, dtype=float)
    amplitude = np.tile(levels, len(servos))
    offset = np.full(len(amplitude), plan.dc_offset_v)
    at = signal.nearest(plan.frequencies_hz)
    begin = parameters_of(servos, len(levels)), states_at_start(servos, len(levels))
    system = servos[0].system
    if signal.kind == "periodic":
        lines, phasors = np.asarray(signal.lines, dtype=np.int64), signal.phasors()
        drive = SignalDrive(system, signal.period_s, lines, phasors, step_s, single)
        parts = [drive.samples] * plan.parts
        periods = _told(drive.run(*begin, amplitude, offset, parts), len(parts), part_done)
        kept = [
            (lines_of(one, lines[at]), np.mean(one, axis=0, dtype=float))
            for number, one in enumerate(periods)
            if number >= plan.settle_cycles
        ]
        outputs, means = (np.array(values) for values in zip(*kept, strict=True))
        gain = period_values(
            outputs * drive.recorded()[at][:, None], phasors[at][:, None] * amplitude
        )
        means = means[:, None] / amplitude
    else:
        gain, means = _by_noise(servos, plan, step_s, single, part_done, begin, amplitude, offset)
    values = np.full((*gain.shape, HARMONICS), np.nan, dtype=complex)
    values[..., 1], values[..., 0] = gain, means
    # (averages, points, servos x levels, 4)
    lanes = values.reshape(*gain.shape[:2], len(servos), len(levels), HARMONICS)
    return np.ascontiguousarray(lanes.transpose(2, 3, 1, 0, 4))


def _by_noise(
    servos: Sequence[Servo],
    plan: ExcitedPlan,
    step_s: float,
    single: bool,
    part_done: Callable[[float], None],
    begin: tuple[NDArray[np.float64], NDArray[np.float64]],
    amplitude: NDArray[np.float64],
    offset: NDArray[np.float64],
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Gain (segments, points, lanes) and mean output (segments, 1, lanes), over the level."""
    signal, system = plan.signal, servos[0].system
    halves = plan.parts
    segments = ceil(halves / 2)
    # Machines that differ in a datasheet value are driven by another record: what a record leaves
    # to chance is part of what they scatter by.
    mark = hashlib.sha256(linear_key(system)).digest()
    rng = np.random.default_rng([plan.realisation, int.from_bytes(mark[:8], "little")])
    lines, phasors = signal.drawn(rng, segments)
    whole = segments * signal.period_s
    # Half segments of as many samples each: as short a step as gives them.
    half = ceil(signal.period_s / (8.0 * min(step_s, shortest_step_s(whole, lines))))
    longest = signal.period_s / (8 * half) * (1.0 + 1e-12)
    drive = SignalDrive(system, whole, lines, phasors, longest, single)
    assert drive.samples == 2 * segments * half
    spectrum = np.zeros(drive.samples // 2 + 1, dtype=complex)
    spectrum[lines] = -0.5j * drive.samples * phasors
    fed = np.roll(np.fft.irfft(spectrum, drive.samples), -1)
    wanted = np.asarray(signal.lines, dtype=np.int64)[signal.nearest(plan.frequencies_hz)]
    window = np.hanning(2 * half + 1)[:-1, None]
    recorded = _at_lines(drive.recorded(), lines, wanted * segments)
    outputs, inputs, means = [], [], []
    before: NDArray | None = None
    run = drive.run(*begin, amplitude, offset, [half] * halves)
    for number, out in enumerate(_told(run, halves, part_done)):
        if before is not None and number > 2 * plan.settle_cycles:
            both = np.concatenate([before, out]).astype(float)
            there = fed[(number - 1) * half : (number + 1) * half, None]
            means.append(both.mean(axis=0))
            outputs.append(lines_of(window * (both - means[-1]), wanted) * recorded[:, None])
            inputs.append(lines_of(window * there, wanted) * amplitude)
        before = out
    gain = h1_values(np.array(outputs), np.array(inputs))
    return gain, np.array(means)[:, None] / amplitude


def _at_lines(
    values: NDArray[np.complex128], lines: NDArray[np.int64], wanted: NDArray[np.int64]
) -> NDArray[np.complex128]:
    return np.asarray(values[np.clip(np.searchsorted(lines, wanted), 0, len(lines) - 1)])


def _told(
    parts: Iterator[NDArray], count: int, part_done: Callable[[float], None]
) -> Iterator[NDArray]:
    for number, one in enumerate(parts, start=1):
        part_done(number / count)
        yield one
