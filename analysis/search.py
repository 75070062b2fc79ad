"""The search for what a model lacks: from every cause to a few that are looked at closely.

Owns which hypotheses are simulated: an atlas of every single cause, then
rounds with fewer and fewer of them, and pairs where no single cause will do.
It compares hypotheses to decide where to look next, and passes no verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.adequacy import judge_adequacy, judge_chance
from analysis.atlas import Atlas, coarse_stride, make_atlas
from analysis.candidate import Candidate, Effects, form_candidates
from analysis.causes import Hypothesis
from analysis.executor import Executor
from analysis.holdout import hold_out
from analysis.observation import Observation
from analysis.placement import groups_about, groups_along, groups_around
from analysis.population import Group, Population, simulate_groups
from analysis.progress import Progress, part_of
from analysis.reading_noise import likeliest_noise, possible_noises
from analysis.screening import screen_pairs, screen_singles
from analysis.sizing import size_candidate
from sim.unit import Unit

__all__ = ["search_causes"]

_FIRST, _FIRST_GROUPS = 9, 2
_SECOND, _SECOND_GROUPS = 5, 4
_PARENTS, _PAIRS, _PAIR_GROUPS = 8, 5, 4
_THIRD, _THIRD_GROUPS = 4, 4
"""How many hypotheses are looked at in each round, and in how many groups of runs each."""

_CLOSE = 30.0
_LAST_ROUNDS, _LAST_GROUPS = ((4, 120.0), (3, 60.0), (3, _CLOSE), (3, _CLOSE)), 4
"""Rounds in which the leader and those as close behind it as that log-likelihood are looked at
once more: at most so many, and the baseline, in so many groups each. Where none is close the
last two are spared.
"""

_CHANCES = 4
"""Hypotheses that are looked at once more where none fits yet."""

_TOO_FAR, _HOPELESS = 200.0, 300.0
"""Log-likelihood behind the leader from which the third round leaves one out, and from which
there is no second chance."""

_DOUBT = 2.0
"""Misfit of the best single cause, in standard deviations, from which pairs are tried; and the
root mean square of what it misses of levels not fitted, in theirs: where few runs of its own fit
each other the first is blind, and the second is not."""

_COMMON = 0.2
"""Share of the baseline's own runs that the leader explains better by as much, from which on there
is nothing to be found, and nothing more is simulated."""


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
    rough = _Hunt(unit, coarse, rng, executor, part_of(progress, 0.4, 0.6, "narrowing down"))
    rough.start(_singles(coarse, atlas), _FIRST_GROUPS)
    rough.hear()
    rough.look_closer(_with_baseline(rough.leading(_SECOND)), _SECOND_GROUPS)
    rough.hear()
    if _is_doubtful(rough.best, rng):
        # A cause with several parameters may only want a closer look.
        rough.settle([rough.best.hypothesis.effects], _LAST_GROUPS)
    doubted = _is_doubtful(rough.best, rng)
    if doubted:
        rough.start(_pairs(rough.observation, atlas, rough), _PAIR_GROUPS)
        rough.hear()
    fine = _Hunt(
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
        if not doubted and _is_doubtful(fine.best, rng):
            # More rows, or more runs, show that a single cause will not do after all.
            doubted = True
            rough.start(_pairs(rough.observation, atlas, rough), _PAIR_GROUPS)
            pairs = [key for key in _third(rough) if key not in fine.found]
            fine.take_over([rough.found[key] for key in pairs], _THIRD_GROUPS)
            fine.hear()
        if _is_doubtful(fine.best, rng):
            # Parameters trade off in ways that evenly placed runs miss: a second chance.
            leading = [key for key in fine.leading(len(fine.found), _HOPELESS) if key]
            fine.settle(leading[:_CHANCES], _LAST_GROUPS)
        _compare(fine, rng)
        if doubted or not _is_doubtful(fine.best, rng):
            return sorted(fine.found.values(), key=lambda c: -c.best.log_likelihood)


def _compare(fine: _Hunt, rng: np.random.Generator) -> None:
    """Give whoever is compared with the leader as many runs: more runs fit better."""
    for most, behind in _LAST_ROUNDS:
        if _is_nothing_missing(fine, rng):
            break
        leader, *near = fine.leading(most, behind)
        if behind == _CLOSE and not near:
            break
        # The parts of a pair and the plain model count even where others lie before them.
        close = set(fine.leading(len(fine.found), behind))
        near += [key for key in (*_parts(leader, fine.found), ()) if key in close]
        fine.settle(list(dict.fromkeys([leader, *near])), _LAST_GROUPS)
    fine.hear()


_Starts = Mapping[Effects, NDArray[np.float64]]


def _singles(coarse: Observation, atlas: Atlas) -> _Starts:
    """Best places of the single causes that the atlas favours, and of the baseline."""
    places = screen_singles(coarse, atlas)
    ranked = sorted(places, key=lambda key: -places[key].log_likelihood)
    return {key: places[key].place for key in _with_baseline(ranked[:_FIRST])}


def _pairs(coarse: Observation, atlas: Atlas, rough: _Hunt) -> _Starts:
    """Best places of the pairs that the atlas favours, a leading single cause in each."""
    leading = rough.leading(_PARENTS)
    parents: dict[Effects, Candidate] = {k: rough.found[k] for k in leading if len(k) == 1}
    places = screen_pairs(coarse, atlas, parents)
    ranked = sorted(places, key=lambda key: -places[key].log_likelihood)
    return {key: places[key].place for key in ranked[:_PAIRS]}


def _is_doubtful(candidate: Candidate, rng: np.random.Generator) -> bool:
    if judge_adequacy(candidate, rng).sigma > _DOUBT:
        return True
    return hold_out(candidate, candidate.surface.observation).rms_sigma > _DOUBT


def _is_nothing_missing(fine: _Hunt, rng: np.random.Generator) -> bool:
    baseline = fine.found[()]
    if _is_doubtful(baseline, rng):
        return False
    return fine.best is baseline or judge_chance(baseline, fine.best, rng) > _COMMON


def _third(rough: _Hunt) -> list[Effects]:
    """Who is looked at on all rows: the leaders, the parts of the first, and the baseline."""
    leading = rough.leading(_THIRD, _TOO_FAR)
    others = [*_parts(leading[0], rough.found), rough.best_single]
    hopeful = set(rough.leading(len(rough.found), _HOPELESS))
    return _with_baseline([*leading, *(key for key in others if key in hopeful)])


def _parts(key: Effects, found: Mapping[Effects, Candidate]) -> list[Effects]:
    """The causes that a pair is made of, each for itself, as far as they were looked at."""
    return [(effect,) for effect in key if len(key) > 1 and (effect,) in found]


def _with_baseline(keys: Sequence[Effects]) -> list[Effects]:
    return list(dict.fromkeys([*keys, ()]))


class _Hunt:
    """Candidates on the rows of one observation, and the runs made for them so far."""

    def __init__(
        self,
        unit: Unit,
        observation: Observation,
        rng: np.random.Generator,
        executor: Executor | None,
        progress: Callable[[float], None] | None,
        noise_v: float | None = None,
    ) -> None:
        heard = observation if noise_v is None else observation.with_noise(noise_v)
        self._unit, self.observation, self._rng = unit, heard, rng
        self._noises = possible_noises(observation)
        self._executor, self._progress, self._left = executor, progress, 1.0
        self._runs: dict[Effects, Population] = {}
        self.found: dict[Effects, Candidate] = {}

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

    def start(self, places: _Starts, groups: int) -> None:
        """Simulate hypotheses about places."""
        self._simulate(
            [
                group
                for key, place in places.items()
                for group in groups_about(Hypothesis(self._unit, key), place, groups, self._rng)
            ]
        )
        self._form(places)

    def take_over(self, candidates: Sequence[Candidate], groups: int) -> None:
        """Simulate candidates that were formed on other rows."""
        self._simulate([g for c in candidates for g in groups_along(c, groups, self._rng)])
        self._form({c.hypothesis.effects: c.best.place for c in candidates})

    def settle(self, chosen: Sequence[Effects], groups: int) -> None:
        """Simulate more of some candidates, about what their runs tell of their parameters."""
        found = [self.found[key] for key in chosen]
        self._simulate(
            [
                group
                for c in found
                for group in groups_around(
                    c.hypothesis, size_candidate(c, self.observation, self._rng), groups, self._rng
                )
            ]
        )
        self._form({key: self.found[key].best.place for key in chosen})

    def hear(self) -> None:
        """Take the reading for as noisy as the most likely candidate would have it."""
        best = self.best
        key = best.hypothesis.effects

        def likelihood(seen: Observation) -> float:
            starts, runs = {key: best.best.place}, {key: self._runs[key]}
            return form_candidates(self._unit, seen, runs, starts)[key].best.log_likelihood

        heard = likeliest_noise(self._noises, likelihood)
        if heard.noise_v != self.observation.noise_v:
            self.observation = heard
            self._form({effects: c.best.place for effects, c in self.found.items()})

    def look_closer(self, chosen: Sequence[Effects], groups: int) -> None:
        """Simulate more of some candidates, along the places that agree."""
        self.take_over([self.found[key] for key in chosen], groups)

    def _simulate(self, groups: Sequence[Group]) -> None:
        made = simulate_groups(
            self._unit, groups, self.observation, self._rng, self._executor, self._report()
        )
        for key, population in made.items():
            known = self._runs.get(key)
            self._runs[key] = population if known is None else known.joined(population)

    def _form(self, starts: _Starts) -> None:
        runs = {key: self._runs[key] for key in starts}
        self.found |= form_candidates(self._unit, self.observation, runs, starts)

    def _report(self) -> Callable[[float], None] | None:
        """Half of what is left of the bar, as nobody knows how many rounds are to come."""
        if self._progress is None:
            return None
        progress, begin = self._progress, 1.0 - self._left
        self._left *= 0.5
        half = self._left
        return lambda share: progress(begin + half * share)
