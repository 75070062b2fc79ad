"""What every further cause does beside causes that are known, told by runs and by the atlas.

Owns where a further cause is placed beside known ones. What it adds to the plain
model is not what it adds to a servo that lacks torque or has another load, whose
resonance lies elsewhere. So both together are simulated at a few of its sizes,
and what adding up gets wrong there puts right what it says of the sizes between.
It judges no hypothesis and keeps no run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.agreement import TAIL, TAIL_SCALE
from analysis.candidate import Effects
from analysis.causes import Hypothesis
from analysis.hunt import Hunt
from analysis.screening import Additions, Place, ratios_of_pairs, rows_of
from analysis.surface import differences

__all__ = ["place_beside"]

_RATIO_REACH, _SIZE_REACH = 0.15, 0.2
"""How far in ratio and in size a run tells what adding up gets wrong."""

_NEAREST, _RIDGE = 1e-6, 0.03
"""Weight of runs that are farther, which count where there are no others; and of a prior that what
adding up gets wrong does not change."""

_FARTHEST = 0.25
"""How far from the known ratio a place is looked for."""

_BETWEEN = 61
"""Places looked at along a single size, between those of the atlas: resonances are narrow."""


@dataclass(frozen=True, slots=True, eq=False)
class _Sum:
    """What adding up says of known causes and a further one.

    `ratios` (r,); `sizes` (count, k) of the further; `mean`, `std` (r, count, columns).
    """

    ratios: NDArray[np.float64]
    sizes: NDArray[np.float64]
    mean: NDArray[np.float64]
    std: NDArray[np.float64]


def place_beside(
    few: Hunt, additions: Additions, known: Hypothesis, place: NDArray[np.float64]
) -> dict[Effects, Place]:
    """The best place of every set that has one cause more than known ones at a place (d,).

    `few`: a hunt on some rows of the observation that the additions were held against; it makes
    the runs.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    observation = few.observation
    rows = rows_of(observation, additions.coarse)
    seen = np.isfinite(observation.values)
    further = [key for key in additions.added if not set(key) & set(known.effects)]
    made = few.beside(known, place, [Hypothesis(known.unit, key) for key in further])
    found = {}
    for key in further:
        one = Hypothesis(known.unit, key)
        whole, _ = known.joined(place, one, np.zeros(one.d - 1))
        population = made[whole.effects]
        own = np.array([whole.part(key, run) for run in population.places])
        total = _add_up(additions, known, place, key, rows, seen)
        runs = differences(observation, population)[:, seen]
        ratio, size, likelihood = _best(total, own, runs)
        _, at = known.joined(np.array([ratio, *place[1:]]), one, size)
        found[whole.effects] = Place(at, likelihood)
    return found


def _add_up(
    additions: Additions,
    known: Hypothesis,
    place: NDArray[np.float64],
    further: Effects,
    rows: NDArray[np.intp],
    seen: NDArray[np.bool_],
) -> _Sum:
    """The sum about the known ratio, at what was observed (3, rows) of some rows of the coarse."""
    ratios = ratios_of_pairs()
    near = np.flatnonzero(abs(ratios - place[0]) <= _FARTHEST)

    def at_seen(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return values.reshape(*values.shape[:-1], 3, -1)[..., rows][..., seen]

    one = additions.added[further]
    own = replace(one, shift=at_seen(one.shift[near]), std=at_seen(one.std[near]))
    sizes, shift, std = own.between(_BETWEEN)
    mean = at_seen(additions.plain[near].reshape(len(near), -1))[:, None] + shift
    for effect in known.effects:
        other = additions.added[(effect,)]
        there = known.part((effect,), place)[1:]
        nearest = int(np.argmin(np.sum((other.sizes - there) ** 2, axis=1)))
        mean = mean + at_seen(other.shift[near, nearest])[:, None]
        std = np.maximum(std, at_seen(other.std[near, nearest])[:, None])
    return _Sum(ratios[near], sizes, mean, std)


def _best(
    total: _Sum, own: NDArray[np.float64], runs: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64], float]:
    """The likeliest ratio and size (k,), and how likely it is, what runs tell put right.

    `own` (n, 1 + k): ratio and size of the further cause in each run; `runs` (n, columns).
    """
    ratio = np.argmin(abs(total.ratios[:, None] - own[:, 0]), axis=0)
    off = own[:, 1:] - total.sizes[:, None]
    size = np.argmin(np.sum(off**2, axis=2), axis=0)
    wrong = runs - total.mean[ratio, size]
    likelihood = np.empty(total.mean.shape[:2])
    for i, at in enumerate(total.ratios):
        aside = np.broadcast_to(own[:, :1] - at, (*off.shape[:2], 1))
        reaches = np.concatenate([aside / _RATIO_REACH, off / _SIZE_REACH], axis=2)
        likelihood[i] = _likelihoods(total.mean[i] + _shares(reaches) @ wrong, total.std[i])
    best, there = np.unravel_index(np.argmax(likelihood), likelihood.shape)
    return float(total.ratios[best]), total.sizes[there], float(likelihood[best, there])


def _shares(off: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shares (count, n) of runs in a local plane, by how far (count, n, k) they are, in reaches."""
    squares = np.sum(off**2, axis=2)
    weight = np.exp(-0.5 * squares) + _NEAREST / (1.0 + squares)
    weight /= weight.sum(axis=1, keepdims=True)
    basis = np.concatenate([np.ones((*off.shape[:2], 1)), off], axis=2)
    weighed = (basis * weight[..., None]).swapaxes(1, 2)
    normal = weighed @ basis + _RIDGE * np.diag([0.0] + [1.0] * off.shape[2])
    return np.asarray(np.linalg.solve(normal, weighed)[:, 0])


def _likelihoods(apart: NDArray[np.float64], std: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log-likelihoods (count,) of Student's t, but for a constant."""
    scale = TAIL_SCALE * std
    density = -0.5 * (TAIL + 1.0) * np.log1p((apart / scale) ** 2 / TAIL) - np.log(scale)
    return np.asarray(density.sum(axis=1))
