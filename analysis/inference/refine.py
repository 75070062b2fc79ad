"""Refinement: runs of the few sets of causes that the network believes in, at their place.

Owns how many runs each of these sets gets, and where: the amortised posterior says both. The
candidates that come of it are compared by the likelihood of the observation itself. It passes no
verdict.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from itertools import combinations, islice

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.fitted_model import Effects, FittedModel
from analysis.ensemble.model import Hypothesis
from analysis.execution.executor import Executor
from analysis.execution.progress import Progress, part_of
from analysis.inference.model_pool import ModelPool
from analysis.inference.posterior import Posterior, SetPosterior
from analysis.inference.run_design import Reach
from analysis.inference.sets import CauseSets
from analysis.observation.observation import Observation

Vector = NDArray[np.float64]

__all__ = ["Refined", "refine"]

_SHARE, _MOST = 0.99, 24
"""Sets that are refined first hold this share of the probability; at most so many."""

_BESIDE, _STEPS = 6, 2
"""Likeliest sets that hold the best one and one cause more, which follow together with every part
of the best one; and how often."""

_FREQUENCIES = 20
"""Frequencies of each level that the first look takes, or more."""

_FIRST_GROUPS = 4
"""Groups of five runs that a set gets at first, and again where it is kept."""

_KEPT, _NEAR = 8, 600.0
"""Sets that are kept after the first look: so many, no further behind in log-likelihood."""

_ROUNDS = ((4, 200.0, 6), (4, 60.0, 8))
"""Rounds on all frequencies: sets that take part at most, how far behind the first they may lie,
and groups that each gets."""

_WIDE, _LEAST_REACH, _MOST_REACH = 2.0, (0.06, 0.03), (0.35, 0.3)
"""Runs lie within so many standard deviations of the network's answer; least and most in ratio and
in sizes as shares of their range."""


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """Candidates, the likeliest first, and what the network said.

    `summary` (1, hidden) of the observation; `proposed`: what it said of each candidate.
    """

    candidates: list[FittedModel]
    summary: NDArray[np.float32]
    proposed: tuple[SetPosterior, ...]


def refine(
    posterior: Posterior,
    observation: Observation,
    *,
    without: Collection[str] = (),
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Refined:
    """Candidates for the sets that hold most of the probability, their parts, and the baseline.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    unit = posterior.scales.prior.unit
    summary = posterior.summary(observation, unit.tolerances)
    probability = posterior.set_probabilities(summary, tuple(without))
    order = np.argsort(-probability)
    held = np.cumsum(probability[order])
    first = order[: min(int(np.searchsorted(held, _SHARE)) + 1, _MOST)]
    rng = np.random.default_rng(seed)
    longest = max(block.stop - block.start for block in observation.blocks)
    few = observation.thinned(max(longest // _FREQUENCIES, 1))
    report = part_of(progress, 0.0, 0.4, "simulating the likeliest causes")
    coarse = ModelPool(unit, few, rng, executor, report)
    found: dict[Effects, SetPosterior] = {}
    reaches: dict[Effects, Reach] = {}

    def look_at(numbers: Iterable[int]) -> None:
        names = [tuple(sorted(posterior.scales.sets.names(int(n)))) for n in numbers]
        new = {k: n for k, n in zip(names, numbers, strict=True) if k not in found}
        for key, number in new.items():
            found[key] = posterior.given(summary, int(number), float(probability[number]))
        starts = {key: _placed(Hypothesis(unit, key), found[key], coarse) for key in new}
        reaches.update({key: reach for key, (_, reach) in starts.items()})
        coarse.simulate_about(starts, _FIRST_GROUPS)

    sets = posterior.scales.sets
    look_at([*first, *_parts(sets, int(first[0]))])
    coarse.re_estimate_noise()
    for _ in range(_STEPS):
        leader = coarse.best.hypothesis.effects
        number = sets.index[tuple(sorted(sets.effects.index(effect) for effect in leader))]
        look_at([*_supersets(posterior, leader, probability), *_parts(sets, number)])
    coarse.simulate_around_estimate(_kept(coarse), _FIRST_GROUPS)
    report = part_of(progress, 0.4, 1.0, "comparing the likeliest causes")
    fine = ModelPool(unit, observation, rng, executor, report)
    kept = dict.fromkeys([*_kept(coarse), ()])
    fine.simulate_about(
        {k: (coarse.found[k].best.place, _nearer(reaches[k])) for k in kept}, _FIRST_GROUPS
    )
    fine.re_estimate_noise()
    for most, behind, groups in _ROUNDS:
        near = fine.leading(most, behind)
        fine.simulate_around_estimate(
            list(dict.fromkeys([*near, *_parts_of(near[0], fine)])), groups
        )
    fine.re_estimate_noise()
    candidates = sorted(fine.found.values(), key=lambda c: -c.best.log_likelihood)
    return Refined(candidates, summary, tuple(found.values()))


def _kept(coarse: ModelPool) -> list[Effects]:
    """Sets that the first look leaves, and parts of the first of them.

    A part has fewer sizes to fit with, and may be all that there is.
    """
    near = coarse.leading(_KEPT, _NEAR)
    return list(dict.fromkeys([*near, *_parts_of(near[0], coarse)]))


def _parts_of(whole: Effects, fine: ModelPool) -> list[Effects]:
    """Parts of a set that are not out of the question."""
    return [key for key in fine.leading(len(fine.found), _NEAR) if set(key) < set(whole)]


def _nearer(reach: Reach) -> Reach:
    """Half as far, where a first look has been taken."""
    return max(0.5 * reach[0], _LEAST_REACH[0]), np.maximum(0.5 * reach[1], _LEAST_REACH[1])


def _parts(sets: CauseSets, number: int) -> list[int]:
    """Every part of a set, the empty one among them."""
    whole = sets.places[number]
    return [sets.index[one] for k in range(len(whole)) for one in combinations(whole, k)]


def _supersets(
    posterior: Posterior, leader: Effects, probability: NDArray[np.float64]
) -> list[int]:
    """The likeliest sets that hold a leader and one more cause."""
    sets = posterior.scales.sets
    members = {sets.effects.index(effect) for effect in leader}
    order = np.argsort(-probability)
    holding = (n for n in order if members < set(sets.places[n]))
    one_more = (int(n) for n in holding if sets.sizes[n] == len(members) + 1 and probability[n])
    return list(islice(one_more, _BESIDE if leader else 0))


def _placed(hypothesis: Hypothesis, one: SetPosterior, fine: ModelPool) -> tuple[Vector, Reach]:
    """Where the runs of a set lie (d,), and how far about it.

    By the network, and where a part of it leads, by that for what it holds.
    """
    low, high = hypothesis.logs[:, 0], hypothesis.logs[:, 1]
    known = np.array([one.sizes[e, p.name] for e, p in hypothesis.parameters]).reshape(-1, 2)
    at = np.append(one.ratio_mean, (known[:, 0] - low) / (high - low))
    std = np.append(one.ratio_std, known[:, 1] / (high - low))
    least, most = (np.array([a, *[b] * (len(at) - 1)]) for a, b in (_LEAST_REACH, _MOST_REACH))
    reach = np.clip(_WIDE * std, least, most)
    if fine.found and set(part := fine.best.hypothesis.effects) < set(hypothesis.effects):
        shared = [True, *(effect in part for effect, _ in hypothesis.parameters)]
        at[shared], reach[shared] = fine.best.best.place, np.minimum(reach, 4.0 * least)[shared]
    return np.clip(at, 0.02, 0.98), (float(reach[0]), reach[1:])
