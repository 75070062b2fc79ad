"""The search for what a model lacks: from every cause to a few that are looked at closely.

Owns which hypotheses are simulated: an atlas of every single cause, then
rounds with fewer and fewer of them, pairs where no single cause will do, a
second cause behind one that nobody doubts, a third where no pair will do, and
rare causes beside whatever leads.
It compares hypotheses to decide where to look next, and passes no verdict.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.atlas import Atlas, coarse_stride, make_atlas
from analysis.baseline_runs import weigh_baseline
from analysis.candidate import Candidate, Effects
from analysis.contest import (
    CLOSE,
    HOPELESS,
    LAST_GROUPS,
    TOO_FAR,
    back_who_predicts,
    call_back,
    catch_up,
    compare,
    give_chances,
    look_at_every_ratio,
    see_it_predict,
    settle_doubt,
    weigh_parts,
    weigh_plainer,
)
from analysis.doubt import (
    is_doubtful,
    is_doubtful_at_once,
    is_doubtful_still,
    is_given_up,
    is_hardly_missing,
    is_refused_now,
)
from analysis.executor import Executor
from analysis.hunt import Hunt, Starts
from analysis.likeness import is_felt_alike
from analysis.observation import Observation
from analysis.pairs import search_pairs
from analysis.parts import earns, parts_of, places_of_parts
from analysis.progress import Progress, part_of
from analysis.purse import Purse
from analysis.rarities import look_at_rare
from analysis.screening import (
    Place,
    add_causes,
    ranked,
    screen_further,
    screen_singles,
)
from analysis.second_cause import look_for_second
from sim.effort import counting
from sim.unit import Unit

__all__ = ["Searched", "search_causes"]

_FIRST, _FIRST_GROUPS, _FIRST_OF_MANY = 9, 4, 6
_SECOND, _SECOND_GROUPS = 5, 6
_THIRD, _THIRD_GROUPS, _SINGLES = 4, 6, 3
"""How many hypotheses are looked at in each round, and in how many groups of runs each; at first
in more where one has many sizes. So many single causes that are close are always in the third."""

_ONE_SIZE, _BEHIND, _BEHIND_GROUPS = 2, 60.0, 4
"""A cause of one size (coordinates, the ratio is the first) that is so far behind the leader on few
rows is looked at in fewer groups in the third round, and the plain model if it is too far behind:
they are there to be held against, and three times the rows put them three times as far behind."""

_UNEARNED = 3
"""How many pairs with a single cause that leads and is doubted are looked at on all rows, however
little they bring on few. A soft shaft beside a tachometer's gain led it by 3 there with 70 runs,
and by 48 here with 30."""

_ON_SECOND = 0.75
"""Share of what may be simulated from which on nobody looks behind a single cause that explains, if
pairs were searched before."""

_TRIPLES, _TRIPLES_CLOSER, _TRIPLE_GROUPS, _TRIPLES_AFTER = 8, 4, (4, 6), 2
"""How many sets with a third cause beside a leading pair that is doubted are tried, and looked at
closer, in how many groups each time; and how many of them on all rows."""

_LEAST_SURE = 1.5
"""What a pair may miss of levels not fitted, in their standard deviations, before a third cause is
tried: more of it is no explanation (`analysis.verdict`)."""


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    """Candidates, the most likely first, and whether all that was worth it was looked at.

    `given_up`: the search was left with none that explains, having taken all the motion that a
    measurement may (`analysis.purse`). `spared`: not all pairs were looked at that were worth it.
    `few`, `atlas`: the rows that were looked at first, and every single cause there.
    """

    candidates: list[Candidate]
    given_up: bool
    spared: bool
    few: Observation
    atlas: Atlas


def search_causes(
    unit: Unit,
    observation: Observation,
    *,
    without: Collection[str] = (),
    cache: Path | None = None,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Searched:
    """What is left of every set of causes; the baseline is always among the candidates.

    Their surfaces hold the observation with the reading noise that was found along with them.

    Parameters
    ----------
    without
        Effects of the catalogue that are left out, for studies of what happens
        when the cause is unknown.
    cache
        Folder in which atlases are kept.
    executor
        Where runs are simulated; on this machine's cores if not given.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    coarse = observation.thinned(coarse_stride(observation))
    report = part_of(progress, 0.0, 0.4, "simulating every cause")
    atlas = _without(without, make_atlas(unit, coarse, cache, executor, report))
    rng = np.random.default_rng(seed)
    # What an atlas takes is simulated once for a plan, and is not held against a measurement.
    with counting() as effort:
        purse = Purse.for_observation(observation, effort)
        rough = Hunt(
            unit,
            coarse,
            rng,
            executor,
            part_of(progress, 0.4, 0.6, "narrowing down"),
            purse=purse,
        )
        doubted = _look_at_few(rough, atlas, rng)
        fine = Hunt(
            unit,
            observation,
            rng,
            executor,
            part_of(progress, 0.6, 1.0, "looking closer"),
            rough.observation.noise_v,
            purse,
        )
        given_up = False
        missing, pairs_searched = _look_at_all(rough, fine, atlas, rng, doubted)
        if missing:

            def hold_rare() -> None:
                with purse.aside():
                    rare = make_atlas(unit, coarse, cache, executor, fine.report(), rare=True)
                _hold_rare(rough, fine, _without(without, rare), rng)

            def search_late() -> None:
                if pairs_searched:
                    _look_behind_single(rough, fine, atlas, rng)
                else:
                    _search_late(rough, fine, atlas, rng)

            for step in (
                lambda: back_who_predicts(fine, rng),
                lambda: look_at_every_ratio(fine),
                lambda: see_it_predict(fine),
                lambda: call_back(rough, fine, rng),
                lambda: weigh_parts(fine),
                lambda: weigh_plainer(fine, without),
                lambda: _look_for_third(rough, fine, atlas, rng),
                lambda: settle_doubt(fine, rng),
                search_late,
            ):
                given_up = is_given_up(fine, rng)
                if given_up:
                    break
                step()
            if not (given_up and fine.purse.is_overdrawn):
                # One that nobody suspects first may explain what all that was spent has not.
                hold_rare()
            given_up = is_given_up(fine, rng)
            if not given_up:
                weigh_baseline(fine, rng)
    likeliest = sorted(fine.found.values(), key=lambda c: -c.best.log_likelihood)
    return Searched(likeliest, given_up, rough.spared, rough.observation, atlas)


