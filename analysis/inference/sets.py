"""Sets of causes: which combinations of effects the posterior tells apart.

Owns their order, their members and their prior probability. It knows no measurement and no size.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

__all__ = ["MOST_CAUSES", "CauseSets"]

MOST_CAUSES = 3
"""Causes in a set at most."""


@dataclass(frozen=True)
class CauseSets:
    """All sets of at most three effects.

    Parameters
    ----------
    effects
        Identifiers, in the order of the catalogue.
    weights
        Probability (effects,) of each to be drawn as a cause.
    counts
        Probability of so many causes, from none.
    """

    effects: tuple[str, ...]
    weights: tuple[float, ...]
    counts: tuple[float, ...]

    @cached_property
    def places(self) -> tuple[tuple[int, ...], ...]:
        """Places of the members of each set among the effects, fewest first."""
        every = range(len(self.effects))
        return tuple(s for k in range(MOST_CAUSES + 1) for s in combinations(every, k))

    @cached_property
    def index(self) -> dict[tuple[int, ...], int]:
        """Number of each set."""
        return {one: number for number, one in enumerate(self.places)}

    @cached_property
    def members(self) -> NDArray[np.int64]:
        """(sets, 3): places of the members, the number of effects where there is none."""
        none = len(self.effects)
        return np.array([[*one, *[none] * (MOST_CAUSES - len(one))] for one in self.places])

    @cached_property
    def sizes(self) -> NDArray[np.int64]:
        """Number of causes in each set (sets,)."""
        return np.array([len(one) for one in self.places])

    @cached_property
    def of_size(self) -> NDArray[np.float32]:
        """(4, sets): 1 where a set has so many causes."""
        return (np.arange(MOST_CAUSES + 1)[:, None] == self.sizes).astype(np.float32)

    @cached_property
    def incidence(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(effects, sets) and (pairs, sets): 1 for each member, and for each pair of members."""
        count, (first, second) = len(self.effects), self.pairs
        singles = np.zeros((count + 1, len(self.places)), dtype=np.float32)
        for column in self.members.T:
            singles[column, np.arange(len(self.places))] = 1.0
        singles = singles[:count]
        return singles, singles[first] * singles[second]

    @cached_property
    def pairs(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """First and second member of every pair of effects."""
        first, second = np.triu_indices(len(self.effects), 1)
        return first, second

    @cached_property
    def log_prior(self) -> NDArray[np.float64]:
        """Logarithm of the prior probability of each set (sets,), of draws without replacement."""
        weight = np.append(np.asarray(self.weights), 1.0)
        found = np.log(np.asarray(self.counts))[self.sizes] + np.log(weight[self.members]).sum(1)
        for count in range(MOST_CAUSES + 1):
            some = self.sizes == count
            found[some] -= np.log(np.exp(found[some]).sum()) - np.log(self.counts[count])
        return found

    def names(self, number: int) -> tuple[str, ...]:
        """Identifiers of the members of a set."""
        return tuple(self.effects[place] for place in self.places[number])
