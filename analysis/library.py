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
from dataclasses import asdict
from pathlib import Path

import numpy as np

from analysis.ensemble import Draws, Machine
from analysis.executor import Executor
from analysis.family import Family, Readings, read_families
from analysis.observation import Observation
from sim.unit import Unit

__all__ = ["run_families"]

_EDITION = 1
"""Counted up whenever the engine or the layout below change what is kept."""


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
    if known is None:
        tasks = [Family(unit, tuple(family), observation.plans) for family in families]
        known = read_families(tasks, executor, progress)
        if file is not None:
            _write(file, known)
    return Draws(machines, *known)


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