def _without(effects: Collection[str], atlas: Atlas) -> Atlas:
    return {key: runs for key, runs in atlas.items() if not set(key) & set(effects)}


def _look_at_few(rough: Hunt, atlas: Atlas, rng: np.random.Generator) -> bool:
    """Narrow the causes down on few rows; whether no single one will do there."""
    singles = _singles(rough.unit, rough.observation, atlas)
    rough.start({k: one.place for k, one in singles.items()}, _FIRST_GROUPS, _FIRST_OF_MANY)
    others = {k: one.other for k, one in singles.items() if one.other is not None}
    rough.start(others, _FIRST_GROUPS)
    rough.hear()
    rough.look_closer(_with_baseline(rough.leading(_SECOND, TOO_FAR)), _SECOND_GROUPS)
    rough.hear()
    doubted = is_doubtful_at_once(rough, rng)
    if doubted:
        search_pairs(rough, atlas, rng)
    return doubted


def _look_at_all(
    rough: Hunt, fine: Hunt, atlas: Atlas, rng: np.random.Generator, doubted: bool
) -> tuple[bool, bool]:
    """Compare those that are left on all rows.

    `doubted`: whether pairs were searched on few rows, as they are here if that is called for.

    Returns whether something is missing from the plain model, and whether pairs were searched.
    """
    _look_on_all(rough, fine, _third(rough))
    while True:
        if not doubted and is_doubtful_still(fine, rng):
            # More rows, or more runs, show that a single cause will not do after all.
            doubted = True
            _bring_pairs(rough, fine, atlas, rng)
        if doubted and is_doubtful(fine.best, rng):
            _look_at_unearned(rough, fine)
            give_chances(fine)
        missing = compare(fine, rng)
        if doubted or not is_doubtful(fine.best, rng):
            break
    leader = _plainest(fine)
    alone = missing and len(leader) == 1 and not (doubted or fine.purse.is_spent)
    if alone and not is_hardly_missing(fine, rng):
        look_for_second(rough, fine, atlas, leader, rng)
    return missing, doubted


