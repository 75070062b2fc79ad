"""A second cause behind a single one: one that nobody doubts, or that pairs left standing.

Owns which others are tried beside such a leader, and how closely. A cause may look like the
measurement, predict it, and still not be all: what is left beside it is then told by runs of
both, made where the leader is, with those of the leader lent to them (`analysis.lending`). What a
second cause must bring is said by `analysis.verdict`, of own runs alone.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from analysis.atlas import Atlas
from analysis.beside import place_beside
from analysis.candidate import Candidate, Effects
from analysis.causes import Hypothesis
from analysis.chart import Chart
from analysis.contest import catch_up, has_fewer, settle
from analysis.hunt import Hunt
from analysis.lending import gains_with_lent, leads_with_lent, on_the_other_side
from analysis.likeness import is_felt_alike
from analysis.pairs import (
    BESIDE_REACH,
    at_few_frequencies,
    look_at_felt,
    look_at_parts,
    look_beside,
    look_beside_all,
)
from analysis.parts import earns
from analysis.plausibility import is_out_of_band
from analysis.screening import Additions, add_causes, near, ranked, screen_felt, screen_singles
from analysis.verdict import LEAST_GAIN, earns_its_name

__all__ = ["look_for_second"]

_TRIED, _OTHER_GROUPS = 16, 2
"""How many of them are simulated on few rows, and in how many groups on the other side of the
datasheet's value: by where they were placed true ones stood fourteenth at worst, more play beside a
light load, where they were to be seen at all."""

_CLOSER, _CLOSER_ALONE, _CLOSER_GROUPS, _BEHIND = 6, 3, 6, 45.0
"""How many of these are looked at closer by what they do with runs of the leader lent to them, how
many by their own alone, in how many groups about what is learned of them; and the log-likelihood by
their own runs behind the leader from which none is: few rank by chance. Less play beside a light
load stood fifth, behind by 4 of 14."""

_ON_ALL, _ALL_GROUPS = 4, 8
"""How many at most are simulated on all rows, and in how many groups."""

_LIKELY, _BEHIND_LEADER = 2.0, 3.0
"""How much more of what was observed than of the leader's own runs these must explain on few rows
(`analysis.lending`), and the log-likelihood that they may be behind it. In eleven draws of runs
true ones, or what passes for them, explained 2.7 to 6.4 more; in fifteen of sixteen draws behind
a cause that is alone the best false one explained -0.9 to 1.9 more, and led by up to 12. So one
that is sure by its lead, `_SURE`, need not: less play beside a light load once led by 22, for 1.8.
"""

_AS_WELL = 5.0
"""Log-likelihood on few rows behind the best likely one within which another is simulated on all
rows, too. Friction at rest lay 3.6 behind dry friction beside a brake there, and explained 1.8 more
for 4.8; it was the truth, and the other was named alone."""

_NEARLY, _BEHIND_BEST, _SURE = 10.0, 30.0, 20.0
"""What they must lead by on all rows, and how far behind the best of them they may be, to get as
many runs again; or what they led by on few. Where forty runs lie is chance, too: of a shaft that
hardens beside an amplifier that clips they lay 76 behind."""

_CALLED_FOR = 15.0
"""By so much must one then lead to be left in the contest: of false ones the best led by 15 to 24
with 80 runs, true ones by 38 to 50."""

_ROUNDS = 3
"""Rounds of runs of the best of them and of the leader after which it is asked whether it brings
more than chance does. True ones were among the best two by then, and the others get as many runs
only where one does: behind a cause that is alone all do about as well, and none does."""

_ASKED = 160
"""Runs with which a second cause is asked, or as many as the leader has, if that is fewer. Behind a
payload with 280 friction was 1.5, 1.6, 1.3, 1.3 and 1.6 standard deviations beyond chance with 120
to 280, and a gain 2.4, 2.2, 2.0, 1.9 and 2.1; true ones bring less with 80 than with 160."""

_ASKS = 2
"""How many are asked: true ones were among the best two by then."""

_AS_MUCH = 0.6
"""Share of what one led by that was chance from which on another is asked at all. What chance
brings grows with runs: behind a payload with 320 runs a gain led by 54 with 80 and by 82 with 320,
and two others, by 40 and 46 with 80, brought no more in the end."""


def look_for_second(
    rough: Hunt, fine: Hunt, atlas: Atlas, leader: Effects, rng: np.random.Generator
) -> None:
    """See whether a second cause hides behind a single one.

    Parameters
    ----------
    rough, fine
        Hunts on few and on all rows.
    atlas
        On the rows of `rough`.
    leader
        The single cause that others are tried beside.
    rng
        For the reading's noise in runs that are taken as observed.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    additions = add_causes(rough.unit, rough.observation, atlas)
    beside = _worth(rough, additions, fine.found[leader], rng.spawn(1)[0])
    others = _stood_for(rough, additions, atlas, leader)
    if not beside and not others or fine.purse.is_spent:
        return
    fine.take_over([rough.found[key] for key in (*beside, *others)], _ALL_GROUPS)
    standing = _Standing(fine, additions, leader)
    standing.ask(beside)
    least = max(_NEARLY, max(standing.leads.values(), default=0.0) - _BEHIND_BEST)
    again = [key for key in beside if standing.leads[key] > least or beside[key] > _SURE]
    settle(fine, again)
    catch_up(fine, others, leader)
    before = [key for key in fine.found if set(key) > set(leader) and key not in beside]
    standing.ask([*again, *before])
    # They would only take the place of rivals among those that are judged.
    standing.leave_out([key for key in beside if standing.leads[key] < _CALLED_FOR])
    _look_at_second_alone(standing)
    _contest(standing, rng)
    _replace_first(rough, fine, additions, leader)


