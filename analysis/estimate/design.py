"""Which machines an estimate holds a measurement against.

Owns their places: over the whole range of what is free, and about an answer, on
a lattice that stands still, so that measurements that lie close together are
held against the same machines, which may have been kept. It simulates none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.datasheet_spread import Spread
from analysis.ensemble.machine import Machine
from analysis.observation.observation import Observation
from sim.response import START_SPREAD

__all__ = ["RATIO", "Axis", "Families", "every_family", "near_families", "wide_families"]

Families = list[tuple[Machine, ...]]
"""Machines by families that share their deviations, and so are stepped together."""

_FULL_LANES, _LEAST_KIN, _MOST_KIN = 64, 8, 32
"""A family at all its levels fills the engine's lanes, or nearly."""

_WIDE_FAMILIES = 5
"""Families over the whole range that are off their datasheet, per axis."""

_REACH, _LEAST_STD = 3.5, 0.6
"""Families whose place lies within so many standard deviations of the answer so far are held
against it, which is known to so much of an axis's scale at best. A family spans as much about
its place as the least."""

_NEAR_FAMILIES, _MOST_NEAR = 8, 12
"""Families about an answer per axis where it is known best, and at most."""


@dataclass(frozen=True, slots=True)
class Axis:
    """One free number: its range and how many coarse places span it.

    `machine` puts a value into a machine. `scale` is the distance over which
    a response changes smoothly, the same unit as the range.
    """

    name: str
    low: float
    high: float
    coarse: int
    scale: float
    machine: Callable[[Machine, float], Machine]


RATIO = Axis("ratio", 0.0, 1.0, 33, 0.08, lambda m, v: replace(m, ratio=float(v)))


def wide_families(
    axes: Sequence[Axis], observation: Observation, spread: Spread, seed: int
) -> Families:
    """Machines over the whole range: as the datasheet says, evenly, and families that are not."""
    kin = _kin(observation)
    lines = [np.linspace(axis.low, axis.high, axis.coarse) for axis in axes]
    evenly = [
        _machine_at(axes, place, number) for number, place in enumerate(product(*lines))
    ]  # fmt: skip
    low = np.array([axis.low for axis in axes])
    high = np.array([axis.high for axis in axes])
    rng = np.random.default_rng([seed, 1])
    return [tuple(evenly[at : at + kin]) for at in range(0, len(evenly), kin)] + [
        _family(axes, low, high, kin, spread, rng) for _ in range(_WIDE_FAMILIES * len(axes))
    ]


def near_families(
    axes: Sequence[Axis],
    mean: NDArray[np.float64],
    std: NDArray[np.float64],
    observation: Observation,
    spread: Spread,
    seed: int,
) -> Families:
    """Families about the answer so far: `mean` and `std`, each (d,)."""
    within = []
    for axis, line, m, s in zip(axes, _lines(axes), mean, std, strict=True):
        reach = _REACH * max(s, _LEAST_STD * axis.scale)
        within.append(np.flatnonzero(np.abs(line - np.clip(m, axis.low, axis.high)) <= reach))
    chosen = list(product(*within))
    # An answer that is hardly known is looked at as closely, in fewer places: families overlap.
    count = min(len(chosen), _MOST_NEAR * len(axes))
    evenly = np.linspace(0, len(chosen) - 1, count).round().astype(int)
    return _families_at(axes, [chosen[i] for i in evenly], observation, spread, seed)


def every_family(
    axes: Sequence[Axis], observation: Observation, spread: Spread, seed: int
) -> Families:
    """All that any answer is held against."""
    places = product(*(range(len(line)) for line in _lines(axes)))
    wide = wide_families(axes, observation, spread, seed)
    return wide + _families_at(axes, places, observation, spread, seed)


def _lines(axes: Sequence[Axis]) -> list[NDArray[np.float64]]:
    """Along every axis the places of the lattice."""
    steps = (_NEAR_FAMILIES * len(axes)) ** (1.0 / len(axes))
    apart = [2.0 * _REACH * _LEAST_STD * axis.scale / steps for axis in axes]
    return [
        np.linspace(axis.low, axis.high, 1 + round((axis.high - axis.low) / step))
        for axis, step in zip(axes, apart, strict=True)
    ]


def _families_at(
    axes: Sequence[Axis],
    places: Iterable[tuple[int, ...]],
    observation: Observation,
    spread: Spread,
    seed: int,
) -> Families:
    """The family of each place of the lattice."""
    lines, kin = _lines(axes), _kin(observation)
    low = np.array([axis.low for axis in axes])
    high = np.array([axis.high for axis in axes])
    reach = _REACH * _LEAST_STD * np.array([axis.scale for axis in axes])
    families = []
    for at in places:
        middle = np.array([line[i] for line, i in zip(lines, at, strict=True)])
        bottom, top = np.maximum(middle - reach, low), np.minimum(middle + reach, high)
        rng = np.random.default_rng([seed, 2, *map(int, at)])
        families.append(_family(axes, bottom, top, kin, spread, rng))
    return families


def _kin(observation: Observation) -> int:
    """Machines in a family: each of them takes a lane per level."""
    levels = max(len(plan.levels_vpk) for plan, _ in observation.plans)
    return int(np.clip(_FULL_LANES // levels, _LEAST_KIN, _MOST_KIN))


def _family(
    axes: Sequence[Axis],
    bottom: NDArray[np.float64],
    top: NDArray[np.float64],
    kin: int,
    spread: Spread,
    rng: np.random.Generator,
) -> tuple[Machine, ...]:
    """Machines evenly over a box, all off their datasheet in the same way.

    They differ from the datasheet as units do, so that what the regression gets
    wrong about them is what it will get wrong about a unit.
    """
    first = int(rng.integers(2**30))
    deviations = spread.draw(rng)
    # Evenly along every axis, in an order of its own along each.
    strata = np.stack([rng.permutation(kin) for _ in axes], axis=1)
    places = bottom + (top - bottom) * (strata + rng.uniform(size=strata.shape)) / kin
    return tuple(
        replace(_machine_at(axes, place, first + i), deviations=deviations)
        for i, place in enumerate(places)
    )


def _machine_at(axes: Sequence[Axis], place: Iterable[float], seed: int) -> Machine:
    # Nobody knows where the gears lie when a sweep starts, and at low drive that
    # decides which branch it follows: half of the machines start anywhere.
    machine = Machine(ratio=0.0, seed=seed, start_spread=START_SPREAD if seed % 2 else 1.0)
    for axis, value in zip(axes, place, strict=True):
        machine = axis.machine(machine, float(value))
    return machine