def _look_at_unearned(rough: Hunt, fine: Hunt) -> None:
    """Look on all rows at the best pairs with a single cause that leads and is doubted.

    Few rows may show too little of the second cause to tell it from chance.
    """
    leader = fine.best.hypothesis.effects
    pairs = [key for key in rough.leading(len(rough.found)) if len(key) == 2]
    beside = [key for key in pairs if set(key) > set(leader)][:_UNEARNED] if leader else []
    new = [rough.found[key] for key in beside if key not in fine.found]
    if new:
        fine.take_over(new, _THIRD_GROUPS)
        fine.hear()


def _plainest(fine: Hunt) -> Effects:
    """The leader, or who is close to it and says the same with fewer sizes: that is named.

    What is looked for behind a heavier load has fewer sizes to be told from, and is no payload's.
    """
    close = fine.leading(len(fine.found), CLOSE)
    alike = [key for key in close if is_felt_alike(fine.best, fine.found[key])]
    return (alike or close)[0]


def _search_late(rough: Hunt, fine: Hunt, atlas: Atlas, rng: np.random.Generator) -> None:
    """Search pairs where they were not called for, and the leader would be refused after all.

    It shows what is missing only with the runs that it gets as others are held against it.
    """
    if is_refused_now(fine, rng):
        _bring_pairs(rough, fine, atlas, rng)
        _look_at_unearned(rough, fine)
        give_chances(fine)
        compare(fine, rng)
        see_it_predict(fine)


def _look_behind_single(rough: Hunt, fine: Hunt, atlas: Atlas, rng: np.random.Generator) -> None:
    """Look for a second cause behind the best single one after pairs were searched.

    Where whoever leads would be refused, or that one leads: pairs were searched beside what led on
    few rows, and with few runs of each by themselves.
    """
    close = [k for k in fine.leading(len(fine.found), CLOSE) if len(k) == 1 and k in rough.found]
    if not close:
        return
    leader, plainest = fine.best.hypothesis.effects, _plainest(fine)
    first = plainest if plainest in close else close[0]
    refused = is_refused_now(fine, rng.spawn(1)[0])
    alone = first == plainest and not fine.purse.has_spent(_ON_SECOND)
    if refused or (alone and not is_hardly_missing(fine, rng)):
        look_for_second(rough, fine, atlas, first, rng)
        if fine.best.hypothesis.effects != leader:
            compare(fine, rng)
            see_it_predict(fine)


def _bring_pairs(rough: Hunt, fine: Hunt, atlas: Atlas, rng: np.random.Generator) -> None:
    """Search pairs on few rows, and look at those that lead there on all."""
    search_pairs(rough, atlas, rng)
    _look_on_all(rough, fine, [key for key in _third(rough) if key not in fine.found])


def _look_on_all(rough: Hunt, fine: Hunt, keys: Sequence[Effects]) -> None:
    """Look at hypotheses on all rows, where few left them."""
    near = set(rough.leading(len(rough.found), _BEHIND))
    far = {()} - set(rough.leading(len(rough.found), TOO_FAR))
    one_size = {key for key in keys if rough.found[key].hypothesis.d == _ONE_SIZE}
    behind = [key for key in keys if key in far or key in one_size - near]
    fine.take_over([rough.found[key] for key in keys if key not in behind], _THIRD_GROUPS)
    if behind:
        fine.take_over([rough.found[key] for key in behind], _BEHIND_GROUPS)
    fine.hear()


