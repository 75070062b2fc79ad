"""The parts of a set of causes: the same causes, some of them left out.

Owns what is asked of a set before more is spent on it: that it explains more
than its parts. It simulates nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from itertools import chain, combinations

from analysis.candidate import Candidate, Effects
from analysis.hunt import Starts

__all__ = ["earns", "parts_of", "places_of_parts"]

_EARNED = 6.0
"""Log-likelihood on the rows of the rough look, a third of all, by which a pair must beat its parts
to be looked at further; a further cause costs three times as much in the end."""


def parts_of(key: Effects, found: Collection[Effects]) -> list[Effects]:
    """Sets of fewer of the same causes, as far as they were looked at."""
    fewer = (combinations(key, count) for count in range(1, len(key)))
    return [part for part in chain.from_iterable(fewer) if part in found]


def earns(key: Effects, found: Mapping[Effects, Candidate]) -> bool:
    """Whether a set explains more than any of its parts that were looked at."""
    parts = [found[part].best.log_likelihood for part in parts_of(key, found)]
    return not parts or found[key].best.log_likelihood > max(parts) + _EARNED


def places_of_parts(leader: Candidate) -> Starts:
    """Where sets of one cause less are by the best fit of several causes."""
    whole, place = leader.hypothesis, leader.best.place
    fewer = combinations(whole.effects, len(whole.effects) - 1)
    return {effects: whole.part(effects, place) for effects in fewer}
