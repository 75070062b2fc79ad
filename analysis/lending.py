"""Runs of known causes, lent to sets with one cause more as runs of these with none of it.

Owns where a further cause does nothing, and what a set looks like with such runs beside its own.
Few runs fit badly what lies between them, so that a true pair with twenty lies far behind one of
its causes alone with eighty. But where the further cause does nothing both are the same servo.
Lent runs help to decide where to look: they take no part in any judgement.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.candidate import Effects, form_candidates
from analysis.causes import Hypothesis
from analysis.executor import side_by_side
from analysis.hunt import Hunt
from analysis.population import Population
from analysis.screening import Additions

__all__ = ["leads_with_lent", "on_the_other_side"]

_OFF = 0.03
"""How far a size must be from the datasheet's value to have another side."""


def leads_with_lent(
    hunt: Hunt, additions: Additions, leader: Effects, keys: Collection[Effects]
) -> dict[Effects, float]:
    """By how much sets with one cause more than a leader lead it, in log-likelihood.

    With their own runs, or with those of the leader beside them, whichever tells more.
    """
    known, alone = Hypothesis(hunt.unit, leader), hunt.found[leader]
    own = {key: hunt.found[key] for key in keys}
    runs, starts, idle = {leader: alone.population}, {leader: alone.best.place}, {}
    for key, one in own.items():
        further = Hypothesis(hunt.unit, tuple(e for e in key if e not in leader))
        nothing = _least_of(further, additions)
        runs[key] = one.population.joined(_lent(alone.population, known, further, nothing))
        starts[key] = one.best.place
        idle[key] = known.joined(alone.best.place, further, nothing)[1]
    formed = form_candidates(hunt.unit, hunt.observation, runs, starts)

    def lead(key: Effects) -> float:
        there = formed[key].surface.climb(idle[key]).log_likelihood
        lent = max(formed[key].best.log_likelihood, there) - formed[leader].best.log_likelihood
        return max(lent, own[key].best.log_likelihood - alone.best.log_likelihood)

    return dict(zip(own, side_by_side(lead, own), strict=True))


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
    known = [parameter.nominal(further.unit) for _, parameter in further.parameters]
    values = [value for value in known if value]
    return further.place(0.0, values)[1:] if len(values) == len(known) else None
