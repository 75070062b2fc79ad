"""Refinement: runs of the few sets of causes that the network believes in, at their place.

Owns how many runs each of these sets gets, and where: the amortised posterior says both. The
candidates that come of it are compared by the likelihood of the observation itself. It passes no
verdict.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.fitted_model import Effects, FittedModel
from analysis.ensemble.model import Hypothesis
from analysis.execution.executor import Executor
from analysis.execution.progress import Progress, part_of
from analysis.inference.model_pool import ModelPool
from analysis.inference.odds import log_odds
from analysis.inference.posterior import Posterior, SetPosterior
from analysis.inference.run_design import Reach
from analysis.inference.sets import CauseSets
from analysis.observation.observation import Observation

Vector = NDArray[np.float64]

__all__ = ["Refined", "refine"]

_SHARE, _MOST = 0.99, 16
"""Sets that are refined hold this share of the probability; at most so many."""

_FREQUENCIES = 20
"""Frequencies of each level that the first look takes, or more."""

_FIRST_GROUPS = 4
"""Groups of five runs that a set gets at first, and again where it is kept."""

_ROUNDS = ((8, 6.0, 4), (6, 4.6, 4), (3, 3.0, 6))
"""Rounds on all frequencies: sets that take part at most, how far behind the first in log odds they
may lie, and groups that each gets. Parts of the first take part, too: they have fewer sizes to fit
with, and may be all that there is."""

_LOST = 60.0
"""A part this far behind in log odds on all frequencies gets no further runs there. The plain model
does: as its runs closed in on a response without noise, over datasheet values at 5 %, its log odds
rose from 516 behind to 197 ahead."""

_LEAST = 1e-12
"""Probability of a set that the network rules out."""

_WIDE, _LEAST_REACH, _MOST_REACH = 2.0, (0.06, 0.03), (0.35, 0.3)
"""Runs lie within so many standard deviations of the network's answer; least and most in ratio and
in sizes as shares of their range."""


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """Candidates, the likeliest first, and what the network said.

    `summary` (1, hidden) of the observation; `log_prior`: logarithm of the network's probability of
    each set that was looked at; `log_odds`: of each candidate, with what its runs say.
    """

    candidates: list[FittedModel]
    summary: NDArray[np.float32]
    log_prior: dict[Effects, float]
    log_odds: dict[Effects, float]


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
    sets = posterior.scales.sets
    summary = posterior.summary(observation, unit.tolerances)
    probability = posterior.set_probabilities(summary, tuple(without))
    order = np.argsort(-probability)
    held = np.cumsum(probability[order])
    first = order[: min(int(np.searchsorted(held, _SHARE)) + 1, _MOST)].tolist()
    rng = np.random.default_rng(seed)
    longest = max(block.stop - block.start for block in observation.blocks)
    few = observation.thinned(max(longest // _FREQUENCIES, 1))
    report = part_of(progress, 0.0, 0.4, "simulating the likeliest causes")
    coarse = ModelPool(unit, few, rng, executor, report)
    log_prior: dict[Effects, float] = {}
    reaches: dict[Effects, Reach] = {}

    def look_at(numbers: Iterable[int]) -> None:
        starts = {}
        for number in dict.fromkeys(numbers):
            key = tuple(sorted(sets.names(number)))
            if key not in log_prior:
                one = posterior.given(summary, number, float(probability[number]))
                log_prior[key] = float(np.log(max(one.probability, _LEAST)))
                starts[key] = _placed(Hypothesis(unit, key), one)
        reaches.update({key: reach for key, (_, reach) in starts.items()})
        if starts:
            coarse.simulate_about(starts, _FIRST_GROUPS)

    def odds(pool: ModelPool) -> dict[Effects, float]:
        # Chance of its own, so that asking changes no run.
        return log_odds(pool.found, posterior, pool.observation, log_prior, rng.spawn(1)[0])

    # A posterior of another unit may miss the cause: each single one is looked at.
    single = _single_causes(sets, probability) if posterior.lent_by else ()
    look_at([*first, *_parts(sets, first[0]), sets.index[()], *single])
    coarse.re_estimate_noise()
    leader = _leading(odds(coarse), 1, 0.0)[0]
    look_at(_parts(sets, sets.index[tuple(sorted(map(sets.effects.index, leader)))]))
    (most, behind, groups), *rounds = _ROUNDS
    coarse.simulate_around_estimate(_leading(odds(coarse), most, behind), _FIRST_GROUPS)
    report = part_of(progress, 0.4, 1.0, "comparing the likeliest causes")
    fine = ModelPool(unit, observation, rng, executor, report)
    places = dict.fromkeys([*_leading(odds(coarse), most, behind), ()])
    fine.simulate_about(
        {k: (coarse.found[k].best.place, _nearer(reaches[k])) for k in places},
        groups,
        coarse.ranges(places),
    )
    fine.re_estimate_noise()
    for most, behind, groups in rounds:
        chosen = _leading(odds(fine), most, behind, _LOST)
        fine.simulate_around_estimate(chosen, groups, fine.ranges(chosen))
    fine.re_estimate_noise()
    ranked = odds(fine)
    candidates = sorted(fine.found.values(), key=lambda c: -ranked[c.hypothesis.effects])
    return Refined(candidates, summary, log_prior, ranked)


def _leading(
    odds: Mapping[Effects, float], most: int, behind: float, lost: float = np.inf
) -> list[Effects]:
    """The sets with the largest odds, none too far behind, and every part of the first not lost."""
    ranked = sorted(odds, key=lambda key: -odds[key])
    first = odds[ranked[0]]
    near = [key for key in ranked[:most] if odds[key] >= first - behind]
    parts = (
        key
        for key in ranked
        if set(key) < set(ranked[0]) and (not key or odds[key] >= first - lost)
    )
    return list(dict.fromkeys([*near, *parts]))


def _nearer(reach: Reach) -> Reach:
    """Half as far, where a first look has been taken."""
    return max(0.5 * reach[0], _LEAST_REACH[0]), np.maximum(0.5 * reach[1], _LEAST_REACH[1])


def _parts(sets: CauseSets, number: int) -> list[int]:
    """Every part of a set, the empty one among them."""
    whole = sets.places[number]
    return [sets.index[one] for k in range(len(whole)) for one in combinations(whole, k)]


def _single_causes(sets: CauseSets, probability: Vector) -> list[int]:
    """Every set of one cause that is possible."""
    return [i for i, one in enumerate(sets.places) if len(one) == 1 and probability[i] > 0.0]


def _placed(hypothesis: Hypothesis, one: SetPosterior) -> tuple[Vector, Reach]:
    """Where the runs of a set lie (d,), and how far about it, as the network says."""
    low, high = hypothesis.logs[:, 0], hypothesis.logs[:, 1]
    known = np.array([one.sizes[e, p.name] for e, p in hypothesis.parameters]).reshape(-1, 2)
    at = np.append(one.ratio_mean, (known[:, 0] - low) / (high - low))
    std = np.append(one.ratio_std, known[:, 1] / (high - low))
    least, most = (np.array([a, *[b] * (len(at) - 1)]) for a, b in (_LEAST_REACH, _MOST_REACH))
    reach = np.clip(_WIDE * std, least, most)
    return np.clip(at, 0.02, 0.98), (float(reach[0]), reach[1:])
