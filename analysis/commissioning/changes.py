"""Which values of a commissioned drive have changed since.

Owns the comparison of changes of single values and of pairs, given what commissioning identified of
all values together. It knows values alone: causes that no datasheet has a value of are the
diagnosis's. It passes no verdict.

Method: the likelihood of all values is Gaussian where the regression of a commissioning ends. The
evidence of each set of changes is then a closed form, with the prior as commissioning left it,
widened along what has changed.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from analysis.commissioning.coordinates import RATIO, Coordinates
from analysis.commissioning.identification import Identified, identify
from analysis.commissioning.regression import LEAST_STD, Gaussian
from analysis.execution.executor import Executor
from analysis.observation.observation import Observation
from sim.catalogue import CATALOGUE, not_of_unit
from sim.commissioning import Commissioning
from sim.unit import Unit

Vector = NDArray[np.float64]
Causes = tuple[str, ...]

__all__ = ["Changed", "Changes", "find_changes", "was_commissioned"]

_CHANGE = 0.15
"""Standard deviation of the logarithm of a value that has changed."""

_NEAREST_END = 0.02
"""A contribution ratio is taken to be no nearer to 0 or 1 than this where it was identified."""

_PRIOR = (0.5, 0.35, 0.1)
"""Probability that no value has changed, that one has, and that two have; else all may have."""

_ALL = ("all values",)


@dataclass(frozen=True, slots=True, eq=False)
class Changed:
    """What is known if some causes, and no others, have changed values since commissioning.

    `ratio`: contribution ratio. `changes` (causes,): the logarithm of each one's value over the
    commissioned one. `covariance` (1 + causes, square) of the ratio and these logarithms.
    """

    ratio: float
    changes: Vector
    covariance: Vector


@dataclass(frozen=True, eq=False)
class Changes:
    """The posterior of all values, and what follows of each set of changes.

    `prior`: of the coordinates, all changes allowed; `identified`: their posterior. `common`
    (d, d): covariance where nothing has changed. `directions` (d,): see `_directions`.
    """

    coordinates: Coordinates
    prior: Gaussian
    identified: Identified
    common: Vector
    directions: Mapping[Causes, Vector]

    @cached_property
    def probabilities(self) -> dict[Causes, float]:
        """Of each set of causes, the likeliest first; a value without a cause is named itself.

        Or of `_ALL`: that more than two values have changed.
        """
        singles = list(self.directions)
        pairs = list(combinations(singles, 2))
        sets: list[list[tuple[Causes, ...]]] = [[()], [(one,) for one in singles], [*pairs]]
        everything = np.log(1.0 - sum(_PRIOR)) + self._log_evidence(self.prior.covariance)
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
        stands for is likelier than two changes at once; and where values leave too much.
        """
        first = max(self._by_cause, key=self._by_cause.__getitem__)
        if len(first) > 1 or first not in self.named() or self.identified.unlike:
            return None
        return first

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

    def given(self, causes: Causes) -> Changed:
        """What the values are if these causes changed them; the ratio may have changed, too."""
        ways = [self.directions[(name,)] for name in causes]
        free = [one for one in self.directions if one == (RATIO,)]
        posterior = self._posterior([*free, *((name,) for name in causes)])
        before = self.prior.mean
        c = self.coordinates
        ratio = np.array([symbol == RATIO for symbol in c.symbols])
        shares = np.nan_to_num(np.array(c.shares))
        # Logarithm of each cause's value, as the mean over the values that it changes.
        rows = np.zeros((1 + len(ways), len(c)))
        rows[0] = np.where(ratio, c.slopes(posterior.mean), 0.0)
        for row, way in zip(rows[1:], ways, strict=True):
            row[:] = way * shares / np.count_nonzero(way)
        at = float(ndtr(posterior.mean[ratio][0])) if ratio.any() else 1.0
        return Changed(
            at, rows[1:] @ (posterior.mean - before), rows @ posterior.covariance @ rows.T
        )

    def _prior_of(self, changed: Collection[Causes]) -> Vector:
        covariance = self.common.copy()
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

    def _posterior(self, changed: Collection[Causes]) -> Gaussian:
        left, _ = self._narrowed(self._prior_of(changed))
        return Gaussian(self.prior.mean + left @ self._told[1], left)


