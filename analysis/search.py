"""The search for what a model lacks: from every cause to a few that are looked at closely.

Owns which hypotheses are simulated: an atlas of every single cause, then
rounds with fewer and fewer of them, pairs where no single cause will do, and
a third cause where no pair will.
It compares hypotheses to decide where to look next, and passes no verdict.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from analysis.adequacy import judge_adequacy
from analysis.atlas import Atlas, coarse_stride, make_atlas
from analysis.candidate import Candidate, Effects
from analysis.causes import Hypothesis
from analysis.chart import Chart
from analysis.doubt import (
    is_doubtful,
    is_doubtful_at_once,
    is_doubtful_still,
    is_nothing_missing,
)
from analysis.executor import Executor
from analysis.holdout import AT_NOISE, hold_out
from analysis.hunt import Hunt, Starts
from analysis.likeness import is_felt_alike
from analysis.observation import Observation
from analysis.pairs import look_at_felt, search_pairs
from analysis.parts import earns, parts_of, places_of_parts
from analysis.plausibility import is_pressed
from analysis.progress import Progress, part_of
from analysis.rarities import look_at_rare
from analysis.screening import (
    add_causes,
    near,
    ranked,
    screen_felt,
    screen_further,
    screen_pairs,
    screen_singles,
)
from sim.unit import Unit

__all__ = ["search_causes"]

_FIRST, _FIRST_GROUPS, _FIRST_OF_MANY = 9, 2, 4
_SECOND, _SECOND_GROUPS = 5, 4
_THIRD, _THIRD_GROUPS, _SINGLES = 4, 4, 3
"""How many hypotheses are looked at in each round, and in how many groups of runs each; at first
in more where one has many sizes. So many single causes that are close are always in the third."""

_BESIDE, _BESIDE_CLOSER, _BESIDE_GROUPS = (5, 8), (2, 4), (2, 4)
"""How many pairs with a leader that is not doubted are tried, and how many looked at closer, where
it predicts other levels well and where worse than true causes do; in how many groups each time."""

_CALLED_FOR = 37.5
"""By so much must one of these lead a cause that predicts well to be looked at any further: half of
what it takes to be named in its place (`analysis.verdict`)."""

_TRIPLES, _TRIPLES_CLOSER, _TRIPLE_GROUPS, _TRIPLES_AFTER = 8, 4, (2, 4), 2
"""The same for sets with a third cause beside a leading pair that is doubted."""

_NEAR, _CLOSE = 120.0, 30.0
_LAST_ROUNDS, _LAST_GROUPS = ((4, _NEAR), (3, 60.0), (3, _CLOSE), (3, _CLOSE)), 4
"""Rounds in which the leader and those as close behind it as that log-likelihood are looked at
once more: at most so many, the parts of a leading pair and the baseline, in so many groups each.
Where none is close all but the first are spared.
"""

_IN_EARNEST = 2
"""Rounds after which it is believed that a set wants a size which no bench has; fewer runs may
only seem to say so."""

_ENOUGH = 320
"""Runs of a hypothesis from which on it gets no more to be compared by."""

_CHANCES = 4
"""Hypotheses that are looked at once more where none fits yet."""

_TOO_FAR, _HOPELESS = 200.0, 300.0
"""Log-likelihood behind the leader from which the second and the third round leave one out, and the
last ones its parts, and from which there is no second chance."""

_LEAST_SURE = 1.5
"""What a pair may miss of levels not fitted, in their standard deviations, before a third cause is
tried: more of it is no explanation (`analysis.verdict`)."""

_LITTLE = 10.0
"""Log-likelihood in the coarse look that a pair may lack of its leading part, and be looked at;
any where that part predicts badly, for pairs are looked at in coarser steps."""

_PREDICTED, _NOT_PREDICTED, _MORE_ROUNDS, _ROUNDS_ALONE = (1.3, 1.0), 2.5, 3, 7
"""What a leader of one cause, or of several, misses of levels not fitted, in standard deviations,
from which it gets more runs (several are refused for less, `analysis.verdict`) and up to which
that may help; how many times, and how many where it leaves all others far behind: a pair with four
parameters took six rounds to be seen as the truth that it was."""

_OPEN, _ROUNDS_OPEN = (1.0, 8.0), 4
"""Structure between which a leader gets more runs, and how many times. What the runs of a true
cause leave beside a sharp resonance goes with more of them, what a false one leaves stays or grows:
an amplifier's gain that was withheld left 1.9 as a motor's constant in 80 runs, in 240 2.0 to 4.1.
Of 28 true ones two left more than the first; what leaves more than the second is settled."""


def search_causes(
    unit: Unit,
    observation: Observation,
    *,
    without: Collection[str] = (),
    cache: Path | None = None,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> list[Candidate]:
    """Candidates, the most likely first; the baseline is always among them.

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
    atlas = make_atlas(unit, coarse, cache, executor, report)
    atlas = {k: v for k, v in atlas.items() if not set(k) & set(without)}
    rng = np.random.default_rng(seed)
    rough = Hunt(unit, coarse, rng, executor, part_of(progress, 0.4, 0.6, "narrowing down"))
    rough.start(_singles(unit, coarse, atlas), _FIRST_GROUPS, _FIRST_OF_MANY)
    rough.hear()
    rough.look_closer(_with_baseline(rough.leading(_SECOND, _TOO_FAR)), _SECOND_GROUPS)
    rough.hear()
    doubted = is_doubtful_at_once(rough, rng)
    if doubted:
        search_pairs(rough, atlas)
    fine = Hunt(
        unit,
        observation,
        rng,
        executor,
        part_of(progress, 0.6, 1.0, "looking closer"),
        rough.observation.noise_v,
    )
    third = _third(rough)
    fine.take_over([rough.found[key] for key in third], _THIRD_GROUPS)
    fine.hear()
    while True:
        if not doubted and is_doubtful_still(fine, rng):
            # More rows, or more runs, show that a single cause will not do after all.
            doubted = True
            search_pairs(rough, atlas)
            pairs = [key for key in _third(rough) if key not in fine.found]
            fine.take_over([rough.found[key] for key in pairs], _THIRD_GROUPS)
            fine.hear()
        if doubted and is_doubtful(fine.best, rng):
            # Parameters trade off in ways that evenly placed runs miss: a second chance.
            leading = [key for key in fine.leading(len(fine.found), _HOPELESS) if key]
            _settle(fine, leading[:_CHANCES])
        missing = _compare(fine, rng)
        if doubted or not is_doubtful(fine.best, rng):
            break
    if missing:
        if not doubted:
            _look_beside(rough, fine, atlas, rng)
        _see_it_predict(fine)
        _weigh_parts(fine)
        if len(fine.best.hypothesis.effects) == 2 and is_doubtful(fine.best, rng, _LEAST_SURE):
            _search_triples(rough, fine, atlas, rng)
            _see_it_predict(fine)
        _settle_doubt(fine, rng)
        rare = make_atlas(unit, coarse, cache, executor, fine.report(), rare=True)
        _hold_rare(rough, fine, {k: v for k, v in rare.items() if not set(k) & set(without)}, rng)
    return sorted(fine.found.values(), key=lambda c: -c.best.log_likelihood)


