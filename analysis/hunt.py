"""A hunt: the candidates on the rows of one observation, and all runs made for them so far.

Owns the bookkeeping of a search: what was simulated for which hypothesis, the
candidates that it gives, and the reading noise that they are held against. It
does not decide what to look at.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.candidate import Candidate, Effects, form_candidates
from analysis.causes import Hypothesis
from analysis.executor import Executor
from analysis.observation import Observation
from analysis.placement import (
    Reach,
    groups_about,
    groups_along,
    groups_around,
    groups_beside,
)
from analysis.population import Group, Population, simulate_groups
from analysis.purse import Purse
from analysis.reading_noise import likeliest_noise, possible_noises
from analysis.sizing import size_candidate
from sim.unit import Unit

__all__ = ["Hunt", "Starts"]

Starts = Mapping[Effects, NDArray[np.float64]]
"""Places (d,) from which hypotheses are looked at."""


_MANY = 4
"""Coordinates from which on a first look takes more groups, as two are a line in a room, and half
of further runs of several causes lie along the places that agree."""

_TRIES = 3
"""Steps of a climb with another noise, where it begins at the best place with the last one."""


class Hunt:
    """Candidates on the rows of one observation, and the runs made for them so far.

    `spared`: whether something that is worth a look was not looked at, for what is left of the
    purse.
    """

    def __init__(
        self,
        unit: Unit,
        observation: Observation,
        rng: np.random.Generator,
        executor: Executor | None,
        progress: Callable[[float], None] | None,
        noise_v: float | None = None,
        purse: Purse | None = None,
    ) -> None:
        heard = observation if noise_v is None else observation.with_noise(noise_v)
        self.unit, self.observation, self._rng = unit, heard, rng
        self._noises = possible_noises(observation)
        self._executor, self._progress, self._left = executor, progress, 1.0
        self.purse = Purse() if purse is None else purse
        self._runs: dict[Effects, Population] = {}
        self.found: dict[Effects, Candidate] = {}
        self.spared = False

    @property
    def best(self) -> Candidate:
        """The most likely candidate."""
        return max(self.found.values(), key=lambda c: c.best.log_likelihood)

    @property
    def best_single(self) -> Effects:
        """The most likely single cause."""
        single: list[Effects] = [key for key in self.found if len(key) == 1]
        return max(single, key=lambda key: self.found[key].best.log_likelihood)

    def leading(self, most: int, behind: float = np.inf) -> list[Effects]:
        """The most likely hypotheses, none too far behind the first."""
        likelihood = {key: c.best.log_likelihood for key, c in self.found.items()}
        ranked = sorted(likelihood, key=lambda key: -likelihood[key])
        return [k for k in ranked[:most] if likelihood[k] >= likelihood[ranked[0]] - behind]

    def among(self, keys: Collection[Effects]) -> list[Effects]:
        """Those of some hypotheses that were simulated, the most likely first."""
        return [key for key in self.leading(len(self.found)) if key in keys]

    def thinned(self, stride: int) -> Hunt:
        """A hunt on every so manieth of the frequencies, with nothing simulated yet."""
        few, noise_v = self.observation.thinned(stride), self.observation.noise_v
        return Hunt(self.unit, few, self._rng, self._executor, self.report(), noise_v)

    def start(
        self,
        places: Starts,
        groups: int,
        of_many: int = 0,
        *,
        reach: Reach | Mapping[Effects, Reach] | None = None,
    ) -> None:
        """Simulate hypotheses about places, or more of them than before about other places.

        In so many groups each; in `of_many`, if more, those with many coordinates. `reach`: how far
        about them, of all or of each, if that is known.
        """
        wanted: list[Group] = []
        for key, place in places.items():
            count = max(groups, of_many if len(place) >= _MANY else 0)
            own = reach[key] if isinstance(reach, Mapping) else reach
            wanted += groups_about(Hypothesis(self.unit, key), place, count, self._rng, own)
        self._simulate(wanted)
        known = {key: self.found[key].best.place for key in places if key in self.found}
        self._form({**places, **known})
        for key in known:
            one = self.found[key]
            there = one.surface.climb(places[key])
            if there.log_likelihood > one.best.log_likelihood:
                self.found[key] = replace(one, best=there)

    def beside(
        self, known: Hypothesis, place: NDArray[np.float64], further: Sequence[Hypothesis]
    ) -> dict[Effects, Population]:
        """Runs of known causes at a place (d,) with one more at a few sizes; none is kept."""
        rng, band_hz = self._rng, self.observation.frequency_hz
        return self._made(
            [g for one in further for g in groups_beside(known, place, one, band_hz, rng)]
        )

    def take_over(self, candidates: Sequence[Candidate], groups: int) -> None:
        """Simulate candidates that were formed on other rows."""
        self._simulate([g for c in candidates for g in groups_along(c, groups, self._rng)])
        self._form({c.hypothesis.effects: c.best.place for c in candidates})

    def settle(self, chosen: Sequence[Effects], groups: int) -> None:
        """Simulate more of some candidates, about what their runs tell of their parameters."""
        more: list[Group] = []
        for c in (self.found[key] for key in chosen):
            # What is learned of many parameters is far wider than a resonance is sharp. Of one
            # cause it tells more than what agrees, which tends to lie where the runs do.
            several = len(c.hypothesis.effects) > 1
            along = groups // 2 if several and c.hypothesis.d >= _MANY else 0
            learned = size_candidate(c, self.observation, self._rng)
            more += groups_around(c.hypothesis, learned, groups - along, self._rng)
            more += groups_along(c, along, self._rng)
        self._simulate(more)
        self._form({key: self.found[key].best.place for key in chosen})

    def leave_out(self, keys: Collection[Effects]) -> None:
        """Look at some candidates no more."""
        for key in keys:
            del self.found[key]

    def hear(self) -> None:
        """Take the reading for as noisy as the most likely candidate would have it."""
        best = self.best
        key = best.hypothesis.effects

        def likelihood(seen: Observation) -> float:
            starts, runs = {key: best.best.place}, {key: self._runs[key]}
            formed = form_candidates(self.unit, seen, runs, starts, _TRIES)
            return formed[key].best.log_likelihood

        heard = likeliest_noise(self._noises, likelihood)
        if heard.noise_v != self.observation.noise_v:
            self.observation = heard
            self._form({effects: c.best.place for effects, c in self.found.items()})

    def look_closer(self, chosen: Sequence[Effects], groups: int) -> None:
        """Simulate more of some candidates, along the places that agree."""
        self.take_over([self.found[key] for key in chosen], groups)

    def _simulate(self, groups: Sequence[Group]) -> None:
        for key, population in self._made(groups).items():
            known = self._runs.get(key)
            self._runs[key] = population if known is None else known.joined(population)

    def _made(self, groups: Sequence[Group]) -> dict[Effects, Population]:
        return simulate_groups(
            self.unit, groups, self.observation, self._rng, self._executor, self.report()
        )

    def _form(self, starts: Starts) -> None:
        runs = {key: self._runs[key] for key in starts}
        self.found |= form_candidates(self.unit, self.observation, runs, starts)

    def report(self) -> Callable[[float], None] | None:
        """What is told the share of further work: half of what is left of the bar.

        Nobody knows how many rounds are to come.
        """
        if self._progress is None:
            return None
        progress, begin = self._progress, 1.0 - self._left
        self._left *= 0.5
        half = self._left
        return lambda share: progress(begin + half * share)
