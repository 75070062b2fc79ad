"""The first look: how well each cause, and each pair, agrees anywhere in its range.

Owns the comparison of an atlas with a thinned observation. Pairs are not in
the atlas: what each of two causes adds to the baseline at the same ratio is
added up. That is wrong in detail and good enough to decide what to simulate,
and it asks nothing of either cause alone: the best place of one of a pair by
itself is seldom its place within the pair. A third cause is added to what runs
of a pair showed. It simulates nothing itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from analysis.atlas import Atlas
from analysis.branches import Motions
from analysis.candidate import Candidate, Effects
from analysis.causes import Hypothesis
from analysis.observation import Observation
from analysis.population import Population
from analysis.surface import Surface, differences

__all__ = ["Place", "ranked", "screen_further", "screen_pairs", "screen_singles"]

_WIDTHS = {1: (0.06,), 2: (0.1, 0.13), 3: (0.12, 0.15, 0.2), 4: (0.15, 0.25, 0.08, 1.0)}
"""Distances over which a coarse surface reaches, by number of coordinates."""

_ENOUGH = {1: 4.0, 2: 5.0, 3: 6.0, 4: 25.0}
"""How many runs a regression takes, by number of coordinates: so few of so coarse an atlas, lest
what is far away counts; the many parameters of a resonance need more. True pairs then rank best.
"""

_COUNTS = {1: (31,), 2: (21, 25), 3: (13, 9, 5), 4: (11, 4, 15, 2)}
"""Places looked at along each coordinate."""

_PAIR_RATIOS, _PAIR_SIZES = 15, {2: (13,), 3: (9, 3), 4: (4, 15, 2)}
"""The same for pairs, whose ratio is common to both, and for each cause by its coordinates."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """The best place of a hypothesis in the coarse look and its log-likelihood."""

    place: NDArray[np.float64]
    log_likelihood: float


def ranked(places: Mapping[Effects, Place]) -> list[Effects]:
    """Hypotheses, the most likely by the coarse look first."""
    return sorted(places, key=lambda key: -places[key].log_likelihood)


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
    plain, added = _every_added(coarse, atlas)
    return {
        (*first, *second): _best_pair(plain, added[first], added[second])
        for first, second in combinations(sorted(added), 2)
        if not beside or set(beside) & {*first, *second}
    }


def screen_further(coarse: Observation, atlas: Atlas, known: Candidate) -> dict[Effects, Place]:
    """The best place of every set that has one cause more than a candidate.

    What a cause adds to the baseline is added to the candidate wherever there are runs of it,
    for with a further cause its best place is another.
    """
    rows = _rows_of(coarse, known.surface.observation)
    shown = [np.array(known.surface.expected(p))[..., rows] for p in known.population.places]
    _, added = _every_added(coarse, atlas)
    ratios = _centres(_PAIR_RATIOS)
    nearest = [int(np.argmin(abs(ratios - p[0]))) for p in known.population.places]
    found = {}
    for effects, further in added.items():
        if set(effects) <= set(known.hypothesis.effects):
            continue
        likelihood = np.array(
            [
                Surface.log_density(mean + further.shift[at], np.maximum(std, further.std[at])).sum(
                    axis=(1, 2)
                )
                for (mean, std), at in zip(shown, nearest, strict=True)
            ]
        )
        one, size = np.unravel_index(np.argmax(likelihood), likelihood.shape)
        both, place = known.hypothesis.joined(
            known.population.places[one],
            Hypothesis(known.hypothesis.unit, effects),
            further.sizes[size],
        )
        found[both.effects] = Place(place, float(likelihood[one, size]))
    return found


def _rows_of(thinned: Observation, whole: Observation) -> NDArray[np.intp]:
    """Where the rows of a thinned observation stand; levels may have frequencies of their own."""
    found = [
        every.start + np.flatnonzero(np.isin(whole.frequency_hz[every], thinned.frequency_hz[some]))
        for every, some in zip(whole.blocks, thinned.blocks, strict=True)
    ]
    return np.concatenate(found)


@dataclass(frozen=True, slots=True, eq=False)
class _Added:
    """What a cause adds to the baseline.

    `sizes` (count, d - 1); `shift`, `std` (ratios, count, 3, rows): by how much it
    moves the mean, and the scatter of single runs with it.
    """

    sizes: NDArray[np.float64]
    shift: NDArray[np.float64]
    std: NDArray[np.float64]


def _every_added(
    coarse: Observation, atlas: Atlas
) -> tuple[NDArray[np.float64], dict[Effects, _Added]]:
    """What the baseline shows at every ratio (ratios, 3, rows), and what each cause adds."""
    surfaces = {effects: _surface(coarse, population) for effects, population in atlas.items()}
    ratios = _centres(_PAIR_RATIOS)
    plain = np.array([surfaces[()].expected(np.array([ratio]))[0] for ratio in ratios])
    return plain, {e: _added(surface, plain) for e, surface in surfaces.items() if e}


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
    d = population.places.shape[1]
    width = np.array(_WIDTHS[d])
    none = np.empty((0, 3, len(coarse)))
    difference = differences(coarse, population)
    nothing = Motions.unknown(*difference.shape[::2])
    return Surface(
        coarse,
        population.places,
        difference,
        width,
        none,
        np.empty(0),
        nothing,
        _ENOUGH[d],
        tailed=False,
    )


def _grid(d: int) -> NDArray[np.float64]:
    return _mesh([np.linspace(0.0, 1.0, count) for count in _COUNTS[d]])


def _centres(count: int) -> NDArray[np.float64]:
    """Middles of so many equal parts of 0 to 1."""
    return (np.arange(count) + 0.5) / count


def _mesh(lines: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.stack([m.ravel() for m in np.meshgrid(*lines, indexing="ij")], axis=1)
