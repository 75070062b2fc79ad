"""Whether the leader of a search is to be doubted, and what follows: to go on, or to leave it.

Owns when a leader looks too little like its own runs, or predicts too badly, for the search to
leave it at that; when a plain model will do; and when so much is spent that a search is left with
no explanation. Chance doubts a true one now and then, which costs time, and few runs are blind.
It passes no verdict (`analysis.verdict` has its own limits).
"""

from __future__ import annotations

import numpy as np

from analysis.adequacy import judge_adequacy, judge_chance
from analysis.candidate import Candidate
from analysis.holdout import hold_out
from analysis.hunt import Hunt
from analysis.verdict import LEAST_LEAD

__all__ = [
    "is_doubtful",
    "is_doubtful_at_once",
    "is_doubtful_still",
    "is_given_up",
    "is_hardly_missing",
    "is_nothing_missing",
    "is_refused_now",
]

_DOUBT = 2.0
"""Misfit of the best single cause, and the structure that it leaves, in standard deviations, from
which pairs are tried; and the root mean square of what it misses of levels not fitted, in theirs:
where few runs of its own fit each other the first two are blind, and the last is not."""

_DOUBT_OF_FEW = 3.5
"""The first two of these on few rows: pairs cost more than all before, chance alone doubts
a true cause about once in ten times, and the question is asked again on all rows."""

_CLOSER_LOOKS = 3
"""How often a doubtful leader that is far ahead gets more runs before pairs are looked at."""

_TOO_FAR, _GROUPS = 200.0, 6
"""Log-likelihood by which it is far ahead, and in how many groups of runs each of these is."""

_REFUSED, _MISSED = 4.0, 2.0
"""Misfit or structure of a leader that is refused (`analysis.verdict`), not only doubted, and what
it misses of levels not fitted, however much more is spent on it."""

_STRUCTURED_NOW, _MISSED_NOW = 2.5, 1.5
"""Structure of one that would be refused as it is, and what several causes then miss: more runs may
still decide either way."""

_COMMON = 0.2
"""Share of the baseline's own runs that the leader explains better by as much, from which on there
is nothing to be found, and nothing more is simulated."""


def is_doubtful(
    candidate: Candidate,
    rng: np.random.Generator,
    missed: float = _DOUBT,
    unlike: float = _DOUBT,
    structured: float | None = None,
) -> bool:
    """Whether a candidate looks too little like its own runs, or predicts too badly.

    `missed`, `unlike`: limits in standard deviations of what it misses of levels not fitted, and of
    its misfit and the structure that it leaves, for which `structured` is another limit if given.
    """
    fitted = judge_adequacy(candidate, rng)
    if fitted.sigma > unlike or fitted.structure > (unlike if structured is None else structured):
        return True
    return hold_out(candidate, candidate.surface.observation).missed > missed


def is_doubtful_at_once(rough: Hunt, rng: np.random.Generator) -> bool:
    """Whether the leader on few rows is so doubtful that pairs are looked at before more rows."""
    if not is_doubtful(rough.best, rng):
        return False
    # A cause with several parameters may only want a closer look.
    rough.settle([rough.best.hypothesis.effects], _GROUPS)
    return is_doubtful(rough.best, rng, unlike=_DOUBT_OF_FEW)


def is_doubtful_still(fine: Hunt, rng: np.random.Generator) -> bool:
    """Whether the leader is doubtful with more runs, too, where it leaves all others far behind.

    Few runs leave a shape of their own beside a sharp resonance, and pairs cost far more.
    """
    for _ in range(_CLOSER_LOOKS):
        if not is_doubtful(fine.best, rng):
            return False
        leader = fine.best.hypothesis.effects
        if not leader or len(fine.leading(2, _TOO_FAR)) > 1:
            return True
        fine.settle([leader], _GROUPS)
    return is_doubtful(fine.best, rng)


def is_nothing_missing(fine: Hunt, rng: np.random.Generator) -> bool:
    """Whether the plain model will do: its own runs favour the leader as much as what was seen."""
    baseline = fine.found[()]
    if is_doubtful(baseline, rng):
        return False
    return fine.best is baseline or judge_chance(baseline, fine.best, rng) > _COMMON


def is_hardly_missing(fine: Hunt, rng: np.random.Generator) -> bool:
    """Whether the plain model will do by itself, and what leads it does so by too little to count.

    By less than what a cause of one size needs to be named, that is; several sizes need more. Then
    a second cause behind that leader is no question.
    """
    baseline = fine.found[()]
    if fine.best.best.log_likelihood - baseline.best.log_likelihood > LEAST_LEAD:
        return False
    # Chance of its own: all else comes out as if it had not been asked.
    return not is_doubtful(baseline, rng.spawn(1)[0])


def is_refused_now(fine: Hunt, rng: np.random.Generator) -> bool:
    """Whether the leader would be refused as it is, and is not only doubted.

    Three causes are refused for less (`analysis.verdict`): what is sought then is fewer.
    """
    missed = _MISSED_NOW if len(fine.best.hypothesis.effects) > 1 else _MISSED
    return is_doubtful(fine.best, rng, missed, _REFUSED, _STRUCTURED_NOW)


def is_given_up(fine: Hunt, rng: np.random.Generator) -> bool:
    """Whether all was spent that may be, and the leader is no explanation.

    One that may be is looked at for as long as it takes: it might be named.
    """
    if fine.purse.is_overdrawn:
        return is_refused_now(fine, rng)
    return fine.purse.is_spent and is_doubtful(fine.best, rng, _MISSED, _REFUSED)
