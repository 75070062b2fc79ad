"""The first look: how well each cause, and each pair, agrees anywhere in its range.

Owns the comparison of an atlas with a thinned observation. Pairs are not in
the atlas: what each of two causes adds to the baseline at the same ratio is
added up. That is wrong in detail and good enough to decide what to simulate,
and it asks nothing of either cause alone: the best place of one of a pair by
itself is seldom its place within the pair. It simulates nothing itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from analysis.atlas import Atlas
from analysis.branches import Motions
from analysis.candidate import Effects
from analysis.observation import Observation
from analysis.population import Population
from analysis.surface import Surface, differences

__all__ = ["Place", "screen_pairs", "screen_singles"]

_WIDTHS = {1: (0.06,), 2: (0.1, 0.13), 3: (0.12, 0.15, 0.2), 4: (0.15, 0.25, 0.08, 1.0)}
"""Distances over which a coarse surface reaches, by number of coordinates."""

_COUNTS = {1: (31,), 2: (21, 25), 3: (13, 9, 5), 4: (11, 4, 15, 2)}
"""Places looked at along each coordinate."""

_PAIR_RATIOS, _PAIR_SIZES = 15, {2: (13,), 3: (9, 3), 4: (4, 15, 2)}
"""The same for pairs, whose ratio is common to both, and for each cause by its coordinates."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """The best place of a hypothesis in the coarse look and its log-likelihood."""

    place: NDArray[np.float64]
    log_likelihood: float


def screen_singles(coarse: Observation, atlas: Atlas) -> dict[Effects, Place]:
    """The best place of every hypothesis of an atlas."""
    found = {}
    for effects, population in atlas.items():
        grid = _grid(population.places.shape[1])
        likelihood = _surface(coarse, population).scan(grid)
        top = int(np.argmax(likelihood))
        found[effects] = Place(grid[top], float(likelihood[top]))
    return found


def screen_pairs(coarse: Observation, atlas: Atlas, beside: Effects = ()) -> dict[Effects, Place]:
    """The best place of every pair of causes of an atlas, or of those with one of `beside`."""
    surfaces = {effects: _surface(coarse, population) for effects, population in atlas.items()}
    ratios = _centres(_PAIR_RATIOS)
    plain = np.array([surfaces[()].expected(np.array([ratio])) for ratio in ratios])
    added = {e: _added(surface, plain[:, 0]) for e, surface in surfaces.items() if e}
    return {
        (*first, *second): _best_pair(plain[:, 0], added[first], added[second])
        for first, second in combinations(sorted(added), 2)
        if not beside or set(beside) & {*first, *second}
    }


@dataclass(frozen=True, slots=True, eq=False)
class _Added:
    """What a cause adds to the baseline.

    `sizes` (count, d - 1); `shift`, `std` (ratios, count, 3, rows): by how much it
    moves the mean, and the scatter of single runs with it.
    """

    sizes: NDArray[np.float64]
    shift: NDArray[np.float64]
    std: NDArray[np.float64]


def _added(surface: Surface, plain: NDArray[np.float64]) -> _Added:
    sizes = _mesh([_centres(count) for count in _PAIR_SIZES[surface.places.shape[1]]])
    ratios = _centres(_PAIR_RATIOS)
    expected = np.array(
        [[surface.expected(np.array([ratio, *size])) for size in sizes] for ratio in ratios]
    )
    return _Added(sizes, expected[:, :, 0] - plain[:, None], expected[:, :, 1])


def _best_pair(plain: NDArray[np.float64], first: _Added, second: _Added) -> Place:
    top, where = -np.inf, np.empty(0)
    for at, ratio in enumerate(_centres(_PAIR_RATIOS)):
        mean = plain[at] + first.shift[at][:, None] + second.shift[at]
        std = np.maximum(first.std[at][:, None], second.std[at])
        likelihood = Surface.log_density(mean, std).sum(axis=(2, 3))
        one, other = np.unravel_index(np.argmax(likelihood), likelihood.shape)
        if likelihood[one, other] > top:
            top = float(likelihood[one, other])
            where = np.array([ratio, *first.sizes[one], *second.sizes[other]])
    return Place(where, top)


def _surface(coarse: Observation, population: Population) -> Surface:
    width = np.array(_WIDTHS[population.places.shape[1]])
    none = np.empty((0, 3, len(coarse)))
    difference = differences(coarse, population)
    nothing = Motions.unknown(*difference.shape[::2])
    return Surface(
        coarse, population.places, difference, width, none, np.empty(0), nothing, tailed=False
    )


def _grid(d: int) -> NDArray[np.float64]:
    return _mesh([np.linspace(0.0, 1.0, count) for count in _COUNTS[d]])


def _centres(count: int) -> NDArray[np.float64]:
    """Middles of so many equal parts of 0 to 1."""
    return (np.arange(count) + 0.5) / count


def _mesh(lines: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.stack([m.ravel() for m in np.meshgrid(*lines, indexing="ij")], axis=1)
