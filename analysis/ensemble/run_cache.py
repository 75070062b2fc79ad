"""Runs of many machines through the plan of an observation, kept for the next measurement.

Owns what is simulated once for a unit and a plan and read again whenever a
measurement takes the same sweep: means and scatters, free of any bench's noise,
a file for each family. Those of the paper's units in their usual sweeps come
with lashbench. It chooses no machines and judges none.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import IO

import numpy as np

from analysis.ensemble.batch import Family, Readings, read_families
from analysis.ensemble.machine import Draws, Machine
from analysis.execution.executor import Executor
from analysis.observation.observation import Observation
from daq.configs import kept_runs
from daq.formats.atomic import keeping
from daq.untrusted.trust import own_folder, read_own
from sim.unit import Unit

__all__ = ["are_kept", "run_families", "run_name", "write_runs"]

_EDITION = 2
"""Counted up whenever the engine or the layout below change what is kept."""

Folder = Path | zipfile.Path


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
        Folder that keeps the runs; what is found there or comes with lashbench costs no
        simulation. One that others may write is not used (`daq.untrusted.trust`).
    executor
        Where they are simulated; this machine's cores if not given.

    Raises
    ------
    AnalysisError
        If a motion grew without bound even at the shortest step.
    """
    names = [run_name(unit, family, observation) for family in families]
    shapes = [(len(family), len(observation)) for family in families]
    cache = None if cache is None else own_folder(cache)
    kept = [folder for folder in (cache, _shipped()) if folder is not None]
    known = [_find(kept, *asked) for asked in zip(names, shapes, strict=True)]
    missing = [i for i, one in enumerate(known) if one is None]
    tasks = [Family(unit, tuple(families[i]), observation.plans) for i in missing]
    for i, made in zip(missing, read_families(tasks, executor, progress), strict=True):
        known[i] = made
        if cache is not None:
            _keep(cache / names[i], made)
    parts = [one for one in known if one is not None]
    return Draws(
        tuple(machine for family in families for machine in family),
        np.concatenate([mean for mean, _ in parts]),
        np.concatenate([variance for _, variance in parts]),
    )


def run_name(unit: Unit, family: Sequence[Machine], observation: Observation) -> str:
    """File name of a family's runs, another for everything that they depend on."""
    machines = [asdict(machine) for machine in family]
    known = [_EDITION, unit.physics, observation.sweeps(), machines]
    mark = hashlib.sha256(json.dumps(known, sort_keys=True).encode()).hexdigest()[:24]
    return f"runs-{mark}.npz"


def are_kept(unit: Unit, family: Sequence[Machine], observation: Observation, cache: Path) -> bool:
    """Whether the runs of a family would be read, and not simulated."""
    kept = [folder for folder in (cache, _shipped()) if folder is not None]
    name = run_name(unit, family, observation)
    return _find(kept, name, (len(family), len(observation))) is not None


def write_runs(stream: IO[bytes], readings: Readings) -> None:
    """Write the runs of a family as they are read again."""
    np.savez_compressed(stream, mean=readings[0], variance=readings[1])


def _shipped() -> Folder | None:
    """The runs that come with lashbench, one file for them all."""
    with suppress(OSError, zipfile.BadZipFile):
        return zipfile.Path(kept_runs())
    return None


def _keep(file: Path, readings: Readings) -> None:
    """Keep runs; a cache that cannot be written costs time later and nothing else."""
    with keeping(file) as stream:
        write_runs(stream, readings)


def _opened(file: Folder) -> IO[bytes]:
    """A file of kept runs, if nobody else can have written it; those that come along are ours."""
    if not isinstance(file, Path):
        return file.open("rb")
    content = read_own(file)
    if content is None:
        raise FileNotFoundError(file)
    return BytesIO(content)


def _find(folders: Sequence[Folder], name: str, shape: tuple[int, int]) -> Readings | None:
    """Kept runs, or None where there are none that can be read whole."""
    for folder in folders:
        # Damage is told by zip, zlib and numpy, each in many ways: what it hit is made anew.
        with suppress(Exception):
            with _opened(folder / name) as stream, np.load(stream, allow_pickle=False) as kept:
                mean, variance = kept["mean"], kept["variance"]
            whole = mean.shape == variance.shape == shape and mean.dtype == complex
            if whole and np.all(np.isfinite(variance)):
                return mean, variance
    return None
