"""The candidates on the rows of one observation, and all runs made for them so far.

Owns the bookkeeping of a refinement: what was simulated for which hypothesis, the
candidates that it gives, and the reading noise that they are held against. It
does not decide what to look at.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.datasheet_range import datasheet_range
from analysis.emulation.fitted_model import Effects, FittedModel, fit_models
from analysis.emulation.model_parameters import estimate_parameters
from analysis.emulation.noise_level import likeliest_noise, possible_noises
from analysis.ensemble.model import Hypothesis
from analysis.ensemble.runs import DatasheetRange, Group, Population, simulate_groups
from analysis.execution.executor import Executor
from analysis.inference.run_design import Reach, runs_about, runs_along_ridge, runs_around_estimate
from analysis.observation.observation import Observation
from sim.unit import Unit

__all__ = ["ModelPool", "Starts"]

Place = NDArray[np.float64]
"""Coordinates (d,) of a hypothesis."""

Starts = Mapping[Effects, NDArray[np.float64]]
"""Places (d,) from which hypotheses are looked at."""


_MANY = 4
"""Coordinates from which on half of further runs of several causes lie along the places that
agree."""

_TRIES = 3
"""Steps of a climb with another noise, where it begins at the best place with the last one."""


class ModelPool:
    """Candidates on the rows of one observation, and the runs made for them so far."""

    def __init__(
        self,
        unit: Unit,
        observation: Observation,
        rng: np.random.Generator,
        executor: Executor | None,
        progress: Callable[[float], None] | None,
    ) -> None:
        self.unit, self.observation, self._rng = unit, observation, rng
        self._noises = possible_noises(observation)
        self._executor, self._progress, self._left = executor, progress, 1.0
        self._runs: dict[Effects, Population] = {}
        self.found: dict[Effects, FittedModel] = {}

    @property
    def best(self) -> FittedModel:
        """The most likely candidate."""
        return max(self.found.values(), key=lambda c: c.best.log_likelihood)

    def simulate_about(
        self,
        starts: Mapping[Effects, tuple[Place, Reach]],
        groups: int,
        about: Mapping[Effects, DatasheetRange] | None = None,
    ) -> None:
        """Simulate hypotheses about places, each within its reach, in so many groups each.

        `about`: where their datasheet values lie, if that is known better than by the datasheet.
        """
        wanted: list[Group] = []
        for key, (place, reach) in starts.items():
            wanted += runs_about(Hypothesis(self.unit, key), place, groups, self._rng, reach)
        self._simulate(wanted, about)
        self._form({key: place for key, (place, _) in starts.items()})

    def simulate_around_estimate(
        self,
        chosen: Sequence[Effects],
        groups: int,
        about: Mapping[Effects, DatasheetRange] | None = None,
    ) -> None:
        """Simulate more of some candidates, about what their runs tell of their parameters.

        `about`: see `simulate_about`.
        """
        more: list[Group] = []
        for c in (self.found[key] for key in chosen):
            # What is learned of many parameters is far wider than a resonance is sharp. Of one
            # cause it tells more than what agrees, which tends to lie where the runs do.
            several = len(c.hypothesis.effects) > 1
            along = groups // 2 if several and c.hypothesis.d >= _MANY else 0
            learned = estimate_parameters(c, self.observation, self._rng)
            more += runs_around_estimate(c.hypothesis, learned, groups - along, self._rng)
            more += runs_along_ridge(c, along, self._rng)
        self._simulate(more, about)
        self._form({key: self.found[key].best.place for key in chosen})

    def re_estimate_noise(self) -> None:
        """Take the reading for as noisy as the most likely candidate would have it."""
        best = self.best
        key = best.hypothesis.effects

        def likelihood(seen: Observation) -> float:
            starts, runs = {key: best.best.place}, {key: self._runs[key]}
            formed = fit_models(self.unit, seen, runs, starts, _TRIES)
            return formed[key].best.log_likelihood

        heard = likeliest_noise(self._noises, likelihood)
        if heard.noise_v != self.observation.noise_v:
            self.observation = heard
            self._form({effects: c.best.place for effects, c in self.found.items()})

    def ranges(self, chosen: Iterable[Effects]) -> dict[Effects, DatasheetRange]:
        """Where the datasheet values of some candidates lie, as far as their runs tell."""
        return {key: datasheet_range(self.found[key]) for key in chosen}

    def _simulate(
        self, groups: Sequence[Group], about: Mapping[Effects, DatasheetRange] | None
    ) -> None:
        made = simulate_groups(
            self.unit, groups, self.observation, self._rng, self._executor, self._report(), about
        )
        for key, population in made.items():
            known = self._runs.get(key)
            self._runs[key] = population if known is None else known.joined(population)

    def _form(self, starts: Starts) -> None:
        runs = {key: self._runs[key] for key in starts}
        self.found |= fit_models(self.unit, self.observation, runs, starts)

    def _report(self) -> Callable[[float], None] | None:
        """What is told the share of further work: half of what is left of the bar.

        Nobody knows how many rounds are to come.
        """
        if self._progress is None:
            return None
        progress, begin = self._progress, 1.0 - self._left
        self._left *= 0.5
        half = self._left
        return lambda share: progress(begin + half * share)
