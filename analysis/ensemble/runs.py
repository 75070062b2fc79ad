"""Simulated runs of a hypothesis, at many places, in the sweep of an observation.

Owns the making of runs for the diagnosis: machines in groups that share their
linear part (so that they are stepped side by side), each group off its
datasheet in its own way, and what a bench would have read from each run. It
judges nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import hadamard

from analysis.ensemble.batch import Family, read_families
from analysis.ensemble.datasheet_spread import Spread, spread_of
from analysis.ensemble.model import Hypothesis
from analysis.execution.executor import Executor
from analysis.observation.observation import Observation, channels_of_readings
from sim.unit import Unit

__all__ = ["DatasheetRange", "Group", "Population", "simulate_groups"]


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Machines of one hypothesis that differ in ratio and start alone.

    `ratios` (k,); `sizes` (d - 1,): the other coordinates of the hypothesis.
    """

    hypothesis: Hypothesis
    ratios: NDArray[np.float64]
    sizes: NDArray[np.float64]

    @property
    def places(self) -> NDArray[np.float64]:
        """(k, d)."""
        return np.column_stack([self.ratios, np.tile(self.sizes, (len(self.ratios), 1))])


@dataclass(frozen=True, slots=True, eq=False)
class DatasheetRange:
    """Departures along the ways of a unit: `centre` (k,), and `reach` (k,) to either side."""

    centre: NDArray[np.float64]
    reach: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Population:
    """Runs of one hypothesis.

    `places` (n, d); `deviations` (n, k) along the ways in which the unit spreads
    (`analysis.ensemble.datasheet_spread`); `mean`, `variance` (n, rows): the reading of each run,
    see `analysis.observation.observation.readings_of_cycles`. `fold` (n,): 0 or 1 by how a run
    deviates along the first way; runs of one are held against those of the other.
    """

    places: NDArray[np.float64]
    deviations: NDArray[np.float64]
    mean: NDArray[np.complex128]
    variance: NDArray[np.float64]
    fold: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.places)

    def channels(self, observation: Observation) -> NDArray[np.float64]:
        """Channels (n, 3, rows) as the bench of an observation would read them."""
        return channels_of_readings(self.mean, self.variance, observation.noise, observation.floor)

    def joined(self, other: Population) -> Population:
        """Both sets of runs."""
        return Population(
            np.concatenate([self.places, other.places]),
            np.concatenate([self.deviations, other.deviations]),
            np.concatenate([self.mean, other.mean]),
            np.concatenate([self.variance, other.variance]),
            np.concatenate([self.fold, other.fold]),
        )


def simulate_groups(
    unit: Unit,
    groups: Sequence[Group],
    observation: Observation,
    rng: np.random.Generator,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
    about: Mapping[tuple[str, ...], DatasheetRange] | None = None,
) -> dict[tuple[str, ...], Population]:
    """Populations by the effects of their hypothesis.

    `executor` says where they are simulated, this machine's cores if not given. `about`: where
    their datasheet values lie, of hypotheses of which that is known better than by the datasheet.

    Raises
    ------
    AnalysisError
        If a motion grew without bound even at the shortest step.
    """
    if not groups:
        return {}
    families: list[Family] = []
    deviations: list[NDArray[np.float64]] = []
    folds: list[NDArray[np.int64]] = []
    spread = spread_of(unit)
    for group, signs in zip(groups, list(_signs(groups, spread, rng)), strict=True):
        known = about.get(group.hypothesis.effects) if about else None
        off = signs * spread.sigmas if known is None else known.centre + signs * known.reach
        named = spread.deviations(off)
        seeds = rng.integers(2**30, size=len(group.ratios))
        machines = tuple(
            group.hypothesis.machine(place, int(seed), named)
            for place, seed in zip(group.places, seeds, strict=True)
        )
        families.append(Family(unit, machines, observation.plans))
        deviations.append(np.tile(off, (len(group.ratios), 1)))
        folds.append(np.full(len(group.ratios), int(signs[0] > 0.0)))
    readings = read_families(families, executor, progress)
    found: dict[tuple[str, ...], Population] = {}
    for group, off, fold, read in zip(groups, deviations, folds, readings, strict=True):
        made = Population(group.places, off, *read, fold)
        key = group.hypothesis.effects
        found[key] = found[key].joined(made) if key in found else made
    return found


def _signs(
    groups: Sequence[Group], spread: Spread, rng: np.random.Generator
) -> Iterator[NDArray[np.float64]]:
    """Signs (k,) of one standard deviation along each way, for every group.

    Two neighbouring groups of a hypothesis deviate in opposite ways, and pairs in ways at right
    angles to each other: few groups then tell what deviations do, and their mean is that of a
    unit as the datasheet says. Signs drawn one by one would leave both to chance.
    """
    patterns = hadamard(8)[:, 1 : len(spread) + 1].astype(float)
    turns: dict[tuple[str, ...], list[NDArray[np.float64]]] = {}
    for group in groups:
        turn = turns.setdefault(group.hypothesis.effects, [])
        if not turn:
            turn += [sign * row for row in rng.permutation(patterns) for sign in (1.0, -1.0)]
        yield turn.pop(0)
