"""The first look: how well each cause, and each pair, agrees anywhere in its range.

Owns the comparison of an atlas with a thinned observation. Pairs are not in
the atlas: what the second cause adds is taken from its own runs, less those of
the baseline, and laid over the first. That is wrong in detail and good enough
to decide what to simulate. It simulates nothing itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.atlas import Atlas
from analysis.branches import Motions
from analysis.candidate import Candidate, Effects
from analysis.observation import Observation
from analysis.population import Population
from analysis.surface import Surface, differences

__all__ = ["Place", "screen_pairs", "screen_singles"]

_WIDTHS = {1: (0.06,), 2: (0.1, 0.13), 3: (0.12, 0.15, 0.2), 4: (0.15, 0.25, 0.08, 1.0)}
"""Distances over which a coarse surface reaches, by number of coordinates."""

_COUNTS = {1: (31,), 2: (21, 25), 3: (13, 9, 5), 4: (11, 4, 15, 2)}
"""Places looked at along each coordinate."""

_PAIR_RATIOS = np.linspace(-0.2, 0.2, 5)
_PAIR_SIZES = np.linspace(-0.1, 0.1, 3)


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


def screen_pairs(
    coarse: Observation, atlas: Atlas, parents: Mapping[Effects, Candidate]
) -> dict[Effects, Place]:
    """The best place of every pair of a parent (a single cause looked at closely) and another."""
    surfaces = {effects: _surface(coarse, population) for effects, population in atlas.items()}
    found: dict[Effects, Place] = {}
    for parent, candidate in parents.items():
        alone = _about_best(candidate)
        for other in atlas:
            if not other or other == parent:
                continue
            place = _best_pair(parent, alone, other, surfaces[other], surfaces[()])
            key = tuple(sorted((*parent, *other)))
            known = found.get(key)
            if known is None or place.log_likelihood > known.log_likelihood:
                found[key] = place
    return found


_Expected = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def _about_best(candidate: Candidate) -> list[_Expected]:
    """Places about a candidate's best one, with the mean and the scatter expected there."""
    best = candidate.best.place
    # The atlas, which is laid over it, is too thin to tell states of motion apart.
    nothing = Motions.unknown(*candidate.surface.difference.shape[::2])
    surface = replace(candidate.surface, tailed=False, motions=nothing)
    places = [
        np.array([ratio, *np.clip(best[1:] + step, 0.0, 1.0)])
        for ratio in np.unique(np.clip(best[0] + _PAIR_RATIOS, 0.0, 1.0))
        for step in _PAIR_SIZES
    ]
    return [(place, *surface.expected(place)) for place in places]


def _best_pair(
    parent: Effects, alone: Sequence[_Expected], other: Effects, second: Surface, none: Surface
) -> Place:
    top, where = -np.inf, alone[0][0]
    added = _grid(second.places.shape[1], ratios=1)[:, 1:]
    for ratio in {float(place[0]) for place, _, _ in alone}:
        plain, _ = none.expected(np.array([ratio]))
        extra = [second.expected(np.array([ratio, *sizes])) for sizes in added]
        for place, mean, std in alone:
            if place[0] != ratio:
                continue
            for more, (moved, wide) in zip(added, extra, strict=True):
                shifted = mean + moved - plain
                value = float(Surface.log_density(shifted, np.maximum(std, wide)).sum())
                if value > top:
                    top, where = value, _joined(parent, other, ratio, place[1:], more)
    return Place(where, top)


def _joined(
    parent: Effects,
    other: Effects,
    ratio: float,
    sizes: NDArray[np.float64],
    more: NDArray[np.float64],
) -> NDArray[np.float64]:
    """The place of a pair: coordinates follow its effects, which are sorted."""
    parts: Sequence[NDArray[np.float64]] = (sizes, more) if parent < other else (more, sizes)
    return np.concatenate([[ratio], *parts])


def _surface(coarse: Observation, population: Population) -> Surface:
    width = np.array(_WIDTHS[population.places.shape[1]])
    none = np.empty((0, 3, len(coarse)))
    difference = differences(coarse, population)
    nothing = Motions.unknown(*difference.shape[::2])
    return Surface(
        coarse, population.places, difference, width, none, np.empty(0), nothing, tailed=False
    )


def _grid(d: int, ratios: int | None = None) -> NDArray[np.float64]:
    counts = _COUNTS[d] if ratios is None else (ratios, *_COUNTS[d][1:])
    lines = [np.linspace(0.0, 1.0, count) for count in counts]
    return np.stack([m.ravel() for m in np.meshgrid(*lines, indexing="ij")], axis=1)
