"""A second cause behind a single one that nobody doubts.

Owns which others are tried beside such a leader, and how closely. A cause may look like the
measurement, predict it, and still not be all: what is left beside it is then told by runs of
both, made where the leader is, and by nothing that was seen before. It passes no verdict
(`analysis.verdict` says what a second cause must bring).
"""

from __future__ import annotations

from collections.abc import Sequence

from analysis.atlas import Atlas
from analysis.beside import place_beside
from analysis.candidate import Candidate, Effects
from analysis.causes import Hypothesis
from analysis.chart import Chart
from analysis.contest import CLOSE, catch_up, settle
from analysis.hunt import Hunt
from analysis.pairs import at_few_frequencies, look_at_felt, look_beside, look_closer_beside
from analysis.parts import earns
from analysis.screening import Additions, add_causes, near, ranked, screen_felt, screen_singles

__all__ = ["look_for_second"]

_TRIED, _CLOSER = 8, 5
"""How many of them are simulated on few rows, and how many of these once more. True ones stood
fourth at worst by where they were placed, where they were to be seen at all."""

_BEHIND = 20.0
"""Log-likelihood on few rows behind the leader from which none goes on: few runs rank them by
chance, and true ones lay 1 behind."""

_ON_ALL, _ALL_GROUPS, _NEARLY = 4, 4, 15.0
"""How many are simulated on all rows, in how many groups, and the log-likelihood behind the leader
within which they get as many again: true ones led by 7 to 40 with the first of these runs."""

_CALLED_FOR, _ROUNDS = 15.0, 2
"""By so much must one then lead to be left in the contest, and in how many rounds of runs it and
the leader then are: of false ones the best led by 15 to 24 with 80 runs, true ones by 38 to 50."""


def look_for_second(rough: Hunt, fine: Hunt, atlas: Atlas) -> None:
    """See whether a second cause hides behind a single one that is not doubted.

    Parameters
    ----------
    rough, fine
        Hunts on few and on all rows; the second one's leader is what others are tried beside.
    atlas
        On the rows of `rough`.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    leader = fine.best.hypothesis.effects
    if len(leader) != 1:
        return
    additions = add_causes(rough.unit, rough.observation, atlas)
    beside = _worth(rough, additions, fine.found[leader])
    others = _stood_for(rough, additions, atlas, leader)
    if not beside and not others or fine.purse.is_spent:
        return
    fine.take_over([rough.found[key] for key in (*beside, *others)], _ALL_GROUPS)
    settle(fine, [key for key, lead in _leads(fine, beside, leader).items() if lead > -_NEARLY])
    catch_up(fine, others, leader)
    leads = _leads(fine, beside, leader)
    # They would only take the place of rivals among those that are judged.
    fine.leave_out([key for key, lead in leads.items() if lead < _CALLED_FOR])
    for _ in range(_ROUNDS):
        if fine.best.hypothesis.effects == leader or fine.purse.is_spent:
            break
        settle(fine, [leader, *(key for key in fine.leading(_ON_ALL, CLOSE) if key != leader)])
        fine.hear()


def _leads(fine: Hunt, keys: Sequence[Effects], leader: Effects) -> dict[Effects, float]:
    alone = fine.found[leader].best.log_likelihood
    return {key: fine.found[key].best.log_likelihood - alone for key in keys}


def _worth(rough: Hunt, additions: Additions, leader: Candidate) -> list[Effects]:
    """Pairs with the leader that are worth simulating on all rows."""
    alone, place = leader.hypothesis, leader.best.place
    placed = place_beside(at_few_frequencies(rough), additions, alone, place)
    tried = {key: placed[key].place for key in ranked(placed)[:_TRIED]}
    look_beside(rough, {alone.effects: place, **tried})
    least = rough.found[alone.effects].best.log_likelihood - _BEHIND
    hopeful = [k for k in rough.among(tried) if rough.found[k].best.log_likelihood > least]
    look_closer_beside(rough, hopeful[:_CLOSER])
    return rough.among(hopeful[:_CLOSER])[:_ON_ALL]


def _stood_for(rough: Hunt, additions: Additions, atlas: Atlas, leader: Effects) -> list[Effects]:
    """Two causes at the load that a payload may stand for, which is then likely by that measure."""
    if not Chart(Hypothesis(rough.unit, leader), rough.observation.frequency_hz).bent.any():
        return []
    glance = screen_singles(rough.unit, rough.observation, atlas, [leader])[leader]
    stood_for = near(screen_felt(additions), glance.log_likelihood)
    look_at_felt(rough, stood_for)
    return rough.among([key for key in stood_for if earns(key, rough.found)])[:_ON_ALL]