def _look_beside(rough: Hunt, fine: Hunt, atlas: Atlas, rng: np.random.Generator) -> None:
    """See whether a second cause hides behind a single one that is not doubted."""
    leader = fine.best.hypothesis.effects
    if len(leader) != 1:
        return
    glance = screen_singles(rough.unit, rough.observation, atlas, [leader])[leader]
    additions = add_causes(rough.unit, rough.observation, atlas)
    places = screen_pairs(additions, leader)
    poor = hold_out(fine.best, fine.observation).rms_sigma > AT_NOISE
    enough = -np.inf if poor else glance.log_likelihood - _LITTLE
    chosen = [k for k in ranked(places)[: _BESIDE[poor]] if places[k].log_likelihood > enough]
    # Of what adds up exactly the place is right, and how likely it is not comparable.
    chosen += [k for k in places if k in additions.felt and k not in chosen]
    starts = {key: places[key].place for key in chosen}
    kept = _narrow(rough, starts, _BESIDE_CLOSER[poor], _BESIDE_GROUPS)
    if Chart(Hypothesis(rough.unit, leader), rough.observation.frequency_hz).bent.any():
        # What swings on the load has stood for two causes there, and is likely by that measure.
        stood_for = near(screen_felt(additions), glance.log_likelihood)
        look_at_felt(rough, stood_for)
        kept = rough.among([*kept, *(key for key in stood_for if earns(key, rough.found))])
    kept = kept[: _BESIDE_CLOSER[0]]
    if kept:
        fine.take_over([rough.found[key] for key in kept], _THIRD_GROUPS)
        _catch_up(fine, kept, leader)
        if not poor:
            alone = fine.found[leader].best.log_likelihood
            beside = {k: fine.found[k].best.log_likelihood - alone for k in kept if leader[0] in k}
            fine.leave_out([k for k, lead in beside.items() if 0.0 < lead < _CALLED_FOR])
        if fine.best.hypothesis.effects != leader:
            _compare(fine, rng)


