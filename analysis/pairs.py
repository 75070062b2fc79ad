"""The search for pairs: from all that an atlas favours to the few that are worth all rows.

Owns which pairs are simulated where no single cause will do, and how the one
that leads them is held against others with one of its causes.
It leaves what it found in the hunt, and does not tell whether a pair is called for.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from analysis.atlas import Atlas, coarse_stride
from analysis.beside import place_beside
from analysis.candidate import Candidate, Effects
from analysis.doubt import is_doubtful
from analysis.hunt import Hunt, Starts
from analysis.lending import leads_with_lent
from analysis.parts import earns, parts_of, places_of_parts
from analysis.screening import (
    Additions,
    Place,
    add_causes,
    near,
    ranked,
    screen_pairs,
)

__all__ = [
    "BESIDE_REACH",
    "at_few_frequencies",
    "look_at_felt",
    "look_at_parts",
    "look_beside",
    "look_beside_all",
    "look_closer_beside",
    "search_pairs",
]

_PAIRS, _PARTNERS, _GLANCE_FREQUENCIES, _GLANCE_GROUPS = 10, 5, 10, 4
_GLANCED, _AFTER, _GROUPS = 10, 5, (4, 6)
"""Pairs that the atlas favours, and more of those with the leader in them; at how many frequencies
they are simulated at first, and in how many groups; how many are looked at closer, twice. What
two causes do together is seldom the sum of what each does, and few runs rank them by chance. Of
21 true pairs seventeen stood among the first eight by that sum."""

_FELT_GROUPS = (4, 4, 4)
"""Groups of each look at a pair that is placed by what the load is felt as: ever closer ones told a
true one from a cable alone, as many runs about the first place did not."""

_HOPELESS, _BESIDE_GROUPS, BESIDE_REACH = 100.0, 4, (0.12, 0.03)
"""Log-likelihood at few frequencies behind the likeliest, from which on nobody looks at another
beside a cause of the leading pair; true ones lay up to 75 behind. In how many groups the rest are
looked at, and how far about their places, which are known well: what sizes further off do would
have to be told apart by too few runs, and ranked them by chance."""

_FOLLOWED, _EDGE = 2, 0.03
"""How often one that agrees best at the end of the ratios it was looked at is looked at once more
about there, and how near to that end. A weak amplifier alone was best at a ratio of 0.17; with
damped teeth, placed at 0.3 and hidden at 0.52, it went from 65 to 258 in two steps, and alone."""

_BESIDE, _AT_ONCE = 18, 6
"""How many are looked at beside what is known, and how many before the purse is asked again: of 28
true pairs none was placed farther back than twelfth."""

_CLOSER, _MOST_CLOSER, _AS_GOOD = 6, 14, 40.0
"""How many of them are looked at closer at least, and at most of those that are no farther behind
the best: twenty runs rank by chance. Damped teeth with a soft shaft stood thirteenth, 33 behind,
and led by 39 with forty runs more."""

_LENT_MOST, _LENT = 3, 5.0
"""How many beside each known cause are looked at closer, too, by how they stand with its runs lent
to them (`analysis.lending`), and what they lead it by then. A stiff shaft beside friction at rest
stood twelfth by its own twenty runs, which no others fit, and third so, ahead by 9."""

_STRANGER = 60.0
"""Log-likelihood behind a leading pair in doubt within which others are also looked at beside the
causes of one that shares none with it, or behind a single cause, beside another. A motor's constant
led an amplifier's gain by 50; with a tachometer's gain beside it the amplifier led by 80."""

_PREDICTED = 1.3
"""What a leading pair misses of levels not fitted, in standard deviations, from which on it is in
doubt here: one that missed 1.9 was not the truth, though it looked like its own runs."""

_FAR_AHEAD = 200.0
"""Log-likelihood by which a single cause leads all others where it is in any pair that is true: of
21 pairs seven had one that did, and it was one of the two each time."""

_ON_PAIRS = 0.75
"""Share of what may be simulated from which on nobody looks at more beside the causes of leading
pairs: those that lead are to be compared on all rows for the rest."""


def search_pairs(rough: Hunt, atlas: Atlas, rng: np.random.Generator) -> None:
    """Look at the pairs that the atlas favours, ever fewer of them ever closer.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    additions = add_causes(rough.unit, rough.observation, atlas)
    places = screen_pairs(additions)
    favoured = ranked(places)
    if not favoured:
        return
    partners = [key for key in favoured if rough.best_single[0] in key]
    chosen = dict.fromkeys([*favoured[:_PAIRS], *partners[:_PARTNERS]])
    felt = {key: places[key] for key in additions.felt}
    glanced_at = {key: places[key] for key in chosen if key not in felt}
    rough.take_over(_glance(rough, glanced_at, _GLANCED), _GROUPS[0])
    # What adds up exactly is placed too well for a glance, and is likely by another measure.
    felt = near(felt, max((one.log_likelihood for one in felt.values()), default=0.0))
    look_at_felt(rough, felt)
    looked_at = set(rough.among([*glanced_at, *felt])[:_AFTER])
    rough.look_closer(sorted(looked_at), _GROUPS[1])
    _hold_against_neighbours(rough, atlas, additions, looked_at, rng)


