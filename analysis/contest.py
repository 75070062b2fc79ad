"""The contest on all rows: more runs for whoever leads a search, and who is close to it.

Owns when a comparison is fair and when a leader has runs enough to be judged:
few runs rank by chance, predict badly and leave a shape of their own.
It tries no hypothesis that the search did not bring, but parts of a leader and what says the same
with fewer sizes, and passes no verdict.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.adequacy import judge_adequacy
from analysis.baseline_runs import level_baseline
from analysis.candidate import Candidate, Effects
from analysis.doubt import is_doubtful, is_given_up, is_nothing_missing, is_refused_now
from analysis.holdout import AT_NOISE, HeldOut, hold_out
from analysis.hunt import Hunt
from analysis.likeness import is_felt_alike, plainer_places
from analysis.parts import parts_of, places_of_parts
from analysis.plausibility import is_pressed

__all__ = [
    "CLOSE",
    "HOPELESS",
    "LAST_GROUPS",
    "TOO_FAR",
    "back_who_predicts",
    "call_back",
    "catch_up",
    "compare",
    "give_chances",
    "has_fewer",
    "look_at_every_ratio",
    "see_it_predict",
    "settle",
    "settle_doubt",
    "weigh_parts",
    "weigh_plainer",
]

_NEAR, CLOSE = 120.0, 30.0
_LAST_ROUNDS, LAST_GROUPS = ((4, _NEAR), (3, 60.0), (3, CLOSE), (3, CLOSE)), 6
"""Rounds in which the leader and those as close behind it as that log-likelihood are looked at
once more: at most so many, the parts of a leading pair and the baseline, in so many groups each.
Where none is close all but the first are spared.
"""

_IN_EARNEST = 2
"""Rounds after which it is believed that a set wants a size which no bench has; fewer runs may
only seem to say so."""

_ENOUGH = 320
"""Runs of a hypothesis from which on it gets no more to be compared by."""

_SOUND = 160
"""Runs of a leader before a search is left with it: few leave a shape of their own. A damped shaft
with more play led all else by hundreds, and left 4.4 of structure with 80 runs, 2.5 with 120."""

_CHANCES = 4
"""Hypotheses that are looked at once more where none fits yet."""

TOO_FAR, HOPELESS = 200.0, 300.0
"""Log-likelihood behind the leader from which the second and the third round leave one out, and the
last ones its parts, and from which there is no second chance."""

_PREDICTED, _NOT_PREDICTED, _MORE_ROUNDS, _ROUNDS_ALONE = (1.3, 1.0), 2.5, 4, 9
"""What a leader of one cause, or of several, misses of levels not fitted, in standard deviations,
from which it gets more runs (several are refused for less, `analysis.verdict`) and up to which
that may help; how many times, and how many where it leaves all others far behind: a pair with four
parameters took six rounds to be seen as the truth that it was."""

_JUMPED = 1.3
"""That with every reading, from which it gets more runs, until it is sound: none of few may have
gone over to the branch of a motion that was observed. Of 80 runs of a damped shaft none was quiet
there at two tenths below where 70 others were, and it missed three readings by 6 to 18."""

_BETTER, _BACKED, _ROUNDS_BACKED = 0.8, 2, 4
"""By what factor less one must miss of levels not fitted than a leader that is doubted, to get runs
beside it; how many, how often. A payload with friction lay 213 behind a light load with friction
and missed 0.78 for 1.37: the load got 700 runs, it 80, and was the truth."""

_ROUND, _ROUND_GROUPS, _MOVED = (1.0, 0.06), 4, 0.1
"""How far in ratio and sizes a leader that predicts worse than true causes do is looked at from
where it is, in how many groups, and by how much it is then elsewhere, and gets runs there: a brake
of four times a motor's friction was found at a ratio of 0.61, and hidden at 0.43."""

_THERE, _THERE_GROUPS = (0.1, 0.03), 12
"""How far about its place in a leading pair a part is looked at that is better at another ratio
alone, and in how many groups if it has many sizes, unless it is hopeless: there it has more runs.
Friction of a motor was hidden at 0.45, where pairs with it lay, and led itself by 40 runs there
with 240 at 0.77."""

