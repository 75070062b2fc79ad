"""The atlas: runs of every hypothesis over its whole range, before any measurement is looked at.

Owns the coarse look that a search starts from. It depends on the unit and the
plan of the sweep alone, not on what was measured, so that it can be kept in a
folder and read again; those of the paper's units in their usual sweeps come with
lashbench. It judges nothing.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.causes import Hypothesis, every_single_cause
from analysis.executor import Executor
from analysis.observation import Observation
from analysis.population import Group, Population, simulate_groups
from daq.configs import atlas_folder
from daq.formats.atomic import keeping
from daq.trust import own_folder, read_own
from sim.unit import Unit

__all__ = [
    "Atlas",
    "are_atlases_kept",
    "atlas_name",
    "coarse_stride",
    "make_atlas",
    "simulate_atlas",
    "write_atlas",
]

Atlas = dict[tuple[str, ...], Population]
"""Populations by the effects of their hypothesis; no effect is the baseline."""

_EDITION = 2
"""Counted up whenever the engine, an effect or the layout below change what an atlas holds."""

_SEED = 1
"""Of the places in an atlas, which stay where they are from one edition to the next."""

_RATIOS = 10
"""Machines in a group, one per tenth of the ratio: a second five cost a fifth more time."""

_BASELINE_GROUPS, _SIZES = 3, 6
_COSTLY = {"shaft-hardening": 3}
"""Groups of effects whose laws take twice the work."""

_LEAST_FREQUENCIES = 20


def coarse_stride(observation: Observation, least: int = _LEAST_FREQUENCIES) -> int:
    """Every how many frequencies a coarse look holds one, an atlas above all, to hold so many."""
    longest = max(block.stop - block.start for block in observation.blocks)
    return max(longest // least, 1)


def make_atlas(
    unit: Unit,
    coarse: Observation,
    cache: Path | None = None,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
    *,
    rare: bool = False,
) -> Atlas:
    """The atlas of a unit for the plans of a thinned observation.

    That of each plan is read where it was kept, in `cache` or among those that come with
    lashbench; else simulated, and kept in `cache`. All hold the same machines.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    parts = list(coarse.by_plan())
    made, rows = [], []
    for number, (part, theirs) in enumerate(parts):
        tell = _part_of(progress, number, len(parts))
        made.append(_find_or_make(unit, part, cache, executor, tell, rare))
        rows.append(theirs)
    # Where each row of the observation stands among those of all plans, one after the other.
    places = np.argsort(np.concatenate(rows))
    return {key: _side_by_side([atlas[key] for atlas in made], places) for key in made[0]}


def are_atlases_kept(unit: Unit, coarse: Observation, cache: Path, *, rare: bool) -> list[bool]:
    """For each plan of a thinned observation, whether its atlas would be read, not simulated."""
    names = [atlas_name(unit, part, rare) for part, _ in coarse.by_plan()]
    return [_known(name, cache) is not None for name in names]


def _find_or_make(
    unit: Unit,
    coarse: Observation,
    cache: Path | None,
    executor: Executor | None,
    progress: Callable[[float], None] | None,
    rare: bool,
) -> Atlas:
    name = atlas_name(unit, coarse, rare)
    cache = None if cache is None else own_folder(cache)
    if (known := _known(name, cache)) is not None:
        return known
    atlas = simulate_atlas(unit, coarse, executor, progress, rare=rare)
    if cache is not None:
        write_atlas(cache / name, atlas)
    return atlas


def _known(name: str, cache: Path | None) -> Atlas | None:
    """An atlas that was kept in the cache or comes with lashbench."""
    found = None if cache is None else _read(cache / name, read_own)
    return _read(atlas_folder() / name, Path.read_bytes) if found is None else found


def _part_of(
    progress: Callable[[float], None] | None, number: int, count: int
) -> Callable[[float], None] | None:
    if progress is None:
        return None
    return lambda share: progress((number + share) / count)