def was_commissioned(unit: Unit) -> bool:
    """Whether a unit's file tells of its values, and of the ratio of two stages, all together."""
    known = unit.commissioning
    if known is None or (unit.stages == 2 and RATIO not in known.order):
        return False
    return bool(_coordinates(unit, known).symbols)


def find_changes(
    unit: Unit,
    observation: Observation,
    *,
    without: Collection[str] = (),
    seed: int = 0,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
) -> Changes:
    """Compare changes of the values of a commissioned drive.

    Parameters
    ----------
    unit
        As `analysis.commissioning` wrote it; its contribution ratio may be another one since.
    observation
        Later sweeps of it.
    without
        Causes of the catalogue that are left out.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    ValueError
        If the unit was not commissioned.
    """
    known = unit.commissioning
    if known is None or not was_commissioned(unit):
        raise ValueError(f"unit {unit.name} was not commissioned")
    coordinates = _coordinates(unit, known)
    common = _common(coordinates, known)
    directions = _directions(unit, coordinates, without)
    prior = Gaussian(_centre(coordinates, known), common + np.eye(len(coordinates)))
    found = identify(
        coordinates, observation, prior=prior, seed=seed, executor=executor, progress=progress
    )
    return Changes(coordinates, prior, found, common, directions)


def _coordinates(unit: Unit, known: Commissioning) -> Coordinates:
    values = unit.parameters
    two = unit.stages == 2
    symbols = [s for s in known.order if values.get(s, 0.0) > 0.0 or (s == RATIO and two)]
    shares = [float("nan") if symbol == RATIO else _CHANGE for symbol in symbols]
    return Coordinates(unit, tuple(symbols), tuple(shares))


def _centre(coordinates: Coordinates, known: Commissioning) -> Vector:
    """Coordinates (d,) as they were identified."""
    ratio = 0.5 if known.contribution_ratio is None else known.contribution_ratio
    at = float(ndtri(np.clip(ratio, _NEAREST_END, 1.0 - _NEAREST_END)))
    return np.array([at if symbol == RATIO else 0.0 for symbol in coordinates.symbols])


def _common(coordinates: Coordinates, known: Commissioning) -> Vector:
    """Covariance (d, d) of the coordinates of a drive that has not changed.

    A backlash that was not identified is exact, and takes no part: with that and the ratio open the
    regression tells neither.
    """
    place = {symbol: i for i, symbol in enumerate(known.order)}
    rows = [place[symbol] for symbol in coordinates.symbols]
    slopes = coordinates.slopes(_centre(coordinates, known))
    found = np.array(known.covariance)[np.ix_(rows, rows)] / np.outer(slopes, slopes)
    sizes, ways = np.linalg.eigh(0.5 * (found + found.T))
    return (ways * np.maximum(sizes, 0.0)) @ ways.T + np.diag((LEAST_STD / slopes) ** 2)


def _directions(
    unit: Unit, coordinates: Coordinates, without: Collection[str]
) -> dict[Causes, Vector]:
    """Standard deviation (d,) of the coordinates along what each cause changes.

    By the identifier of an effect that changes known values and nothing else; by its symbol of a
    value that no effect changes, and of the contribution ratio.
    """
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
        found[(effect.id,)] = _along(place, changed)
    if unit.amplifier is not None:
        # With a current controller only the product of k_a and k_t shows.
        told.add("k_t")
    for symbol in place:
        if symbol not in told:
            found[(symbol,)] = _along(place, (symbol,))
    return found


def _along(place: Mapping[str, int], symbols: Collection[str]) -> Vector:
    way = np.zeros(len(place))
    way[[place[symbol] for symbol in symbols]] = 1.0
    return way