_RUNNER_UP, _MANY_SIZES, _ON_RUNNERS_UP = 100.0, 5, 0.5
"""Log-likelihood behind several causes on few rows up to which who came next there, with so many
coordinates, is called back, and the share of the purse from which it is not. A payload with a soft
shaft lay 59 behind a payload with a heavier load on few rows, and 270 on all; from 947 with sixty
runs there it came to 1390 with 330, and the other from 1250."""

_PLAINER_BEHIND = 60.0
"""Log-likelihood behind a leader up to which a set that says the same with fewer sizes gets as many
runs: it was looked at where the leader is, which is not quite where it is best itself."""

_OPEN, _ROUNDS_OPEN, _OPEN_GROUPS = (1.0, 8.0), 4, (4, 4)
"""Structure between which a leader gets more runs, how many times, and in how many groups along
what agrees and about what is learned: either alone stays where its runs are. What the runs of a
true cause leave beside a sharp resonance goes with more of them, what a false one leaves stays or
grows: an amplifier's gain that was withheld left 1.9 as a motor's constant in 80 runs, in 240 2.0
to 4.1. Of 28 true ones two left more than the first; what leaves more than the second is settled.
"""


def compare(fine: Hunt, rng: np.random.Generator) -> bool:
    """Give whoever is compared with the leader as many runs: more runs fit better.

    Returns whether something is missing from the plain model.
    """
    missing = True
    for done, (most, behind) in enumerate(_LAST_ROUNDS):
        missing = not is_nothing_missing(fine, rng)
        if not missing and level_baseline(fine):
            missing = not is_nothing_missing(fine, rng)
        if not missing or _is_left(fine, rng):
            break
        first, *near = fine.leading(most, behind)
        # The parts of a pair count in every round, even where others lie before them: with few runs
        # a true cause of several parameters has been beaten by itself and another.
        parts = set(parts_of(first, fine.found))
        near += sorted(parts & set(fine.leading(len(fine.found), TOO_FAR)))
        leader, spent = first, fine.purse.is_spent
        if done >= _IN_EARNEST or (done and spent):
            # Who wants a size that no bench has is no explanation, however well it fits, and must
            # not keep one that is from runs that it lacks.
            plausible = [key for key in [first, *near] if not is_pressed(fine.found[key])]
            leader, *near = plausible or [first, *near]
            spent = fine.purse.is_spent if leader == first else fine.purse.is_overdrawn
            # Nor is it a question who leads of two that say the same.
            near = [key for key in near if not _say_the_same(fine.found[leader], fine.found[key])]
        if done and (spent or (leader == first and not near)):
            break
        near += [key for key in fine.leading(len(fine.found), behind) if not key]
        settle(fine, list(dict.fromkeys([leader, *near])))
    fine.hear()
    return missing


def _is_left(fine: Hunt, rng: np.random.Generator) -> bool:
    """Whether a search is left with no explanation; its leader first gets runs that can tell."""
    while is_given_up(fine, rng):
        if len(fine.best.population) >= _SOUND or fine.purse.is_overdrawn:
            return True
        settle(fine, [fine.best.hypothesis.effects])
    return False


def catch_up(
    fine: Hunt, newcomers: Collection[Effects], leader: Effects, behind: float = CLOSE
) -> None:
    """Give those that come close to a leader as many runs as it has, while they stay close.

    All others were compared with it before.
    """
    near = set(newcomers)
    while near := near & set(fine.leading(len(fine.found), behind)):
        near = {key for key in near if has_fewer(fine, key, leader)}
        settle(fine, sorted(near))


def has_fewer(fine: Hunt, key: Effects, other: Effects) -> bool:
    """Whether a hypothesis has fewer runs than another, and may still get some."""
    runs, enough = (len(fine.found[one].population) for one in (key, other))
    return runs < min(enough, _ENOUGH)


def settle(fine: Hunt, chosen: Sequence[Effects]) -> None:
    """Give those of some hypotheses that have few runs more of them."""
    few = [key for key in chosen if len(fine.found[key].population) < _ENOUGH]
    if few:
        fine.settle(few, LAST_GROUPS)