def look_at_felt(rough: Hunt, places: Mapping[Effects, Place]) -> None:
    """Look ever closer at pairs that are placed by what the load is felt as."""
    rough.start({key: one.place for key, one in places.items()}, _FELT_GROUPS[0])
    for groups in _FELT_GROUPS[1:]:
        rough.look_closer(list(places), groups)


def at_few_frequencies(rough: Hunt) -> Hunt:
    """A hunt on so few rows of a rough one's that many sets can be glanced at."""
    return rough.thinned(coarse_stride(rough.observation, _GLANCE_FREQUENCIES))


def look_beside(rough: Hunt, places: Starts) -> None:
    """Look at sets with one cause more than known ones about their places, which are known well.

    But for the ratio, which a further cause may move: who agrees best at the end of those looked at
    is followed.
    """
    rough.start(places, _BESIDE_GROUPS, reach=BESIDE_REACH)
    for _ in range(_FOLLOWED):
        places = {k: rough.found[k].best.place for k in places if _is_at_an_end(rough.found[k])}
        if not places:
            break
        rough.start(places, _BESIDE_GROUPS, reach=BESIDE_REACH)


def look_closer_beside(rough: Hunt, keys: Collection[Effects]) -> None:
    """Look at some of these once more, farther about, so that slopes can be told."""
    rough.start({key: rough.found[key].best.place for key in keys}, _GROUPS[1])


def _is_at_an_end(one: Candidate) -> bool:
    """Whether the best ratio is about the least or the largest of its runs, and no ratio's end."""
    ratios, best = one.surface.places[:, 0], one.best.place[0]
    ends = [end for end in (ratios.min(), ratios.max()) if _EDGE < end < 1.0 - _EDGE]
    return any(abs(best - end) < _EDGE for end in ends)


def _hold_against_neighbours(
    rough: Hunt,
    atlas: Atlas,
    additions: Additions,
    looked_at: set[Effects],
    rng: np.random.Generator,
) -> None:
    """Look at others with a cause of the leading pair: true pairs nearly all share one with it.

    Where that is doubted and one that shares none is close behind, at others with a cause of that
    one, too.
    """
    leader = rough.among(looked_at)[0]
    held = [leader]
    # Chance of its own: where nobody asks all comes out as if it had not been asked.
    if (stranger := _close_stranger(rough, leader, looked_at)) and is_doubtful(
        rough.found[leader], rng.spawn(1)[0], _PREDICTED
    ):
        held += stranger
    for pair in held:
        look_at_parts(rough, pair)
    if additions.coarse is not rough.observation:
        # Another reading noise was heard since.
        additions = add_causes(rough.unit, rough.observation, atlas)
    kept = {part: place for pair in held for part, place in _kept(rough, pair).items()}
    now = rough.among(looked_at | look_beside_all(rough, additions, kept))[0]
    if now not in held:
        look_at_parts(rough, now)


def _close_stranger(rough: Hunt, leader: Effects, looked_at: set[Effects]) -> list[Effects]:
    """The likeliest pair that shares no cause with the leader, if it is not far behind."""
    strangers = [key for key in rough.among(looked_at) if not set(key) & set(leader)]
    least = rough.found[leader].best.log_likelihood - _STRANGER
    return [key for key in strangers[:1] if rough.found[key].best.log_likelihood > least]


