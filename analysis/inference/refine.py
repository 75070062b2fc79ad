"""Refinement: runs of the few sets of causes that the network believes in, at their place.

Owns how many runs each of these sets gets, and where: the amortised posterior says both. The
candidates that come of it are compared by the likelihood of the observation itself. It passes no
verdict.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from analysis.candidate import Candidate, Effects
from analysis.causes import Hypothesis
from analysis.executor import Executor
from analysis.hunt import Hunt
from analysis.inference.posterior import Posterior, SetPosterior
from analysis.observation import Observation
from analysis.progress import Progress, part_of

__all__ = ["Refined", "refine"]

_SHARE, _MOST = 0.99, 8
"""Sets that are refined hold this share of the probability; at most so many."""

_GROUPS = 6
"""Groups of five runs that a set gets in each round."""

_ROUNDS, _CONTENDERS, _NEAR = 3, 4, 60.0
"""Rounds after the first, sets that take part in each, and how far behind they may lie."""

_WIDE, _LEAST_REACH, _MOST_REACH = 2.0, (0.06, 0.03), (0.35, 0.3)
"""Runs lie within so many standard deviations of the network's answer; least and most in ratio and
in sizes as shares of their range."""


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """Candidates, the likeliest first, and what the network said of each of them."""

    candidates: list[Candidate]
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
    proposed = posterior.likeliest(summary, _SHARE, tuple(without))[:_MOST]
    index = posterior.scales.sets.index
    place = {name: number for number, name in enumerate(posterior.scales.prior.effects)}
    wanted = _with_parts([one.effects for one in proposed])
    probability = posterior.set_probabilities(summary, tuple(without))
    numbers = {key: index[tuple(sorted(place[e] for e in key))] for key in wanted}
    found = {k: posterior.given(summary, n, float(probability[n])) for k, n in numbers.items()}
    rng = np.random.default_rng(seed)
    report = part_of(progress, 0.0, 1.0, "simulating the likeliest causes")
    fine = Hunt(unit, observation, rng, executor, report)
    for key, one in found.items():
        hypothesis = Hypothesis(unit, key)
        at, std = _place(hypothesis, one)
        least, most = (np.array([a, *[b] * (len(at) - 1)]) for a, b in (_LEAST_REACH, _MOST_REACH))
        reach = np.clip(_WIDE * std, least, most)
        fine.start({key: at}, _GROUPS, reach=(float(reach[0]), reach[1:]))
    fine.hear()
    for _ in range(_ROUNDS):
        near = fine.leading(_CONTENDERS, _NEAR)
        parts = [key for key in found if set(key) < set(near[0])]
        fine.settle(list(dict.fromkeys([*near, *parts])), _GROUPS)
    fine.hear()
    candidates = sorted(fine.found.values(), key=lambda c: -c.best.log_likelihood)
    return Refined(candidates, tuple(found.values()))


def _with_parts(sets: Sequence[Effects]) -> list[Effects]:
    """Sets, every part of the first of them, and the baseline."""
    first = sets[0]
    parts = [part for count in range(len(first)) for part in combinations(first, count)]
    return list(dict.fromkeys([*(tuple(sorted(one)) for one in sets), *map(tuple, parts), ()]))


def _place(hypothesis: Hypothesis, one: SetPosterior) -> tuple[np.ndarray, np.ndarray]:
    """Where a set lies by the network, and its standard deviations, in coordinates (d,)."""
    low, high = hypothesis.logs[:, 0], hypothesis.logs[:, 1]
    known = np.array([one.sizes[e, p.name] for e, p in hypothesis.parameters]).reshape(-1, 2)
    at = np.clip((known[:, 0] - low) / (high - low), 0.02, 0.98)
    std = known[:, 1] / (high - low)
    return np.append(one.ratio_mean, at), np.append(one.ratio_std, std)