def give_chances(fine: Hunt) -> None:
    """Give those that lead more runs where none fits yet.

    Parameters trade off in ways that evenly placed runs miss.
    """
    leading = [key for key in fine.leading(len(fine.found), HOPELESS) if key]
    settle(fine, leading[:_CHANCES])


def back_who_predicts(fine: Hunt, rng: np.random.Generator) -> None:
    """Where the leader is doubted, give those more runs that predict better than it does.

    What has many sizes needs many runs to fit, and shows sooner that it carries over.
    """
    for _ in range(_ROUNDS_BACKED):
        leader = fine.best
        few = [
            key
            for key in fine.leading(len(fine.found), HOPELESS)[1:]
            if key and len(fine.found[key].population) < len(leader.population)
        ]
        if not leader.hypothesis.effects or not few:
            break
        enough = _BETTER * hold_out(leader, fine.observation).missed
        backed = [k for k in few if hold_out(fine.found[k], fine.observation).missed < enough]
        # Chance of its own: where nothing is backed all comes out as if it had not been asked.
        if not backed or not is_doubtful(leader, rng.spawn(1)[0]):
            break
        settle(fine, backed[:_BACKED])
        fine.hear()


def call_back(rough: Hunt, fine: Hunt, rng: np.random.Generator) -> None:
    """Give who did well on few rows the runs to be compared by on all.

    Three times the rows leave what has many sizes far behind, as few of its runs fit all of them.
    That is who led on few rows, where the leader would be refused; and where several causes lead
    there, too, who came next.
    """
    leader = fine.best.hypothesis.effects
    known = [key for key in rough.leading(len(rough.found)) if key in fine.found]
    first = next(iter(known), leader)
    runner_up = _runner_up(rough, fine, known) if first == leader else ()
    if runner_up:
        _settle_alone(fine, runner_up)
        # More runs fit better, so the other gets as many.
        catch_up(fine, [leader], runner_up, TOO_FAR)
    elif first and has_fewer(fine, first, leader) and not fine.purse.is_spent:
        # Chance of its own: where nobody is called back all comes out as if it was not asked.
        if not is_refused_now(fine, rng.spawn(1)[0]):
            return
        _settle_alone(fine, first, leader)
    if fine.best.hypothesis.effects != leader:
        fine.hear()
        compare(fine, rng)
        see_it_predict(fine)


def _runner_up(rough: Hunt, fine: Hunt, known: Collection[Effects]) -> Effects:
    """Who came next to several causes on few rows, if it has many sizes; none if much is spent."""
    leader = fine.best.hypothesis.effects
    if len(leader) < 2 or fine.purse.has_spent(_ON_RUNNERS_UP):
        return ()
    near = rough.leading(len(rough.found), _RUNNER_UP)
    many = [key for key in near if key in known and fine.found[key].hypothesis.d >= _MANY_SIZES]
    return next((key for key in many if key != leader), ())


def _settle_alone(fine: Hunt, key: Effects, leader: Effects | None = None) -> None:
    """Give one more runs, as many as a leader has, or as any gets."""
    for _ in range(_ROUNDS_ALONE):
        if fine.purse.is_spent or not (leader is None or has_fewer(fine, key, leader)):
            break
        settle(fine, [key])


def see_it_predict(fine: Hunt) -> None:
    """Give a leader, and who is close to it, more runs where it predicts badly: few runs do."""
    for done in range(_ROUNDS_ALONE):
        if not _is_to_predict_better(fine.best, hold_out(fine.best, fine.observation)):
            break
        if len(fine.leading(2, TOO_FAR)) == 1:
            fine.settle([fine.best.hypothesis.effects], LAST_GROUPS)
        elif done < _MORE_ROUNDS:
            settle(fine, [key for key in fine.leading(_CHANCES, CLOSE) if key])
        else:
            break
        fine.hear()


def _is_to_predict_better(leader: Candidate, held: HeldOut) -> bool:
    causes = len(leader.hypothesis.effects)
    if not causes or held.missed >= _NOT_PREDICTED:
        return False
    jumps = held.rms_sigma > _JUMPED and len(leader.population) < _SOUND
    return held.missed > _PREDICTED[causes > 1] or jumps


