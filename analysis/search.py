"""The search for what a model lacks: from every cause to a few that are looked at closely.

Owns which hypotheses are simulated: an atlas of every single cause, then
rounds with fewer and fewer of them, and pairs where no single cause will do.
It compares hypotheses to decide where to look next, and passes no verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path

import numpy as np

from analysis.adequacy import judge_adequacy
from analysis.atlas import Atlas, coarse_stride, make_atlas
from analysis.candidate import Candidate, Effects, form_candidates
from analysis.causes import Hypothesis
from analysis.observation import Observation
from analysis.placement import groups_about, groups_along
from analysis.population import Group, Population, simulate_groups
from analysis.screening import screen_pairs, screen_singles
from sim.unit import Unit

__all__ = ["search_causes"]

Progress = Callable[[float, str], None]

_FIRST, _FIRST_GROUPS = 9, 2
_ROUNDS = ((5, 3), (3, 4), (2, 5))
"""How many hypotheses are looked at closely, and in how many groups each, round after round."""

_PARENTS, _PAIRS, _PAIR_GROUPS = 4, 5, 3
_DOUBT = 1.5
"""Misfit of the best single cause, in standard deviations, from which pairs are tried."""


def search_causes(
    unit: Unit,
    observation: Observation,
    *,
    without: Collection[str] = (),
    cache: Path | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[Candidate]:
    """Candidates, the most likely first; the baseline is always among them.

    Parameters
    ----------
    without
        Effects of the catalogue that are left out, for studies of what happens
        when the cause is unknown.
    cache
        Folder in which atlases are kept.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    hunt = _Hunt(unit, observation, without, cache, seed, progress)
    hunt.look_at_singles()
    hunt.look_closer(*_ROUNDS[0], until=0.7)
    if hunt.doubtful():
        hunt.look_at_pairs()
    hunt.look_closer(*_ROUNDS[1], until=0.9)
    hunt.look_closer(*_ROUNDS[2], until=1.0)
    return sorted(hunt.found.values(), key=lambda c: -c.best.log_likelihood)


class _Hunt:
    """One search under way: the runs made so far and the candidates formed of them."""

    def __init__(
        self,
        unit: Unit,
        observation: Observation,
        without: Collection[str],
        cache: Path | None,
        seed: int,
        progress: Progress | None,
    ) -> None:
        self._unit, self._observation = unit, observation
        self._rng = np.random.default_rng(seed)
        self._progress, self._done = progress, 0.0
        self._coarse = observation.thinned(coarse_stride(observation))
        atlas = make_atlas(unit, self._coarse, cache, self._part(0.4, "simulating every cause"))
        self._atlas: Atlas = {k: v for k, v in atlas.items() if not set(k) & set(without)}
        self._runs: dict[Effects, Population] = {}
        self.found: dict[Effects, Candidate] = {}

    def look_at_singles(self) -> None:
        """Simulate the single causes that the atlas favours about their best places."""
        places = screen_singles(self._coarse, self._atlas)
        chosen = _leading({k: p.log_likelihood for k, p in places.items()}, _FIRST)
        self._start({k: places[k].place for k in chosen}, _FIRST_GROUPS, 0.55)

    def look_at_pairs(self) -> None:
        """Simulate the pairs that the atlas favours, with the best single causes in them."""
        singles: dict[Effects, Candidate] = {k: c for k, c in self.found.items() if len(k) == 1}
        leading = _leading({k: c.best.log_likelihood for k, c in singles.items()}, _PARENTS)
        parents = {k: singles[k].best.place for k in leading if k}
        places = screen_pairs(self._coarse, self._atlas, parents)
        chosen = _leading({k: p.log_likelihood for k, p in places.items()}, _PAIRS)
        self._start({k: places[k].place for k in chosen if k}, _PAIR_GROUPS, 0.8)

    def look_closer(self, count: int, groups: int, until: float) -> None:
        """Simulate more of the leading candidates, along the places that agree."""
        chosen = _leading({k: c.best.log_likelihood for k, c in self.found.items()}, count)
        asked = [g for k in chosen for g in groups_along(self.found[k], groups, self._rng)]
        self._simulate(asked, until)
        self._form({k: self.found[k].best.place for k in chosen})

    def doubtful(self) -> bool:
        """Whether no candidate so far looks like the observation."""
        best = max(self.found.values(), key=lambda c: c.best.log_likelihood)
        return judge_adequacy(best, self._rng).sigma > _DOUBT

    def _start(self, places: Mapping[Effects, np.ndarray], groups: int, until: float) -> None:
        asked = [
            group
            for key, place in places.items()
            for group in groups_about(Hypothesis(self._unit, key), place, groups, self._rng)
        ]
        self._simulate(asked, until)
        self._form(places)

    def _simulate(self, groups: Iterable[Group], until: float) -> None:
        report = self._part(until, "looking closer")
        made = simulate_groups(self._unit, list(groups), self._observation, self._rng, report)
        for key, population in made.items():
            known = self._runs.get(key)
            self._runs[key] = population if known is None else known.joined(population)

    def _form(self, starts: Mapping[Effects, np.ndarray]) -> None:
        runs = {key: self._runs[key] for key in starts}
        self.found |= form_candidates(self._unit, self._observation, runs, starts)

    def _part(self, until: float, text: str) -> Callable[[float], None] | None:
        begin, self._done = self._done, until
        progress = self._progress
        if progress is None:
            return None
        return lambda share: progress(begin + (until - begin) * share, text)


def _leading(scores: Mapping[Effects, float], most: int) -> list[Effects]:
    """The most likely hypotheses, and always the baseline where it is among them."""
    ranked = sorted(scores, key=lambda key: -scores[key])
    return list(dict.fromkeys([*ranked[:most], *(key for key in ranked if not key)]))