def _search_triples(rough: Hunt, fine: Hunt, atlas: Atlas, rng: np.random.Generator) -> None:
    """See whether a third cause makes up for what a leading pair leaves."""
    places = screen_further(add_causes(rough.unit, rough.observation, atlas), fine.best)
    starts = {key: places[key].place for key in ranked(places)[:_TRIPLES]}
    kept = _narrow(rough, starts, _TRIPLES_CLOSER, _TRIPLE_GROUPS)[:_TRIPLES_AFTER]
    if kept:
        fine.take_over([rough.found[key] for key in kept], _THIRD_GROUPS)
        _compare(fine, rng)
    if len(fine.best.hypothesis.effects) > 2:
        # Two of the three may do as well where they are now, and not have been looked at.
        fine.start(places_of_parts(fine.best), _LAST_GROUPS)
        _compare(fine, rng)


def _hold_rare(rough: Hunt, fine: Hunt, atlas: Atlas, rng: np.random.Generator) -> None:
    """See whether a rare cause does as well as the leader, with as many runs."""
    leader = fine.best.hypothesis.effects
    kept = look_at_rare(rough, fine, atlas)
    if not kept:
        return
    fine.take_over([rough.found[key] for key in kept], _THIRD_GROUPS)
    _catch_up(fine, kept, leader)
    if leader not in fine.leading(len(fine.found), _CLOSE):
        # Less of a lead does not make up for being rare (`analysis.verdict`).
        _compare(fine, rng)
    _see_it_predict(fine)


def _catch_up(fine: Hunt, newcomers: Collection[Effects], leader: Effects) -> None:
    """Give those that come close to a leader as many runs as it has, while they stay close.

    All others were compared with it before.
    """
    enough = min(len(fine.found[leader].population), _ENOUGH)
    near = set(newcomers)
    while near := near & set(fine.leading(len(fine.found), _CLOSE)):
        near = {key for key in near if len(fine.found[key].population) < enough}
        _settle(fine, sorted(near))


def _narrow(rough: Hunt, starts: Starts, closer: int, groups: tuple[int, int]) -> list[Effects]:
    """Those of some sets that explain more than their parts, the best looked at closer."""
    if not starts:
        return []
    rough.start(starts, groups[0])
    rough.look_closer(rough.among(starts)[:closer], groups[1])
    return [key for key in rough.among(starts) if earns(key, rough.found)]


def _see_it_predict(fine: Hunt) -> None:
    """Give a leader, and who is close to it, more runs where it predicts badly: few runs do."""
    for done in range(_ROUNDS_ALONE):
        missed = hold_out(fine.best, fine.observation).rms_sigma
        causes = len(fine.best.hypothesis.effects)
        if not causes or not _PREDICTED[causes > 1] < missed < _NOT_PREDICTED:
            break
        if len(fine.leading(2, _TOO_FAR)) == 1:
            fine.settle([fine.best.hypothesis.effects], _LAST_GROUPS)
        elif done < _MORE_ROUNDS:
            _settle(fine, [key for key in fine.leading(_CHANCES, _CLOSE) if key])
        else:
            break
        fine.hear()


