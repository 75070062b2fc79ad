"""A second cause behind a single one that nobody doubts.

Owns which others are tried beside such a leader, and how closely. A cause may look like the
measurement, predict it, and still not be all: what is left beside it is then told by runs of
both, made where the leader is, and by nothing that was seen before. What a second cause must
bring is said by `analysis.verdict`.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from analysis.atlas import Atlas
from analysis.beside import place_beside
from analysis.candidate import Candidate, Effects
from analysis.causes import Hypothesis
from analysis.chart import Chart
from analysis.contest import catch_up, settle
from analysis.hunt import Hunt
from analysis.pairs import at_few_frequencies, look_at_felt, look_beside
from analysis.parts import earns
from analysis.screening import Additions, add_causes, near, ranked, screen_felt, screen_singles
from analysis.verdict import earns_its_name

__all__ = ["look_for_second"]

_TRIED, _CLOSER = 8, 5
"""How many of them are simulated on few rows, and how many of these once more. True ones stood
fourth at worst by where they were placed, where they were to be seen at all."""

_BEHIND, _CLOSER_GROUPS, _BEHIND_STILL = 45.0, 3, 20.0
"""Log-likelihood on few rows behind the leader from which none is looked at closer; in how many
groups about what is learned; and from which none of these goes on. Few runs rank by chance, and the
leader has four times as many: friction at rest of a load, placed first of all, lay 31 behind with
twenty. Thirty more about its best place left it 24 behind; about what is learned it led by 14."""

_ON_ALL, _ALL_GROUPS, _NEARLY, _BEHIND_BEST = 4, 4, 15.0, 30.0
"""How many are simulated on all rows, in how many groups, and the log-likelihoods behind the leader
and behind the best of them within which they get as many again: true ones led by 7 to 86 with the
first of these runs, and were 11 behind the best at most."""

_CALLED_FOR = 15.0
"""By so much must one then lead to be left in the contest: of false ones the best led by 15 to 24
with 80 runs, true ones by 38 to 50."""

_ROUNDS = 2
"""Rounds of runs of the best of them and of the leader after which it is asked whether it brings
more than chance does. True ones were among the best two by then, and the others get as many runs
only where one does: behind a cause that is alone all do about as well, and none does."""


def look_for_second(rough: Hunt, fine: Hunt, atlas: Atlas, rng: np.random.Generator) -> None:
    """See whether a second cause hides behind a single one that is not doubted.

    Parameters
    ----------
    rough, fine
        Hunts on few and on all rows; the second one's leader is what others are tried beside.
    atlas
        On the rows of `rough`.
    rng
        For the reading's noise in runs that are taken as observed.

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
    leads = _leads(fine, beside, leader)
    least = max(-_NEARLY, max(leads.values(), default=0.0) - _BEHIND_BEST)
    settle(fine, [key for key, lead in leads.items() if lead > least])
    catch_up(fine, others, leader)
    leads = _leads(fine, beside, leader)
    # They would only take the place of rivals among those that are judged.
    fine.leave_out([key for key, lead in leads.items() if lead < _CALLED_FOR])
    _contest(fine, leader, rng)


def _contest(fine: Hunt, leader: Effects, rng: np.random.Generator) -> None:
    """Keep sets with a second cause if one brings more than chance does, with as many runs."""
    for _ in range(_ROUNDS):
        best = fine.best.hypothesis.effects
        if best == leader or fine.purse.is_spent:
            break
        settle(fine, [leader, best])
        fine.hear()
    further = {key for key in fine.found if set(key) > set(leader)}
    while (best := fine.best.hypothesis.effects) in further:
        if _leads(fine, [best], leader)[best] < _CALLED_FOR:
            break
        # Few runs fit by chance.
        catch_up(fine, [best], leader)
        if fine.best.hypothesis.effects != best:
            continue
        if earns_its_name(fine.best, fine.found[leader], rng.spawn(1)[0]):
            catch_up(fine, further, best)
            return
        further.remove(best)
        fine.leave_out([best])
    if best in (leader, *further):
        fine.leave_out(further)


def _leads(fine: Hunt, keys: Sequence[Effects], leader: Effects) -> dict[Effects, float]:
    alone = fine.found[leader].best.log_likelihood
    return {key: fine.found[key].best.log_likelihood - alone for key in keys}


def _worth(rough: Hunt, additions: Additions, leader: Candidate) -> list[Effects]:
    """Pairs with the leader that are worth simulating on all rows."""
    alone, place = leader.hypothesis, leader.best.place
    placed = place_beside(at_few_frequencies(rough), additions, alone, place)
    tried = {key: placed[key].place for key in ranked(placed)[:_TRIED]}
    look_beside(rough, {alone.effects: place, **tried})
    hopeful = _near(rough, tried, alone.effects, _BEHIND)[:_CLOSER]
    rough.settle(hopeful, _CLOSER_GROUPS)
    return _near(rough, hopeful, alone.effects, _BEHIND_STILL)[:_ON_ALL]


def _near(rough: Hunt, keys: Collection[Effects], leader: Effects, behind: float) -> list[Effects]:
    """Those of some sets that are no farther behind a leader, the best first."""
    least = rough.found[leader].best.log_likelihood - behind
    return [key for key in rough.among(keys) if rough.found[key].best.log_likelihood > least]


def _stood_for(rough: Hunt, additions: Additions, atlas: Atlas, leader: Effects) -> list[Effects]:
    """Two causes at the load that a payload may stand for, which is then likely by that measure."""
    if not Chart(Hypothesis(rough.unit, leader), rough.observation.frequency_hz).bent.any():
        return []
    glance = screen_singles(rough.unit, rough.observation, atlas, [leader])[leader]
    stood_for = near(screen_felt(additions), glance.log_likelihood)
    look_at_felt(rough, stood_for)
    return rough.among([key for key in stood_for if earns(key, rough.found)])[:_ON_ALL]