def _side_by_side(parts: Sequence[Population], places: NDArray[np.int64]) -> Population:
    """Runs of the same machines through several plans, as rows in the order of places."""
    return replace(
        parts[0],
        mean=np.concatenate([part.mean for part in parts], axis=1)[:, places],
        variance=np.concatenate([part.variance for part in parts], axis=1)[:, places],
    )


def simulate_atlas(
    unit: Unit,
    coarse: Observation,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
    *,
    rare: bool = False,
) -> Atlas:
    """Simulate the baseline and every usual cause, or every rare one.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    rng = np.random.default_rng(_SEED)
    return simulate_groups(unit, list(_groups(unit, rng, rare)), coarse, rng, executor, progress)


def _groups(unit: Unit, rng: np.random.Generator, rare: bool) -> Iterator[Group]:
    for _ in range(0 if rare else _BASELINE_GROUPS):
        yield Group(Hypothesis(unit), _spread(_RATIOS, rng), np.empty(0))
    for hypothesis in every_single_cause(unit, rare):
        for sizes in _sizes(hypothesis, rng):
            yield Group(hypothesis, _spread(_RATIOS, rng), sizes)


def _spread(count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Numbers evenly over 0 to 1, shifted together by chance."""
    return (np.arange(count) + rng.uniform()) / count


def _sizes(hypothesis: Hypothesis, rng: np.random.Generator) -> Iterator[NDArray[np.float64]]:
    d = hypothesis.d
    if d == 2:
        count = _COSTLY.get(hypothesis.effects[0], _SIZES)
        for u in _stratified(count, rng):
            yield np.array([_denser(u, hypothesis)])
    elif d == 3:
        for first in _stratified(4, rng):
            for second in _stratified(3, rng):
                yield np.array([first, second])
    else:
        # A flexible payload: where it resonates decides most.
        for first in _stratified(2, rng):
            for second in _stratified(8, rng):
                yield np.array([first, second, *rng.uniform(size=d - 3)])


def _stratified(count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    return (np.arange(count) + rng.uniform(size=count)) / count


def _denser(u: float, hypothesis: Hypothesis) -> float:
    """Sizes crowd about the datasheet's value where the effect is that a value differs from it."""
    if not hypothesis.centred:
        return u
    x = 2.0 * u - 1.0
    return 0.5 + 0.5 * float(np.sign(x) * abs(x) ** 1.5)


def atlas_name(unit: Unit, coarse: Observation, rare: bool = False) -> str:
    """File name of an atlas, another for everything that it depends on."""
    causes = [hypothesis.effects for hypothesis in every_single_cause(unit, rare)]
    text = json.dumps(
        [_EDITION, causes, unit.physics, unit.tolerances, coarse.sweeps()], sort_keys=True
    )
    mark = hashlib.sha256(text.encode()).hexdigest()[:24]
    return f"{'rare' if rare else 'atlas'}-{mark}.npz"


def write_atlas(file: Path, atlas: Atlas) -> None:
    """Keep an atlas; a cache that cannot be written costs time later and nothing else."""
    names = {f"{'+'.join(key)}|{field}": getattr(one, field)
             for key, one in atlas.items() for field in Population.__slots__}  # fmt: skip
    with keeping(file) as stream:
        np.savez_compressed(stream, **names)


def _read(file: Path, content: Callable[[Path], bytes | None]) -> Atlas | None:
    """A kept atlas, or None where there is none that can be read."""
    # Damage is told by zip, zlib and numpy, each in many ways: what it hit is made anew.
    with suppress(Exception):
        stream = BytesIO(content(file) or b"")
        with np.load(stream, allow_pickle=False) as kept:
            fields: dict[tuple[str, ...], dict[str, NDArray]] = {}
            for name in kept.files:
                key, _, field = name.rpartition("|")
                fields.setdefault(tuple(filter(None, key.split("+"))), {})[field] = kept[name]
        return {key: Population(**parts) for key, parts in fields.items()}
    return None