def _look_at_second_alone(standing: _Standing) -> None:
    """See whether the second cause is all there is, and the first stands for it.

    A single cause that few rows of an atlas had left out was never held against the leader. Less
    play of an EDSS led a lighter load by 70, and was found beside it alone.
    """
    fine, leader = standing.fine, standing.leader
    seconds = {
        tuple(effect for effect in key if effect not in leader): key
        for key in standing.near[:_ASKS]
    }
    alone = {
        second: fine.found[key].hypothesis.part(second, fine.found[key].best.place)
        for second, key in seconds.items()
        if second not in fine.found
    }
    if alone and not fine.purse.is_spent:
        fine.start(alone, _ALL_GROUPS)
        catch_up(fine, alone, leader, _BEHIND)


def _replace_first(rough: Hunt, fine: Hunt, additions: Additions, leader: Effects) -> None:
    """See whether others do as well beside the second cause as a first one that nobody has seen.

    A resonance outside the band is told by a slope alone, and by three sizes that bend it.
    """
    pair, first = fine.best.hypothesis.effects, fine.found[leader]
    if fine.purse.is_spent or not set(pair) > set(leader) or not is_out_of_band(first):
        return
    second = tuple(effect for effect in pair if effect not in leader)
    rough.start({pair: fine.best.best.place}, _CLOSER_GROUPS)
    look_at_parts(rough, pair)
    others = look_beside_all(rough, additions, {second: rough.found[second].best.place})
    least = rough.found[pair].best.log_likelihood - _BEHIND_BEST
    as_good = [k for k in rough.among(others) if rough.found[k].best.log_likelihood > least]
    newcomers = [key for key in as_good if earns(key, rough.found) and key not in fine.found]
    fine.take_over([rough.found[key] for key in newcomers[:_ASKS]], _ALL_GROUPS)
    catch_up(fine, newcomers[:_ASKS], pair)


@dataclass(frozen=True, slots=True)
class _Standing:
    """How sets with a second cause stand against the first on all rows, its runs lent to them.

    `leads`: by what log-likelihood they lead, as it was asked last.
    """

    fine: Hunt
    additions: Additions
    leader: Effects
    leads: dict[Effects, float] = field(default_factory=dict)

    def ask(self, keys: Collection[Effects]) -> None:
        """See how some stand now."""
        if keys:
            self.leads.update(leads_with_lent(self.fine, self.additions, self.leader, keys))

    @property
    def first(self) -> Effects:
        """Who leads the hunt; the leader, too, where that says the same with fewer sizes."""
        best, leader = self.fine.best, self.fine.found[self.leader]
        return self.leader if is_felt_alike(best, leader) else best.hypothesis.effects

    @property
    def near(self) -> list[Effects]:
        """Those that lead by as much as is called for and are close to the best, first of all."""
        least = max(_CALLED_FOR, max(self.leads.values(), default=0.0) - _BEHIND_BEST)
        return [key for key in _best(self.leads, len(self.leads)) if self.leads[key] >= least]

    def leave_out(self, keys: Collection[Effects]) -> None:
        """Look at some no more."""
        self.fine.leave_out(keys)
        for key in keys:
            del self.leads[key]