def _kept(rough: Hunt, leader: Effects) -> Starts:
    """The causes of a leading pair where it has them.

    If one does as well alone, that and the single cause next to it, if it is close: a weak motor
    may stand for a weak amplifier with something else, which few runs of both do not show.
    """
    if earns(leader, rough.found):
        places = places_of_parts(rough.found[leader])
        return {part: places[part] for part in _undisputed(rough) if part in places} or places
    alone = rough.among(parts_of(leader, rough.found))[0]
    least = rough.found[alone].best.log_likelihood - _STRANGER
    singles = [key for key in rough.leading(len(rough.found)) if len(key) == 1 and key != alone]
    close = [key for key in singles[:1] if rough.found[key].best.log_likelihood > least]
    return {key: rough.found[key].best.place for key in [alone, *close]}


def _undisputed(rough: Hunt) -> list[Effects]:
    """The best single cause, if it is far ahead of all others."""
    best = rough.best_single
    least = rough.found[best].best.log_likelihood - _FAR_AHEAD
    singles = [key for key in rough.found if len(key) == 1]
    near = [key for key in singles if rough.found[key].best.log_likelihood > least]
    return [best] if near == [best] else []


def look_at_parts(rough: Hunt, leader: Effects) -> None:
    """Simulate the causes of a pair alone where it has them: either may do as well there."""
    rough.start(places_of_parts(rough.found[leader]), _GROUPS[1])
    rough.hear()


def look_beside_all(rough: Hunt, additions: Additions, kept: Starts) -> set[Effects]:
    """Look at all others beside what is kept of leading pairs; those that are worth it closer.

    The likeliest first, a few whatever was spent, and others while enough is left of the purse.
    """
    few, placed, others = at_few_frequencies(rough), dict[Effects, Place](), dict[Effects, Place]()
    for part, place in kept.items():
        for key, one in place_beside(few, additions, rough.found[part].hypothesis, place).items():
            # A pair may be placed beside either of its causes, at another ratio each.
            if key in placed:
                placed[key], others[key] = sorted((one, placed[key]), key=_likelihood, reverse=True)
            else:
                placed[key] = one
    least = max(map(_likelihood, placed.values())) - _HOPELESS
    worth = [key for key in ranked(placed)[:_BESIDE] if _likelihood(placed[key]) > least]
    looked_at: list[Effects] = []
    while worth and not (looked_at and rough.purse.has_spent(_ON_PAIRS)):
        some, worth = worth[:_AT_ONCE], worth[_AT_ONCE:]
        for places in (placed, others):
            if now := {key: places[key].place for key in some if key in places}:
                look_beside(rough, now)
        looked_at += some
    rough.spared |= bool(worth)
    leading = rough.among(looked_at)[:_MOST_CLOSER]
    least = rough.found[leading[0]].best.log_likelihood - _AS_GOOD
    as_good = [key for key in leading if rough.found[key].best.log_likelihood > least]
    closer = leading[: max(_CLOSER, len(as_good))]
    closer += _hopeful(rough, additions, kept, looked_at, closer)
    look_closer_beside(rough, closer)
    rough.hear()
    return set(closer)


def _hopeful(
    rough: Hunt,
    additions: Additions,
    kept: Starts,
    looked_at: Collection[Effects],
    closer: Collection[Effects],
) -> list[Effects]:
    """Who leads one of its causes most with the runs of that lent to it, and has too few itself."""
    found = list[Effects]()
    for part in kept:
        beside = [key for key in looked_at if set(key) > set(part)]
        leads = leads_with_lent(rough, additions, part, beside)
        likely = sorted((key for key in beside if leads[key] > _LENT), key=lambda key: -leads[key])
        found += [key for key in likely[:_LENT_MOST] if key not in closer and key not in found]
    return found


def _likelihood(place: Place) -> float:
    return place.log_likelihood


def _glance(rough: Hunt, places: dict[Effects, Place], most: int) -> list[Candidate]:
    """The most likely of some pairs by a few runs at few frequencies."""
    few = at_few_frequencies(rough)
    few.start({key: one.place for key, one in places.items()}, _GLANCE_GROUPS)
    # Adding up decides between two ratios by chance (docs/decisions/0033).
    others = {key: one.other for key, one in places.items() if one.other is not None}
    few.start(others, _GLANCE_GROUPS)
    return [few.found[key] for key in few.leading(most)]
