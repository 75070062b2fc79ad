"""The first look: how well each cause, and each pair, agrees anywhere in its range.

Owns the comparison of an atlas with a thinned observation. Pairs are not in
the atlas: what each of two causes adds to the baseline at the same ratio is
added up. That is wrong in detail and good enough to decide what to simulate,
and it asks nothing of either cause alone: the best place of one of a pair by
itself is seldom its place within the pair. Where both are at the load it is
wrong altogether, but what the load is felt as adds up exactly there. A third
cause is added to what runs of a pair showed. It simulates nothing itself.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from analysis.agreement import total_densities
from analysis.atlas import Atlas
from analysis.atlas_surfaces import felt_pairs, felt_singles, surfaces_of
from analysis.candidate import Candidate, Effects
from analysis.causes import Hypothesis
from analysis.executor import side_by_side
from analysis.observation import Observation
from analysis.surface import Surface
from sim.unit import Unit

__all__ = [
    "Added",
    "Additions",
    "Place",
    "add_causes",
    "mesh",
    "near",
    "ranked",
    "ratios_of_pairs",
    "rows_of",
    "screen_felt",
    "screen_further",
    "screen_pairs",
    "screen_singles",
]

_COUNTS = {1: (31,), 2: (21, 25), 3: (13, 9, 5), 4: (11, 5, 5, 5)}
"""Places looked at along each coordinate."""

_FELT_COUNTS, _REFINED = (10, 4, 16, 2), (0.5, 0.25)
"""The same for what swings on the load, and the shares of those steps in which the best place is
then looked for more closely: the surface is smooth enough for it, and a resonance narrow."""

_PAIR_RATIOS, _PAIR_SIZES = 15, {2: (13,), 3: (9, 3), 4: (4, 15, 2)}
"""The same for pairs, whose ratio is common to both, and for each cause by its coordinates."""

_FELT_ONE_COUNTS, _FELT_PAIR_COUNTS = (15, 20), (10, 8, 8)
"""Places looked at along each coordinate of one cause of one size at the load, and of two."""

_NEAR = 80.0
"""Log-likelihood within which hypotheses seen by what the load is felt as are worth a look, and
pairs that are added up at another ratio. True pairs lay up to 45 behind another such pair (thirteen
drawn), 8 behind a payload (eight), and 38 behind themselves at a ratio 0.7 off."""

_NEAR_ALONE = 30.0
"""The same for a single cause at another ratio: its runs in the atlas are its own, no sum. An EDSS
with less play lay 5 behind itself at a ratio 0.45 off. Up to 80 behind practice sets took longer by
two fifths."""

_APART = 0.25
"""By how much more another ratio differs: closer ones are reached by the same runs."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """The best place of a hypothesis in the coarse look and its log-likelihood.

    `other`: one at another ratio that is hardly worse, where there is one: an atlas is coarse, and
    what two causes do together is not the sum of what each does, so that chance decides between
    them.
    """

    place: NDArray[np.float64]
    log_likelihood: float
    other: NDArray[np.float64] | None = None


def ranked(places: Mapping[Effects, Place]) -> list[Effects]:
    """Hypotheses, the most likely by the coarse look first."""
    return sorted(places, key=lambda key: -places[key].log_likelihood)


def screen_singles(
    unit: Unit, coarse: Observation, atlas: Atlas, wanted: Collection[Effects] | None = None
) -> dict[Effects, Place]:
    """The best place of every hypothesis of an atlas, or of those that are wanted.

    A cause of one size at the load is seen by its own runs, and by all that are felt as it is, for
    its own lie further apart than a notch is wide: a load 10 % too light lay 77 behind a cable
    that pulls, and 12 ahead of it by what is felt.
    """
    surfaces = surfaces_of(unit, coarse, atlas)
    asked = atlas if wanted is None else wanted
    found = {effects: _best_place(surfaces[effects]) for effects in asked}
    for effects, felt in felt_singles(unit, coarse, atlas, asked).items():
        seen = found[effects], _refined(felt, _FELT_ONE_COUNTS)
        found[effects] = max(seen, key=lambda one: one.log_likelihood)
    return found


def screen_felt(additions: Additions) -> dict[Effects, Place]:
    """The best place of every pair that is seen by what the load is felt as."""
    return {key: _best_felt(one) for key, one in additions.felt.items()}


def near(places: Mapping[Effects, Place], log_likelihood: float) -> dict[Effects, Place]:
    """Those of some places, all seen by what the load is felt as, not far behind that."""
    least = log_likelihood - _NEAR
    return {key: one for key, one in places.items() if one.log_likelihood > least}


def screen_pairs(additions: Additions) -> dict[Effects, Place]:
    """The best place of every pair of causes."""
    plain, added = additions.plain, additions.added
    found = {}
    for first, second in combinations(sorted(added), 2):
        key = *first, *second
        if key in additions.felt:
            found[key] = _best_felt(additions.felt[key])
        else:
            found[key] = _best_pair(plain, added[first], added[second])
    return found


def screen_further(additions: Additions, known: Candidate) -> dict[Effects, Place]:
    """The best place of every set that has one cause more than a candidate.

    What a cause adds to the baseline is added to the candidate wherever there are runs of it,
    for with a further cause its best place is another.
    """
    rows = rows_of(additions.coarse, known.surface.observation)
    shown = [np.array(known.surface.expected(p))[..., rows] for p in known.population.places]
    nothing = np.zeros((1, 3 * len(rows)))
    ratios = ratios_of_pairs()
    nearest = [int(np.argmin(abs(ratios - p[0]))) for p in known.population.places]
    found = {}
    for effects, further in additions.added.items():
        if set(effects) <= set(known.hypothesis.effects):
            continue
        likelihood = np.concatenate(
            [
                total_densities(
                    mean.ravel(), nothing, further.shift[at], std.reshape(1, -1), further.std[at]
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


def rows_of(thinned: Observation, whole: Observation) -> NDArray[np.intp]:
    """Where the rows of a thinned observation stand; levels may have frequencies of their own."""
    found = [
        every.start + np.flatnonzero(np.isin(whole.frequency_hz[every], thinned.frequency_hz[some]))
        for every, some in zip(whole.blocks, thinned.blocks, strict=True)
    ]
    return np.concatenate(found)


@dataclass(frozen=True, slots=True, eq=False)
class Added:
    """What a cause adds to the baseline.

    `sizes` (count, d - 1); `shift`, `std` (ratios, count, 3 rows): by how much it
    moves the mean of every channel at every row, and the scatter of single runs with it.
    """

    sizes: NDArray[np.float64]
    shift: NDArray[np.float64]
    std: NDArray[np.float64]

    def between(
        self, count: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """The same at so many sizes, between those there are; of one with several sizes as is."""
        sizes = self.sizes
        if sizes.shape[1] > 1:
            return sizes, self.shift, self.std
        line = np.linspace(sizes[0], sizes[-1], count)
        share = np.array([np.interp(line[:, 0], sizes[:, 0], one) for one in np.eye(len(sizes))])
        return line, share.T @ self.shift, share.T @ self.std


@dataclass(frozen=True, slots=True, eq=False)
class Additions:
    """What the baseline shows, and what every cause of an atlas adds to it.

    `coarse`: the observation that it was held against. `plain` (ratios, 3, rows).
    `felt`: surfaces of pairs of one size each at the load.
    """

    coarse: Observation
    plain: NDArray[np.float64]
    added: Mapping[Effects, Added]
    felt: Mapping[Effects, Surface]


def add_causes(unit: Unit, coarse: Observation, atlas: Atlas) -> Additions:
    """Look at every cause at all ratios and sizes: seconds, so once for many pairs."""
    surfaces = surfaces_of(unit, coarse, atlas)
    ratios = ratios_of_pairs()
    plain = np.array([surfaces[()].expected(np.array([ratio]))[0] for ratio in ratios])
    causes = [e for e in surfaces if e]
    added = side_by_side(lambda e: _added(surfaces[e], plain), causes)
    felt = felt_pairs(unit, coarse, atlas)
    return Additions(coarse, plain, dict(zip(causes, added, strict=True)), felt)


def _added(surface: Surface, plain: NDArray[np.float64]) -> Added:
    sizes = mesh([_centres(count) for count in _PAIR_SIZES[surface.places.shape[1]]])
    ratios = ratios_of_pairs()
    expected = np.array(
        [[surface.expected(np.array([ratio, *size])) for size in sizes] for ratio in ratios]
    )
    flat = expected.reshape(*expected.shape[:3], -1)
    shift = flat[:, :, 0] - plain.reshape(len(plain), 1, -1)
    return Added(sizes, np.ascontiguousarray(shift), np.ascontiguousarray(flat[:, :, 1]))


def _best_pair(plain: NDArray[np.float64], first: Added, second: Added) -> Place:
    places = []
    for at, ratio in enumerate(ratios_of_pairs()):
        likelihood = total_densities(
            plain[at].ravel(), first.shift[at], second.shift[at], first.std[at], second.std[at]
        )
        one, other = np.unravel_index(np.argmax(likelihood), likelihood.shape)
        where = np.array([ratio, *first.sizes[one], *second.sizes[other]])
        places.append(Place(where, float(likelihood[one, other])))
    best = max(places, key=lambda one: one.log_likelihood)
    return replace(best, other=_other(places, best))


def _other(
    places: Sequence[Place], best: Place, behind: float = _NEAR
) -> NDArray[np.float64] | None:
    """The best of places, in order of their ratio, that stands out far from the very best."""
    likelihood = np.array([one.log_likelihood for one in places])
    around = np.concatenate([[-np.inf], likelihood, [-np.inf]])
    stands_out = (likelihood >= around[:-2]) & (likelihood >= around[2:])
    far = np.abs([one.place[0] - best.place[0] for one in places]) > _APART
    worth = stands_out & far & (likelihood > best.log_likelihood - behind)
    if not worth.any():
        return None
    return places[int(np.argmax(np.where(worth, likelihood, -np.inf)))].place


def _best_place(surface: Surface) -> Place:
    if surface.chart is not None:
        # What swings on the load is costly, and seen by so many runs that they tell its ratio.
        return replace(_refined(surface, _FELT_COUNTS), other=None)
    counts = _COUNTS[surface.places.shape[1]]
    return _best_of(surface, [np.linspace(0.0, 1.0, count) for count in counts])


def _best_felt(surface: Surface) -> Place:
    """The best place of two causes of one size each, both at the load."""
    return _refined(surface, _FELT_PAIR_COUNTS)


def _refined(surface: Surface, counts: Sequence[int]) -> Place:
    """The best place about the best of a grid, in ever finer steps."""
    best = _best_of(surface, [_centres(count) for count in counts])
    for share in _REFINED:
        steps = [share / count * np.array([-1.0, 0.0, 1.0]) for count in counts]
        lines = [at + step for at, step in zip(best.place, steps, strict=True)]
        closer = _best_of(surface, [np.clip(line, 0.0, 1.0) for line in lines])
        best = replace(closer, other=best.other)
    return best


def _best_of(surface: Surface, lines: Sequence[NDArray[np.float64]]) -> Place:
    """The best of all places with these coordinates; the ratio is the first of them."""
    grid = mesh(lines).reshape(len(lines[0]), -1, len(lines))
    likelihood = surface.scan(grid.reshape(-1, len(lines))).reshape(grid.shape[:2])
    tops = likelihood.argmax(axis=1)
    places = [Place(grid[at, top], float(likelihood[at, top])) for at, top in enumerate(tops)]
    best = max(places, key=lambda one: one.log_likelihood)
    return replace(best, other=_other(places, best, _NEAR_ALONE))


def ratios_of_pairs() -> NDArray[np.float64]:
    """Ratios at which it is known what causes add."""
    return _centres(_PAIR_RATIOS)


def _centres(count: int) -> NDArray[np.float64]:
    """Middles of so many equal parts of 0 to 1."""
    return (np.arange(count) + 0.5) / count


def mesh(lines: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """All places (count, d) with these coordinates, the last of which runs fastest."""
    return np.stack([m.ravel() for m in np.meshgrid(*lines, indexing="ij")], axis=1)