def _look_for_third(rough: Hunt, fine: Hunt, atlas: Atlas, rng: np.random.Generator) -> None:
    """Look for a third cause where a pair leads that is doubted."""
    if len(fine.best.hypothesis.effects) == 2 and is_doubtful(fine.best, rng, _LEAST_SURE):
        _search_triples(rough, fine, atlas, rng)
        see_it_predict(fine)


def _search_triples(rough: Hunt, fine: Hunt, atlas: Atlas, rng: np.random.Generator) -> None:
    """See whether a third cause makes up for what a leading pair leaves."""
    places = screen_further(add_causes(rough.unit, rough.observation, atlas), fine.best)
    starts = {key: places[key].place for key in ranked(places)[:_TRIPLES]}
    kept = _narrow(rough, starts, _TRIPLES_CLOSER, _TRIPLE_GROUPS)[:_TRIPLES_AFTER]
    if kept:
        fine.take_over([rough.found[key] for key in kept], _THIRD_GROUPS)
        compare(fine, rng)
    if len(fine.best.hypothesis.effects) > 2:
        # Two of the three may do as well where they are now, and not have been looked at.
        fine.start(places_of_parts(fine.best), LAST_GROUPS)
        compare(fine, rng)


def _hold_rare(rough: Hunt, fine: Hunt, atlas: Atlas, rng: np.random.Generator) -> None:
    """See whether a rare cause does as well as the leader, with as many runs."""
    leader = fine.best.hypothesis.effects
    kept = look_at_rare(rough, fine, atlas)
    if not kept:
        return
    fine.take_over([rough.found[key] for key in kept], _THIRD_GROUPS)
    catch_up(fine, kept, leader)
    if leader not in fine.leading(len(fine.found), CLOSE):
        # Less of a lead does not make up for being rare (`analysis.verdict`).
        compare(fine, rng)
    see_it_predict(fine)


def _narrow(rough: Hunt, starts: Starts, closer: int, groups: tuple[int, int]) -> list[Effects]:
    """Those of some sets that explain more than their parts, the best looked at closer."""
    if not starts:
        return []
    rough.start(starts, groups[0])
    rough.look_closer(rough.among(starts)[:closer], groups[1])
    return [key for key in rough.among(starts) if earns(key, rough.found)]


def _singles(unit: Unit, coarse: Observation, atlas: Atlas) -> dict[Effects, Place]:
    """Best places of the single causes that the atlas favours, and of the baseline."""
    places = screen_singles(unit, coarse, atlas)
    return {key: places[key] for key in _with_baseline(ranked(places)[:_FIRST])}


def _third(rough: Hunt) -> list[Effects]:
    """Who is looked at on all rows: the leaders, the parts of the first, and the baseline.

    Single causes close to the best of them, too, however many pairs stand before them, and who says
    the same as a leader with fewer sizes.
    """
    leading = [k for k in rough.leading(len(rough.found), TOO_FAR) if earns(k, rough.found)]
    leading = leading[:_THIRD]
    hopeful = rough.leading(len(rough.found), HOPELESS)
    others = [*parts_of(leading[0], rough.found), *_close_singles(rough)]
    others += [key for key in hopeful if _is_plainer(rough.found[key], leading, rough)]
    return _with_baseline([*leading, *(key for key in others if key in hopeful)])


def _close_singles(rough: Hunt) -> list[Effects]:
    """The best single cause, and a few that are hardly behind it."""
    likelihood: dict[Effects, float] = {
        k: c.best.log_likelihood for k, c in rough.found.items() if len(k) == 1
    }
    close = [k for k, found in likelihood.items() if found >= max(likelihood.values()) - CLOSE]
    return sorted(close, key=lambda key: -likelihood[key])[:_SINGLES]


def _is_plainer(candidate: Candidate, leading: Sequence[Effects], rough: Hunt) -> bool:
    """Whether it says with fewer sizes what a leader says: it is to be there when one is named."""
    return any(is_felt_alike(rough.found[key], candidate) for key in leading)


def _with_baseline(keys: Sequence[Effects]) -> list[Effects]:
    return list(dict.fromkeys([*keys, ()]))
