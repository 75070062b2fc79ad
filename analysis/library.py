"""Runs of many machines through the plan of an observation, kept for the next measurement.

Owns what is simulated once for a unit and a plan and read again whenever a
measurement takes the same sweep: means and scatters, free of any bench's noise.
It chooses no machines and judges none.
"""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble import Draws, Machine, safe_cycles
from analysis.executor import Executor, LocalExecutor
from analysis.observation import Observation, readings_of_cycles
from daq.plan import SweepPlan
from sim.unit import Unit

__all__ = ["Family", "read_family", "run_families"]

_EDITION = 1
"""Counted up whenever the engine or the layout below change what is kept."""

Readings = tuple[NDArray[np.complex128], NDArray[np.float64]]
"""Mean of V_o/V_i and its relative variance, each (machines, rows)."""


@dataclass(frozen=True, slots=True)
class Family:
    """Machines that share their linear part, and so fill the lanes of one call: a task.

    `rows` are where each plan's points stand among the rows of the readings.
    """

    unit: Unit
    machines: tuple[Machine, ...]
    plans: tuple[tuple[SweepPlan, NDArray[np.int64]], ...]


def read_family(family: Family) -> Readings:
    """Take a family through its plans, on one core.

    Raises
    ------
    AnalysisError
        If a motion grew without bound even at the shortest step.
    """
    servos = [machine.servo(family.unit) for machine in family.machines]
    count = sum(len(rows) for _, rows in family.plans)
    mean = np.empty((len(servos), count), dtype=complex)
    variance = np.empty((len(servos), count))
    for plan, rows in family.plans:
        for i, cycles in enumerate(safe_cycles(servos, plan, workers=1)):
            first = cycles[..., 1].reshape(len(rows), -1)
            mean[i, rows], variance[i, rows] = readings_of_cycles(first)
    return mean, variance


def run_families(
    unit: Unit,
    families: Sequence[Sequence[Machine]],
    observation: Observation,
    *,
    cache: Path | None = None,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
) -> Draws:
    """Draws of families of machines in the sweep of an observation.

    Parameters
    ----------
    cache
        Folder that keeps the runs; what is found there costs no simulation.
    executor
        Where they are simulated; this machine's cores if not given.

    Raises
    ------
    AnalysisError
        If a motion grew without bound even at the shortest step.
    """
    machines = tuple(machine for family in families for machine in family)
    file = None if cache is None else cache / f"runs-{_mark(unit, machines, observation)}.npz"
    known = None if file is None else _read(file, (len(machines), len(observation)))
    simulated = 0.0
    if known is None:
        tasks = [Family(unit, tuple(family), observation.plans) for family in families]
        parts = (executor or LocalExecutor()).each(read_family, tasks, progress)
        known = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
        simulated = len(machines) * sum(plan.duration_s for plan, _ in observation.plans)
        if file is not None:
            _write(file, known)
    return Draws(machines, *known, simulated)


def _mark(unit: Unit, machines: Sequence[Machine], observation: Observation) -> str:
    plans = [[asdict(plan), rows.tolist()] for plan, rows in observation.plans]
    known = [_EDITION, unit.model_dump(mode="json"), plans, [asdict(m) for m in machines]]
    return hashlib.sha256(json.dumps(known, sort_keys=True).encode()).hexdigest()[:24]


def _write(file: Path, readings: Readings) -> None:
    """Keep runs; a cache that cannot be written costs time later and nothing else."""
    part = file.with_suffix(f".{os.getpid()}.part")
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as stream:
            np.savez(stream, mean=readings[0], variance=readings[1])
        part.replace(file)


def _read(file: Path, shape: tuple[int, int]) -> Readings | None:
    """Kept runs, or None where there are none that can be read whole."""
    try:
        with file.open("rb") as stream, np.load(stream, allow_pickle=False) as kept:
            mean, variance = kept["mean"], kept["variance"]
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile):
        return None
    whole = mean.shape == variance.shape == shape and mean.dtype == complex
    return (mean, variance) if whole and np.all(np.isfinite(variance)) else None