def look_at_every_ratio(fine: Hunt) -> None:
    """See whether a leader that predicts worse than true causes do has another ratio.

    It was found on few rows, and all of them may not bear that out; its runs lie about it.
    """
    leader, before = fine.best.hypothesis.effects, fine.best.best.place
    if not leader or hold_out(fine.best, fine.observation).missed <= AT_NOISE:
        return
    fine.start({leader: before}, _ROUND_GROUPS, reach=_ROUND)
    if abs(fine.found[leader].best.place[0] - before[0]) > _MOVED:
        fine.settle([leader], LAST_GROUPS)


def settle_doubt(fine: Hunt, rng: np.random.Generator) -> None:
    """Give a leader that may or may not leave structure more runs, and who is close to it."""
    least, most = _OPEN
    for _ in range(_ROUNDS_OPEN):
        leader, *near = fine.leading(_CHANCES, CLOSE)
        few = [k for k in (leader, *near) if len(fine.found[k].population) < _ENOUGH]
        if leader not in few or not least < judge_adequacy(fine.best, rng).structure < most:
            break
        along, around = _OPEN_GROUPS
        fine.look_closer(few, along)
        fine.settle(few, around)
        fine.hear()


def weigh_parts(fine: Hunt) -> None:
    """See what the causes of a leading pair do alone where it has them, with runs enough.

    A resonance that had been looked at elsewhere lay 300 behind itself and a brake it has not, and
    friction that another sort of friction stood for was not looked at alone at all.
    """
    leader = fine.best
    if len(leader.hypothesis.effects) < 2:
        return
    parts, hopeful = places_of_parts(leader), fine.leading(len(fine.found), HOPELESS)
    elsewhere = {
        part: place
        for part, place in parts.items()
        if part in hopeful and abs(fine.found[part].best.place[0] - place[0]) > _MOVED
    }
    few = {
        part: place
        for part, place in parts.items()
        if part not in elsewhere and _is_open(fine, part, place, part in hopeful)
    }
    if few or elsewhere:
        fine.start(few, LAST_GROUPS)
        fine.start(elsewhere, LAST_GROUPS, _THERE_GROUPS, reach=_THERE)
        hopeful = fine.leading(len(fine.found), TOO_FAR)
        fine.settle([key for key in hopeful if key in few or key in elsewhere], LAST_GROUPS)
        fine.hear()


def weigh_plainer(fine: Hunt, without: Collection[str]) -> None:
    """See whether a set of fewer sizes that says the same as the leader does as well, if any does.

    What few rows had left out is looked at, and others get runs, as nobody compared them: a heavier
    load beside a damped shaft was named as a payload that is stiffer than all that was measured.
    `without`: effects that are not to be known.
    """
    leader, places = fine.best.hypothesis.effects, plainer_places(fine.best, without)
    elsewhere = {
        key: place
        for key, place in places.items()
        if key not in fine.found or not _is_at(fine.found[key], place)
    }
    if elsewhere:
        fine.start(elsewhere, LAST_GROUPS)
        # Where the leader is is not quite where it is best itself, and few runs tell neither.
        settle(fine, [key for key in fine.leading(len(fine.found), HOPELESS) if key in elsewhere])
        fine.hear()
    catch_up(fine, places, leader, _PLAINER_BEHIND)


def _is_open(fine: Hunt, part: Effects, place: NDArray[np.float64], hopeful: bool) -> bool:
    """Whether what a part does at a place (d,) is not known yet, or not by enough runs."""
    if part not in fine.found:
        return True
    known = fine.found[part]
    few = len(known.population) <= len(fine.best.population)
    return few and (hopeful or not _is_at(known, place))


def _is_at(one: Candidate, place: NDArray[np.float64]) -> bool:
    """Whether a candidate is best about a place (d,)."""
    return bool(np.all(abs(one.best.place - place) <= _MOVED))


def _say_the_same(one: Candidate, other: Candidate) -> bool:
    return is_felt_alike(one, other) or is_felt_alike(other, one)