def _settle_doubt(fine: Hunt, rng: np.random.Generator) -> None:
    """Give a leader that may or may not leave structure more runs, and who is close to it."""
    least, most = _OPEN
    for _ in range(_ROUNDS_OPEN):
        leader, *near = fine.leading(_CHANCES, _CLOSE)
        few = [k for k in (leader, *near) if len(fine.found[k].population) < _ENOUGH]
        if leader not in few or not least < judge_adequacy(fine.best, rng).structure < most:
            break
        # Half where they agree, half about what is learned: either alone stays where its runs are.
        fine.look_closer(few, _LAST_GROUPS // 2)
        fine.settle(few, _LAST_GROUPS // 2)
        fine.hear()


def _weigh_parts(fine: Hunt) -> None:
    """See what the causes of a leading pair do alone where it has them, with runs enough.

    A resonance that had been looked at elsewhere lay 300 behind itself and a brake it has not, and
    friction that another sort of friction stood for was not looked at alone at all.
    """
    leader = fine.best
    if len(leader.hypothesis.effects) < 2:
        return
    places = {
        part: place
        for part, place in places_of_parts(leader).items()
        if part not in fine.found or len(fine.found[part].population) <= len(leader.population)
    }
    if places:
        fine.start(places, _LAST_GROUPS)
        hopeful = fine.leading(len(fine.found), _HOPELESS)
        fine.settle([key for key in hopeful if key in places], _LAST_GROUPS)
        fine.hear()


def _settle(fine: Hunt, chosen: Sequence[Effects]) -> None:
    few = [key for key in chosen if len(fine.found[key].population) < _ENOUGH]
    if few:
        fine.settle(few, _LAST_GROUPS)


def _compare(fine: Hunt, rng: np.random.Generator) -> bool:
    """Give whoever is compared with the leader as many runs: more runs fit better.

    Returns whether something is missing from the plain model.
    """
    missing = True
    for done, (most, behind) in enumerate(_LAST_ROUNDS):
        missing = not is_nothing_missing(fine, rng)
        if not missing:
            break
        leader, *near = fine.leading(most, behind)
        # The parts of a pair count in every round, even where others lie before them: with few runs
        # a true cause of several parameters has been beaten by itself and another.
        parts = set(parts_of(leader, fine.found))
        near += sorted(parts & set(fine.leading(len(fine.found), _TOO_FAR)))
        if done >= _IN_EARNEST:
            # Who wants a size that no bench has is no explanation, however well it fits.
            plausible = [key for key in [leader, *near] if not is_pressed(fine.found[key])]
            leader, *near = plausible or [leader, *near]
            # Nor is it a question who leads of two that say the same.
            near = [key for key in near if not _say_the_same(fine.found[leader], fine.found[key])]
        if done and not near:
            break
        near += [key for key in fine.leading(len(fine.found), behind) if not key]
        _settle(fine, list(dict.fromkeys([leader, *near])))
    fine.hear()
    return missing


def _singles(unit: Unit, coarse: Observation, atlas: Atlas) -> Starts:
    """Best places of the single causes that the atlas favours, and of the baseline."""
    places = screen_singles(unit, coarse, atlas)
    return {key: places[key].place for key in _with_baseline(ranked(places)[:_FIRST])}


def _third(rough: Hunt) -> list[Effects]:
    """Who is looked at on all rows: the leaders, the parts of the first, and the baseline.

    Single causes close to the best of them, too, however many pairs stand before them, and who says
    the same as a leader with fewer sizes.
    """
    leading = [k for k in rough.leading(len(rough.found), _TOO_FAR) if earns(k, rough.found)]
    leading = leading[:_THIRD]
    hopeful = rough.leading(len(rough.found), _HOPELESS)
    others = [*parts_of(leading[0], rough.found), *_close_singles(rough)]
    others += [key for key in hopeful if _is_plainer(rough.found[key], leading, rough)]
    return _with_baseline([*leading, *(key for key in others if key in hopeful)])


def _close_singles(rough: Hunt) -> list[Effects]:
    """The best single cause, and a few that are hardly behind it."""
    likelihood: dict[Effects, float] = {
        k: c.best.log_likelihood for k, c in rough.found.items() if len(k) == 1
    }
    close = [k for k, found in likelihood.items() if found >= max(likelihood.values()) - _CLOSE]
    return sorted(close, key=lambda key: -likelihood[key])[:_SINGLES]


def _say_the_same(one: Candidate, other: Candidate) -> bool:
    return is_felt_alike(one, other) or is_felt_alike(other, one)


def _is_plainer(candidate: Candidate, leading: Sequence[Effects], rough: Hunt) -> bool:
    """Whether it says with fewer sizes what a leader says: it is to be there when one is named."""
    return any(is_felt_alike(rough.found[key], candidate) for key in leading)


def _with_baseline(keys: Sequence[Effects]) -> list[Effects]:
    return list(dict.fromkeys([*keys, ()]))
