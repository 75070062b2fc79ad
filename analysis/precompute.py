"""Making ahead what estimates and diagnoses need: the posterior of a unit, the runs of a sweep.

Owns which of it does not depend on what will be measured, and where it is kept: where the
estimate and the diagnosis look for it. It judges nothing.
"""

from __future__ import annotations

import errno
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from analysis.ensemble.datasheet_spread import spread_of
from analysis.ensemble.run_cache import are_kept, run_families
from analysis.estimate import free_axes
from analysis.estimate.design import every_family
from analysis.execution.executor import Executor
from analysis.execution.progress import Progress, part_of
from analysis.inference.checkpoint import Checkpoint, find_checkpoint, posterior_name
from analysis.inference.nominal import nominal_families, nominal_of
from analysis.inference.posterior import lent_checkpoint
from analysis.inference.prior import Prior
from analysis.inference.transfer import transfer_weights, vocabulary_of
from analysis.observation.observation import Observation
from daq.errors import InputError, LashbenchError
from daq.untrusted.trust import distrust
from sim.engine.effort import counting
from sim.unit import Unit

__all__ = ["Prepared", "prepare_sweep", "prepare_unit"]

_AT_ONCE = 8
"""Families that are simulated before they are kept: what is interrupted loses no more."""

_RATE_FROM_ANOTHER = 3e-4
"""Learning rate where training begins with a posterior that was trained before."""

_ROOM_BYTES = 1 << 15
"""Less than any file that is kept."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """What became of a preparation, in files: those needed, found at first, and kept at the end."""

    simulated_s: float
    """Seconds of motion that had to be simulated."""
    needed: int
    before: int
    kept: int


def prepare_unit(
    unit: Unit,
    machines: int,
    cache: Path,
    *,
    executor: Executor | None = None,
    told: Callable[[str], None] = lambda text: None,
) -> Checkpoint:
    """Train the posterior of a unit on so many simulated machines, and keep it.

    It serves every sweep of the unit. What was interrupted goes on. Training begins with the
    posterior that comes with lashbench, of this unit or of another one.

    Raises
    ------
    LashbenchError
        If there is no room to keep anything.
    InputError
        If JAX is not installed, nothing can be written into the folder, or others may write there.
    AnalysisError
        If a motion grew without bound.
    """
    from analysis.inference.campaign import Recipe, train_unit

    _check_usable(cache)
    name = posterior_name(unit)
    runs = cache / name.removesuffix(".npz").replace("posterior", "training")
    start = find_checkpoint(unit) or _of_another(unit)
    recipe = Recipe(rate=_RATE_FROM_ANOTHER) if start else Recipe()
    return train_unit(
        unit, cache / name, runs, machines, recipe, start, executor=executor, told=told
    )


def _of_another(unit: Unit) -> Checkpoint | None:
    """What the posterior of another unit knows of the effects and values that this one has."""
    lent = lent_checkpoint(unit)
    if lent is None:
        return None
    known, wanted = (vocabulary_of(Prior(unit, borrowed)) for borrowed in (True, False))
    return transfer_weights(lent, known, wanted)


def prepare_sweep(
    unit: Unit,
    observation: Observation,
    cache: Path,
    *,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Prepared:
    """Simulate and keep what depends on a unit and a sweep alone.

    What is kept already is left as it is, so that one that was interrupted goes on.

    Parameters
    ----------
    observation
        A measured sweep, or one that will be (`analysis.observation.observation.unread`).
    cache
        Folder that keeps it; made if it is not there.

    Returns
    -------
    Prepared
        `kept` is less than `needed` where the disk refused some.

    Raises
    ------
    LashbenchError
        If there is no room to keep anything.
    InputError
        If nothing can be written into the folder, or others may write there.
    AnalysisError
        If a motion grew without bound.
    """
    _check_usable(cache)
    families = every_family(free_axes(unit), observation, spread_of(unit), seed=0)
    parts = [part for part, _ in observation.by_plan()]

    def kept() -> list[bool]:
        found = [are_kept(unit, family, observation, cache) for family in families]
        plain = nominal_families(unit)
        return found + [are_kept(unit, one, part, cache) for part in parts for one in plain]

    before = kept()
    with counting() as effort:
        for first in range(0, len(families), _AT_ONCE):
            some = families[first : first + _AT_ONCE]
            low, high = first / len(families), (first + len(some)) / len(families)
            tell = part_of(progress, 0.9 * low, 0.9 * high, "for the estimate")
            run_families(unit, some, observation, cache=cache, executor=executor, progress=tell)
        for part in parts:
            nominal_of(unit, part, cache, executor)
        if progress is not None:
            progress(1.0, "for the diagnosis")
    return Prepared(effort.simulated_s, len(before), sum(before), sum(kept()))


def _check_usable(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(bytes(_ROOM_BYTES))
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
            raise LashbenchError(
                f"{folder}: nothing could be kept there ({error.strerror}), and nothing was "
                "simulated; make room"
            ) from error
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