def _contest(standing: _Standing, rng: np.random.Generator) -> None:
    """Keep sets with a second cause if one brings more than chance does, with runs enough."""
    fine, leader = standing.fine, standing.leader
    for _ in range(_ROUNDS):
        best = next(iter(standing.near), standing.first)
        few = [key for key in (leader, best) if len(fine.found[key].population) < _ASKED]
        if best == leader or fine.purse.is_spent or not few:
            break
        settle(fine, few)
        fine.hear()
        standing.ask(list(standing.leads))
    refused: list[float] = []
    while len(refused) < _ASKS and (near := standing.near):
        best = near[0]
        if standing.leads[best] < _AS_MUCH * max(refused, default=0.0):
            break
        whole, part = fine.found[best], fine.found[leader]
        # Few runs fit by chance, but may be all that there will be.
        if _is_short(fine, best, leader) and not fine.purse.is_spent:
            _settle_short(fine, best, leader)
            standing.ask([best])
        elif standing.leads[best] >= LEAST_GAIN and earns_its_name(
            whole, part, rng.spawn(1)[0], len(refused)
        ):
            _level(standing, best)
            return
        else:
            refused.append(standing.leads[best])
            standing.leave_out([best])
    if standing.first in (leader, *standing.leads):
        standing.leave_out(list(standing.leads))


def _is_short(fine: Hunt, key: Effects, leader: Effects) -> bool:
    """Whether a set has too few runs to be asked what it brings beyond a leader."""
    return len(fine.found[key].population) < _ASKED and has_fewer(fine, key, leader)


def _settle_short(fine: Hunt, key: Effects, leader: Effects) -> None:
    """Give a set the runs with which it is asked: what the first of them tell places the rest."""
    for _ in range(3):
        if _is_short(fine, key, leader):
            settle(fine, [key])


def _level(standing: _Standing, best: Effects) -> None:
    """Give the best, and those that are close to it, as many runs as the leader, or it, has.

    While they stay close.
    """
    fine = standing.fine
    while not fine.purse.is_spent:
        most = [best, standing.leader]
        few = [key for key in standing.near if any(has_fewer(fine, key, one) for one in most)]
        if not few:
            break
        settle(fine, few)
        fine.hear()
        standing.ask(few)


def _leads(fine: Hunt, keys: Sequence[Effects], leader: Effects) -> dict[Effects, float]:
    alone = fine.found[leader].best.log_likelihood
    return {key: fine.found[key].best.log_likelihood - alone for key in keys}


def _worth(
    rough: Hunt, additions: Additions, leader: Candidate, rng: np.random.Generator
) -> dict[Effects, float]:
    """Pairs with the leader that are worth simulating on all rows, and how far they lead."""
    alone, place = leader.hypothesis, leader.best.place
    placed = place_beside(at_few_frequencies(rough), additions, alone, place)
    tried = {key: placed[key].place for key in ranked(placed)[:_TRIED]}
    look_beside(rough, {alone.effects: place, **tried})
    rough.start(on_the_other_side(alone, tried), _OTHER_GROUPS, reach=BESIDE_REACH)
    hopeful = _best(leads_with_lent(rough, additions, alone.effects, tried), _CLOSER)
    by_own = _leads(rough, rough.among(tried), alone.effects)
    hopeful += [key for key in _best(by_own, _CLOSER_ALONE) if by_own[key] > -_BEHIND]
    hopeful = list(dict.fromkeys(hopeful))
    rough.settle(hopeful, _CLOSER_GROUPS)
    leads = leads_with_lent(rough, additions, alone.effects, hopeful)
    gains = gains_with_lent(rough, additions, alone.effects, hopeful, rng)
    near = [key for key in _best(gains, len(gains)) if leads[key] > -_BEHIND_LEADER]
    likely = [leads[key] for key in near if gains[key] > _LIKELY or leads[key] > _SURE]
    # Who leads by about as much as a likely one is its rival.
    least = max(likely, default=np.inf) - _AS_WELL
    chosen = [key for key in near if gains[key] > _LIKELY or leads[key] > min(least, _SURE)]
    return {key: leads[key] for key in chosen[:_ON_ALL]}


def _best(leads: Mapping[Effects, float], most: int) -> list[Effects]:
    """Those that lead by most, the best first."""
    return sorted(leads, key=lambda key: -leads[key])[:most]


def _stood_for(rough: Hunt, additions: Additions, atlas: Atlas, leader: Effects) -> list[Effects]:
    """Two causes at the load that a payload may stand for, which is then likely by that measure."""
    if not Chart(Hypothesis(rough.unit, leader), rough.observation.frequency_hz).bent.any():
        return []
    glance = screen_singles(rough.unit, rough.observation, atlas, [leader])[leader]
    stood_for = near(screen_felt(additions), glance.log_likelihood)
    look_at_felt(rough, stood_for)
    return rough.among([key for key in stood_for if earns(key, rough.found)])[:_ON_ALL]
