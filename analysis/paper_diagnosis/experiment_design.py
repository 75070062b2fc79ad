"""Which measurement would tell two sets apart that the paper's numbers leave tied.

Owns a small grid of sweeps within the unit's limits and the choice among
them. Both sets are simulated at places where each agrees with what was
measured; nothing else is asked of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.diagnosis.experiment_design import NextMeasurement
from analysis.emulation.likelihood import TEMPERATURE
from analysis.paper_diagnosis.features import LONGEST_STEP_S, Reading
from analysis.paper_diagnosis.posterior import Judged
from daq.plan import SweepPlan, spaced_frequencies
from sim.paper_scheme import PAPER_LEVEL_VPK
from sim.response import simulate_cycles
from sim.unit import Unit

__all__ = ["propose_sweep"]

_POINTS, _COARSE = 31, 11
"""Frequencies of a proposed sweep, and how many of them are simulated to judge it."""

_LEVELS = (0.2, 0.5, 1.0, 2.0)
"""Levels tried, as multiples of the paper's."""

_FLOOR = 0.05
"""Error of a reading in log gain or phase, rad: half a decibel, three degrees."""

_ENOUGH = 0.9


def propose_sweep(
    unit: Unit,
    first: Judged,
    second: Judged,
    reading: Reading,
    places: int,
    rng: np.random.Generator,
) -> NextMeasurement | None:
    """The sweep that parts two sets furthest, or a shorter one that does nearly as well.

    None where the unit's limits allow no sweep.
    """
    machines = [
        [one.agreement.hypothesis.machine(p, int(rng.integers(1 << 31))) for p in drawn]
        for one in (first, second)
        for drawn in (one.agreement.draw(places, rng),)
    ]
    servos = [machine.servo(unit) for of_set in machines for machine in of_set]
    found: list[tuple[float, SweepPlan]] = []
    for plan in _plans(unit, reading):
        runs = np.array(simulate_cycles(servos, plan, longest_step_s=LONGEST_STEP_S))
        log_response = np.log(runs[..., 1].mean(axis=-1))  # (servos, levels, points)
        for number, level in enumerate(plan.levels_vpk):
            sigma = _separation(log_response[:places, number], log_response[places:, number])
            grid = spaced_frequencies(plan.frequencies_hz[0], plan.frequencies_hz[-1], _POINTS)
            found.append((sigma, replace(plan, frequencies_hz=grid, levels_vpk=(level,))))
    if not found:
        return None
    most = max(sigma for sigma, _ in found)
    sigma, plan = min(
        (one for one in found if one[0] >= _ENOUGH * most), key=lambda one: one[1].duration_s
    )
    names = ("+".join(first.effects) or "none", "+".join(second.effects) or "none")
    return NextMeasurement(unit.name, plan, names, sigma)


def _plans(unit: Unit, reading: Reading) -> Iterator[SweepPlan]:
    """Sweeps up and down over a band wider than the features, coarse; all levels side by side."""
    limits = unit.limits
    levels = tuple(
        round(share * PAPER_LEVEL_VPK, 3)
        for share in _LEVELS
        if share * PAPER_LEVEL_VPK <= limits.source_vpk
    )
    start = max(0.6 * float(reading.values[0]), limits.start_hz)
    stop = min(1.6 * float(reading.values[2]), limits.stop_hz)
    if not levels or start >= stop:
        return
    grid = spaced_frequencies(start, stop, _COARSE)
    yield SweepPlan(grid, levels)
    yield SweepPlan(grid, levels, direction="down")


def _separation(first: NDArray[np.complex128], second: NDArray[np.complex128]) -> float:
    """Standard deviations between two sets of runs (runs, points) of log response.

    Points of a sweep err together, so all of it counts as so many fewer.
    """
    squares = 0.0
    for a, b in ((first.real, second.real), _turned(first.imag, second.imag)):
        variance = a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1) + 2.0 * _FLOOR**2
        squares += float(np.sum((a.mean(axis=0) - b.mean(axis=0)) ** 2 / variance))
    return float(np.sqrt(squares * (_POINTS / _COARSE) / TEMPERATURE))


def _turned(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Phases brought to within half a turn of their common direction."""
    middle = np.angle(np.exp(1j * np.concatenate([first, second])).mean(axis=0))
    return tuple(middle + np.angle(np.exp(1j * (part - middle))) for part in (first, second))
