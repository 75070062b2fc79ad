"""Which values of a drive are other than commissioning, or its datasheet, says.

Owns the comparison of changes of single values and of pairs, given what is believed of all values
together. It knows values alone: causes that no datasheet has a value of are the diagnosis's. It
passes no verdict.

Method: the likelihood of all values is Gaussian where the regression of a commissioning ends. The
evidence of each set of changes is then a closed form, with the belief as prior, widened along what
has changed.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from analysis.commissioning.belief import Belief
from analysis.commissioning.coordinates import RATIO
from analysis.commissioning.identification import Identified, identify
from analysis.commissioning.regression import Gaussian
from analysis.execution.executor import Executor
from analysis.observation.observation import Observation
from sim.catalogue import CATALOGUE, EffectParameter, not_of_unit
from sim.unit import Unit

Vector = NDArray[np.float64]
Causes = tuple[str, ...]

__all__ = ["Changed", "Changes", "find_changes"]

_PRIOR = (0.5, 0.35, 0.1)
"""Probability that no value has changed, that one has, and that two have; else all may have."""

_ALL_PRIOR = 1.0 - sum(_PRIOR)

_NEAR = 0.5
"""Share of a probability that differs from it by no more than two draws of simulated drives do."""

_FREQUENCIES = 60
"""Frequencies of each level that are simulated, or up to twice as many."""

_ALL = ("all values",)


@dataclass(frozen=True, slots=True, eq=False)
class Changed:
    """What is known if some causes, and no others, have changed values.

    `ratio`: contribution ratio. `changes` (causes,): the logarithm of each one's value over the
    believed one. `covariance` (1 + causes, square) of the ratio and these logarithms.
    """

    ratio: float
    changes: Vector
    covariance: Vector


@dataclass(frozen=True, eq=False)
class Changes:
    """The posterior of all values, and what follows of each set of changes.

    `prior`: of the coordinates, all changes allowed; `identified`: their posterior. `directions`
    (d,): see `_directions`.
    """

    belief: Belief
    prior: Gaussian
    identified: Identified
    directions: Mapping[Causes, Vector]

    @cached_property
    def probabilities(self) -> dict[Causes, float]:
        """Of each set of causes, the likeliest first; a value without a cause is named itself.

        Or of `_ALL`: that more than two values have changed.
        """
        singles = list(self.directions)
        pairs = list(combinations(singles, 2))
        sets: list[list[tuple[Causes, ...]]] = [[()], [(one,) for one in singles], [*pairs]]
        everything = np.log(_ALL_PRIOR) + self._log_evidence(self.prior.covariance)
        scores: dict[Causes, float] = {_ALL: everything}
        for share, some in zip(_PRIOR, sets, strict=True):
            for one in some:
                names = tuple(sorted(name for names in one for name in names))
                evidence = self._log_evidence(self._prior_of(one))
                scores[names] = np.log(share / len(some)) + evidence
        most = max(scores.values())
        total = sum(np.exp(score - most) for score in scores.values())
        ranked = sorted(scores.items(), key=lambda item: -item[1])
        return {names: float(np.exp(score - most) / total) for names, score in ranked}

    @property
    def likeliest(self) -> Causes | None:
        """The likeliest set of causes, empty where no more than the ratio has changed.

        None where that holds values without a cause, or more than one, as a cause that no value
        stands for is likelier than two changes at once; where values leave too much; and where it
        is as likely that they have changed all together. Of two that are hardly likelier than one
        of them it is that one.
        """
        believed, named = self._by_cause, self.named()
        first = max(believed, key=believed.__getitem__)
        near = [(one,) for one in first if believed.get((one,), 0.0) > _NEAR * believed[first]]
        if len(first) > 1 and near:
            first = max(near, key=believed.__getitem__)
        if len(first) > 1 or first not in named or self.identified.unlike:
            return None
        # Values together imitate a cause that none of them stands for.
        return None if first and believed[_ALL] > _NEAR * believed[first] else first

    @property
    def suffice(self) -> bool:
        """Whether values leave nothing to be explained, without being off all together."""
        strained = self.probabilities[_ALL] > _ALL_PRIOR
        return self.likeliest is not None and self.identified.usual and not strained

    def named(self) -> dict[Causes, float]:
        """Probabilities of sets of causes of the catalogue, whatever the ratio is."""
        known = CATALOGUE.keys()
        return {names: p for names, p in self._by_cause.items() if set(names) <= known}

    @cached_property
    def _by_cause(self) -> dict[Causes, float]:
        """The same whatever the ratio is, and whatever value without a cause changed as well."""
        found: dict[Causes, float] = {}
        for names, probability in self.probabilities.items():
            causes = tuple(name for name in names if name in CATALOGUE)
            key = causes or tuple(name for name in names if name != RATIO)
            found[key] = found.get(key, 0.0) + probability
        return found

    @property
    def shares(self) -> Vector:
        """Change (d,) of the logarithm of each value by its coordinate; 0 of the ratio."""
        return np.nan_to_num(np.array(self.belief.coordinates.shares))

    def posterior(self, causes: Causes) -> Gaussian:
        """Of all coordinates if these causes, and perhaps the ratio, changed."""
        free = [one for one in self.directions if one == (RATIO,)]
        left, _ = self._narrowed(self._prior_of([*free, *((name,) for name in causes)]))
        return Gaussian(self.prior.mean + left @ self._told[1], left)

    def given(self, causes: Causes) -> Changed:
        """What the values are if these causes changed them; the ratio may have changed, too."""
        ways = [self.directions[(name,)] for name in causes]
        posterior = self.posterior(causes)
        before = self.prior.mean
        c = self.belief.coordinates
        ratio = np.array([symbol == RATIO for symbol in c.symbols])
        # Logarithm of each cause's value, as the mean over the values that it changes.
        rows = np.zeros((1 + len(ways), len(c)))
        rows[0] = np.where(ratio, c.slopes(posterior.mean), 0.0)
        for row, way in zip(rows[1:], ways, strict=True):
            row[:] = (way != 0.0) * self.shares / np.count_nonzero(way)
        at = float(ndtr(posterior.mean[ratio][0])) if ratio.any() else 1.0
        return Changed(
            at, rows[1:] @ (posterior.mean - before), rows @ posterior.covariance @ rows.T
        )

    def _prior_of(self, changed: Collection[Causes]) -> Vector:
        covariance = self.belief.common.copy()
        for one in changed:
            covariance += np.outer(self.directions[one], self.directions[one])
        return covariance

    @cached_property
    def _told(self) -> tuple[Vector, Vector]:
        """Information (d, d) of the data alone, and it times their mean (d,) from the prior's."""
        found = self.identified.posterior
        posterior, prior = (np.linalg.inv(g.covariance) for g in (found, self.prior))
        sizes, ways = np.linalg.eigh(posterior - prior)
        information = (ways * np.maximum(sizes, 0.0)) @ ways.T
        return information, posterior @ (found.mean - self.prior.mean)

    def _narrowed(self, covariance: Vector) -> tuple[Vector, float]:
        """What the data leave of a prior's covariance (d, d), and half of what its volume loses."""
        # (C^-1 + I)^-1 = C (1 + I C)^-1, which needs no inverse of a prior that is nearly exact.
        inside = np.eye(len(covariance)) + self._told[0] @ covariance
        left = covariance @ np.linalg.inv(inside)
        return 0.5 * (left + left.T), 0.5 * float(np.linalg.slogdet(inside)[1])

    def _log_evidence(self, covariance: Vector) -> float:
        """Of a prior with this covariance (d, d), but for what all have in common."""
        pull, (left, lost) = self._told[1], self._narrowed(covariance)
        return float(0.5 * pull @ left @ pull - lost)


