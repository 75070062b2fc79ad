"""Simulating ahead what a sweep's estimate and its diagnosis will be held against.

Owns which of it does not depend on what will be measured, and in which order it
is made: runs at every place that an estimate of it alone may ask for, then what a search
starts from. It judges nothing; what it makes lies where both look for it.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from analysis.atlas import coarse_stride, make_atlas
from analysis.estimate import free_axes
from analysis.executor import Executor
from analysis.lattice import every_family
from analysis.library import run_families
from analysis.observation import Observation
from analysis.progress import Progress, part_of
from daq.errors import InputError
from daq.trust import distrust
from sim.effort import counting
from sim.unit import Unit

__all__ = ["prepare_sweep"]

_AT_ONCE = 8
"""Families that are simulated before they are kept: what is interrupted loses no more."""


def prepare_sweep(
    unit: Unit,
    observation: Observation,
    cache: Path,
    *,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> float:
    """Simulate and keep what depends on a unit and a sweep alone.

    What is kept already is left as it is, so that one that was interrupted goes on.

    Parameters
    ----------
    observation
        A measured sweep, or one that will be (`analysis.observation.unread`).
    cache
        Folder that keeps it; made if it is not there.

    Returns
    -------
    float
        Seconds of motion that had to be simulated.

    Raises
    ------
    InputError
        If nothing can be written into the folder, or others may write there.
    AnalysisError
        If a motion grew without bound.
    """
    _check_usable(cache)
    searched = unit.stages == 2
    with counting() as effort:
        families = every_family(free_axes(unit), observation, seed=0)
        share = 0.5 if searched else 1.0
        for first in range(0, len(families), _AT_ONCE):
            some = families[first : first + _AT_ONCE]
            low, high = first / len(families), (first + len(some)) / len(families)
            tell = part_of(progress, share * low, share * high, "for the estimate")
            run_families(unit, some, observation, cache=cache, executor=executor, progress=tell)
        if searched:
            coarse = observation.thinned(coarse_stride(observation))
            for rare, low, high in ((False, 0.5, 0.85), (True, 0.85, 1.0)):
                tell = part_of(progress, low, high, "for the diagnosis")
                make_atlas(unit, coarse, cache, executor, tell, rare=rare)
    return effort.simulated_s


def _check_usable(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(
            f"{folder}: cannot be written ({error.strerror or error}); "
            "set XDG_CACHE_HOME to a folder that can"
        ) from error
    fault = distrust(folder)
    if fault is not None:
        raise InputError(
            f"{fault}, so that nothing kept in {folder} would be used; "
            "set XDG_CACHE_HOME to a folder of yours alone"
        )
