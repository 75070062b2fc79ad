"""Runs of known causes, lent to sets with one cause more as runs of these with none of it.

Owns where a further cause does nothing, and what a set looks like with such runs beside its own.
Few runs fit badly what lies between them, so that a true pair with twenty lies far behind one of
its causes alone with eighty. But where the further cause does nothing both are the same servo.
Lent runs help to decide where to look: they take no part in any judgement.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.candidate import Candidate, Effects, form_candidates
from analysis.causes import Hypothesis
from analysis.executor import side_by_side
from analysis.hunt import Hunt
from analysis.own_runs import FEWEST_RUNS, OwnRun, own_runs
from analysis.population import Population
from analysis.screening import Additions
from analysis.surface import Surface

__all__ = ["gains_with_lent", "leads_with_lent", "on_the_other_side"]

_TO_STD = 1.4826
"""Of normal values the standard deviation, in medians of how far they are from their median."""

_OFF = 0.03
"""How far a size must be from the datasheet's value to have another side."""


def leads_with_lent(
    hunt: Hunt, additions: Additions, leader: Effects, keys: Collection[Effects]
) -> dict[Effects, float]:
    """By how much sets with one cause more than a leader lead it, in log-likelihood.

    With their own runs, or with those of the leader beside them, whichever tells more.
    """
    alone, with_lent = _lend(hunt, additions, leader, keys)
    by_itself = hunt.found[leader].best.log_likelihood

    def lead(key: Effects) -> float:
        formed = with_lent[key].candidate
        there = formed.surface.climb(with_lent[key].idle(hunt.found[leader].best.place))
        lent = max(formed.best.log_likelihood, there.log_likelihood) - alone.best.log_likelihood
        return max(lent, hunt.found[key].best.log_likelihood - by_itself)

    return dict(zip(with_lent, side_by_side(lead, with_lent), strict=True))


def gains_with_lent(
    hunt: Hunt,
    additions: Additions,
    leader: Effects,
    keys: Collection[Effects],
    rng: np.random.Generator,
) -> dict[Effects, float]:
    """How much more a further cause explains of what was observed than of the leader's own runs.

    In standard deviations of what it explains of these, beyond their median, both by ranks: single
    runs are off by far. An own run is fitted by the half of the leader's runs that deviates
    otherwise, alone and lent to the set; what was observed by either half, in the mean. Infinite
    where no own runs can be compared.
    """
    alone, with_lent = _lend(hunt, additions, leader, keys)
    runs = list(own_runs(alone, rng))
    if len(runs) < FEWEST_RUNS:
        return dict.fromkeys(with_lent, math.inf)
    by_itself = side_by_side(lambda run: _fitted(run.alone, run.place), runs)
    first = alone.population.deviations[:, 0]
    halves = [first == one for one in np.unique(first)]
    seen_alone = [_fitted(alone.surface.of(half), alone.best.place) for half in halves]

    def gain(key: Effects) -> float:
        one = with_lent[key]

        def explained(run: OwnRun) -> float:
            return one.fitted(run.seen_by(one.beside(run.others)), run.place)

        own = np.array(side_by_side(explained, runs)) - by_itself
        seen = [one.fitted(one.beside(half), alone.best.place) for half in halves]
        scatter = _TO_STD * np.median(np.abs(own - np.median(own)))
        brings = np.mean(seen) - np.mean(seen_alone)
        return float((brings - np.median(own)) / max(scatter, 1e-9))

    return {key: gain(key) for key in with_lent}


@dataclass(frozen=True, slots=True, eq=False)
class _WithLent:
    """A set of causes, formed of its own runs and of those of some of its causes, `known`.

    `own`: how many are its own, which come first; `nothing` (k,): where the further cause does
    nothing.
    """

    candidate: Candidate
    own: int
    known: Hypothesis
    further: Hypothesis
    nothing: NDArray[np.float64]

    def idle(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """A place (d,) of the known causes with the further one doing nothing."""
        return self.known.joined(place, self.further, self.nothing)[1]

    def beside(self, some: NDArray[np.bool_]) -> Surface:
        """The surface with only some of the lent runs (n,) beside its own."""
        return self.candidate.surface.of(np.append(np.ones(self.own, dtype=bool), some))

    def fitted(self, surface: Surface, place: NDArray[np.float64]) -> float:
        """How well it agrees, seen from a known place (d,), and from where it is best."""
        return max(_fitted(surface, self.idle(place)), _fitted(surface, self.candidate.best.place))


def _fitted(surface: Surface, place: NDArray[np.float64]) -> float:
    return surface.climb(place, tries=1).log_likelihood


def _lend(
    hunt: Hunt, additions: Additions, leader: Effects, keys: Collection[Effects]
) -> tuple[Candidate, dict[Effects, _WithLent]]:
    """A leader, and sets with one cause more with its runs lent to them, formed together."""
    known, alone = Hypothesis(hunt.unit, leader), hunt.found[leader]
    runs, starts = {leader: alone.population}, {leader: alone.best.place}
    lent = {}
    for key in keys:
        further = Hypothesis(hunt.unit, tuple(e for e in key if e not in leader))
        nothing = _least_of(further, additions)
        own = hunt.found[key].population
        runs[key] = own.joined(_lent(alone.population, known, further, nothing))
        starts[key] = hunt.found[key].best.place
        lent[key] = len(own), known, further, nothing
    formed = form_candidates(hunt.unit, hunt.observation, runs, starts)
    return formed[leader], {key: _WithLent(formed[key], *one) for key, one in lent.items()}


def on_the_other_side(
    known: Hypothesis, places: Mapping[Effects, NDArray[np.float64]]
) -> dict[Effects, NDArray[np.float64]]:
    """The same places (d,), but as far beyond the datasheet's value of the further cause.

    Of those whose datasheet value lies amid its range. What two causes do together may look like
    adding up on the wrong side of it, and from lent runs, which lie between, the right one is told.
    """
    found = {}
    for key, place in places.items():
        further = Hypothesis(known.unit, tuple(e for e in key if e not in known.effects))
        nothing = _known_sizes(further)
        if further.centred and nothing is not None:
            whole = Hypothesis(known.unit, key)
            size = whole.part(further.effects, place)[1:]
            if abs(size - nothing) > _OFF:
                other = np.clip(2.0 * nothing - size, 0.0, 1.0)
                found[key] = known.joined(whole.part(known.effects, place), further, other)[1]
    return found


def _lent(
    runs: Population, known: Hypothesis, further: Hypothesis, nothing: NDArray[np.float64]
) -> Population:
    """Runs of known causes as runs of both."""
    places = [known.joined(place, further, nothing)[1] for place in runs.places]
    return Population(np.array(places), runs.deviations, runs.mean, runs.variance)


def _least_of(further: Hypothesis, additions: Additions) -> NDArray[np.float64]:
    """The sizes (k,) at which a cause does nothing: the datasheet's, or where it does least."""
    known = _known_sizes(further)
    if known is not None:
        return known
    added = additions.added[further.effects]
    does = np.abs(added.shift / added.std).mean(axis=(0, 2))
    return np.asarray(added.sizes[np.argmin(does)])


def _known_sizes(further: Hypothesis) -> NDArray[np.float64] | None:
    """Sizes (k,) of a cause as the datasheet has them, if it does."""
    known = further.datasheet
    return None if np.isnan(known).any() else known