def find_changes(
    belief: Belief,
    observation: Observation,
    *,
    without: Collection[str] = (),
    seed: int = 0,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
) -> Changes:
    """Compare changes of the values of a drive.

    Parameters
    ----------
    belief
        What is believed of its values if none has changed.
    observation
        Sweeps of it.
    without
        Causes of the catalogue that are left out.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    directions = _directions(belief, without)
    ratio = np.array([symbol == RATIO for symbol in belief.coordinates.symbols])
    least = np.where(ratio, float(belief.commissioned), 1.0)
    widest = np.max([least, *(way**2 for way in directions.values())], axis=0)
    prior = Gaussian(belief.centre, belief.common + np.diag(widest))
    longest = max(block.stop - block.start for block in observation.blocks)
    found = identify(
        belief.coordinates, observation.thinned(max(longest // _FREQUENCIES, 1)),
        prior=prior, seed=seed, executor=executor, progress=progress,
    )  # fmt: skip
    return Changes(belief, prior, found, directions)


def _directions(belief: Belief, without: Collection[str]) -> dict[Causes, Vector]:
    """Standard deviation (d,) of the coordinates along what each cause changes.

    By the identifier of an effect that changes known values and nothing else; by its symbol of a
    value that no effect changes, and of a contribution ratio that was known.
    """
    coordinates = belief.coordinates
    unit = coordinates.unit
    place = {symbol: i for i, symbol in enumerate(coordinates.symbols)}
    foreign = {*not_of_unit(unit), *without}
    found: dict[Causes, Vector] = {}
    told: set[str] = set()
    for effect in CATALOGUE.values():
        if effect.id in foreign or len(effect.parameters) != 1:
            continue
        (parameter,) = effect.parameters
        changed = (parameter.name,) if parameter.name in unit.parameters else parameter.of
        if not changed or not all(symbol in place for symbol in changed):
            continue
        told |= set(changed)
        size = 1.0 if belief.commissioned else _octaves(parameter, unit)
        found[(effect.id,)] = size * _along(place, changed)
    if unit.amplifier is not None:
        # With a current controller only the product of k_a and k_t shows.
        told.add("k_t")
    if not belief.commissioned:
        told.add(RATIO)
    for symbol in place:
        if symbol not in told:
            found[(symbol,)] = _along(place, (symbol,))
    return found


def _octaves(parameter: EffectParameter, unit: Unit) -> float:
    """How many times a value may double within its plausible range: friction may more than mass.

    By so much more a datasheet may be off. What changes after commissioning begins small.
    """
    _, most = parameter.range(unit)
    return max(float(np.log2(most / (parameter.nominal(unit) or 1.0))), 1.0)


def _along(place: Mapping[str, int], symbols: Collection[str]) -> Vector:
    way = np.zeros(len(place))
    way[[place[symbol] for symbol in symbols]] = 1.0
    return way
