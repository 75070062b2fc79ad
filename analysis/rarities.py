"""Causes that nobody would suspect first, held against whatever leads a search.

Owns which of them are worth simulating. A cause that a search does not know is
blamed on one that it does, and nothing in the fit tells: the least that can be
done is to hold the rare ones against a leader before it is named. It runs the
simulations through a hunt and passes no verdict.
"""

from __future__ import annotations

from analysis.atlas import Atlas
from analysis.candidate import Effects
from analysis.hunt import Hunt
from analysis.screening import ranked, screen_singles

__all__ = ["look_at_rare"]

_MOST, _GROUPS = 2, (6, 6)
"""How many rare causes are simulated, and in how many groups at first and when looked at closer."""

_NEAR, _CLOSE = 150.0, 60.0
"""Log-likelihood behind the leader from which one is not simulated, as seen by the coarse look,
which is rough, and from which it is left out after it was."""


def look_at_rare(rough: Hunt, fine: Hunt, atlas: Atlas) -> list[Effects]:
    """Simulate the most likely rare causes on few rows; those that may stand for the leader.

    Parameters
    ----------
    rough, fine
        Hunts on few and on all rows; the second one's leader is what they are held against.
    atlas
        Of rare causes alone, on the rows of `rough`.
    """
    leader = fine.best.hypothesis.effects
    if not atlas:
        return []
    places = screen_singles(rough.unit, rough.observation, atlas)
    if leader not in rough.found:
        rough.start({leader: fine.best.best.place}, _GROUPS[0])
    at_least = rough.found[leader].best.log_likelihood
    chosen = [k for k in ranked(places)[:_MOST] if places[k].log_likelihood > at_least - _NEAR]
    if not chosen:
        return []
    rough.start({key: places[key].place for key in chosen}, _GROUPS[0])
    rough.look_closer(chosen, _GROUPS[1])
    at_least = rough.found[leader].best.log_likelihood - _CLOSE
    return [k for k in rough.among(chosen) if rough.found[k].best.log_likelihood > at_least]
