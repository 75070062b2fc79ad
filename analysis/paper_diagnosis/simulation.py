"""Runs of a set of causes: which machines are simulated, and in which part of its range.

Owns the placing of runs and how much is spent on each set. It holds nothing
against a measurement.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from analysis.ensemble.model import Hypothesis
from analysis.paper_diagnosis.emulator import Surface
from analysis.paper_diagnosis.features import feature_sweeps
from daq.plan import SweepPlan
from sim.unit import Unit

__all__ = ["Effort", "Explored", "Explorer"]

_LANE_FREE = frozenset(
    {
        "load-coulomb-friction",
        "motor-coulomb-friction",
        "load-stribeck-friction",
        "total-backlash",
        "amplifier-saturation",
    }
)
"""Effects whose size leaves the linear part alone: machines of any size are stepped together."""

_SLOW = frozenset({"shaft-hardening"})
"""Effects that are stepped at half the speed of others and get half as many groups."""

_NEAR_STD = 0.02
"""Spread of the ratios simulated about a known one."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is simulated, in groups of `lanes` machines of one size and many ratios.

    Parameters
    ----------
    points, settle_cycles, integrate_cycles
        Of every simulated sweep.
    baseline, first, further
        Groups of the plain model, of a cause, and for each parameter beyond its first.
    refined, refinement
        How many causes get further groups where they agree best, and how many groups.
    pairs, pair_groups
        How many pairs are simulated for each state of knowledge, and their groups.
    places
        Machines of each rival on which a next measurement is tried.
    """

    lanes: int = 16
    points: int = 34
    settle_cycles: int = 25
    integrate_cycles: int = 20
    baseline: int = 3
    first: int = 4
    further: int = 2
    refined: int = 6
    refinement: int = 2
    pairs: int = 3
    pair_groups: int = 6
    places: int = 4

    def groups(self, hypothesis: Hypothesis) -> int:
        """Groups for a first look at a hypothesis of no or one cause."""
        if hypothesis.d == 1:
            return self.baseline
        wanted = self.first + self.further * (hypothesis.d - 2)
        return max(wanted // 2, 2) if set(hypothesis.effects) & _SLOW else wanted


@dataclass(frozen=True)
class Explored:
    """A set of causes with its runs and the part of its range, box (d, 2), that they cover."""

    hypothesis: Hypothesis
    surface: Surface
    box: NDArray[np.float64] = field(repr=False)

    @property
    def effects(self) -> tuple[str, ...]:
        """Identifiers of its effects."""
        return self.hypothesis.effects


@dataclass(frozen=True)
class Explorer:
    """Simulates sets of causes on one unit by one procedure."""

    unit: Unit
    plan: SweepPlan
    effort: Effort
    known_ratio: float | None
    rng: np.random.Generator

    def explore(
        self, hypothesis: Hypothesis, groups: int, box: NDArray[np.float64] | None = None
    ) -> Explored:
        """A set with runs all over a box, by default over its whole range."""
        whole = np.tile([0.0, 1.0], (hypothesis.d, 1)) if box is None else box
        places = self._places(hypothesis, groups, whole)
        return Explored(hypothesis, Surface(places, self.run(hypothesis, places)), whole)

    def refine(self, explored: Explored, groups: int, box: NDArray[np.float64]) -> Explored:
        """The same set with further runs inside a smaller box."""
        places = self._places(explored.hypothesis, groups, box)
        features = self.run(explored.hypothesis, places)
        return replace(explored, surface=explored.surface.joined(places, features))

    def run(self, hypothesis: Hypothesis, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Features (n, 5) of one run at each of the places (n, d)."""
        seeds = self.rng.integers(1 << 31, size=len(places))
        machines = [hypothesis.machine(p, int(s)) for p, s in zip(places, seeds, strict=True)]
        return feature_sweeps(self.unit, machines, self.plan)

    def _places(
        self, hypothesis: Hypothesis, groups: int, box: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Places (groups x lanes, d): sizes spread over the box, ratios over all of 0 to 1."""
        lanes = self.effort.lanes
        own = [effect in _LANE_FREE for effect, _ in hypothesis.parameters]
        spread = np.repeat(self._spread(groups, hypothesis.d - 1), lanes, axis=0)
        spread[:, own] = self._spread(groups * lanes, hypothesis.d - 1)[:, own]
        low, high = box[1:, 0], box[1:, 1]
        ratios = np.concatenate([self._ratios() for _ in range(groups)])
        return np.column_stack([ratios, low + (high - low) * spread])

    def _spread(self, count: int, dimension: int) -> NDArray[np.float64]:
        if dimension == 0:
            return np.empty((count, 0))
        return np.asarray(qmc.LatinHypercube(dimension, rng=self.rng).random(count))

    def _ratios(self) -> NDArray[np.float64]:
        """One for each lane; a third of them about the known one, where one is known."""
        lanes = self.effort.lanes
        near = 0 if self.known_ratio is None else lanes // 3
        about = np.abs(self.rng.normal(self.known_ratio or 0.0, _NEAR_STD, near))
        rest = (np.arange(lanes - near) + self.rng.uniform(size=lanes - near)) / (lanes - near)
        return self.rng.permutation(np.concatenate([np.minimum(about, 1.0), rest]))
