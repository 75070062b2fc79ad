"""How well a set of causes agrees with measured features: likelihood, evidence, predictions.

Owns the likelihood of five numbers given simulated ones, and the sums over the
prior that follow: evidence, posterior of ratio and sizes, and the prediction
of each number from the others. It simulates nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher
from scipy.stats import qmc, truncnorm

from analysis.ensemble.datasheet_spread import feature_spread
from analysis.ensemble.model import Hypothesis
from analysis.paper_diagnosis.emulator import FREEDOM
from analysis.paper_diagnosis.features import Reading
from analysis.paper_diagnosis.simulation import Explored
from daq.frf import DB_PER_NEPER
from sim.unit import Unit

__all__ = ["Agreement", "RatioPrior", "agree", "reading_error", "weighted_box"]

_IS_HZ = np.array([True, False, True, False, True])

_PLACES = {1: 128, 2: 512, 3: 1024}
_MOST_PLACES = 1024
"""Places of the prior at which a set is held against the measurement, by dimension."""


@dataclass(frozen=True, slots=True)
class RatioPrior:
    """What is known of the contribution ratio beforehand: nothing, or a measured value."""

    value: float | None = None
    std: float = 0.0

    def draw(self, quantiles: NDArray[np.float64]) -> NDArray[np.float64]:
        """Ratios at quantiles between 0 and 1."""
        if self.value is None:
            return quantiles
        low, high = -self.value / self.std, (1.0 - self.value) / self.std
        drawn = truncnorm.ppf(quantiles, low, high, loc=self.value, scale=self.std)
        return np.asarray(drawn, dtype=np.float64)


def reading_error(reading: Reading, unit: Unit) -> NDArray[np.float64]:
    """Reading error and tolerance of the datasheet together, shape (5,); 0 where not measured."""
    known, (frequency, gain) = np.isfinite(reading.values), feature_spread(unit)
    tolerance = np.where(_IS_HZ, frequency * np.abs(reading.values), DB_PER_NEPER * gain)
    return np.where(known, np.hypot(reading.std, tolerance), 0.0)


def log_density(apart: NDArray[np.float64], covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log-density of Student's t with `FREEDOM` in k numbers, shape (...,).

    Parameters
    ----------
    apart
        Shape (..., k): distance from the centre.
    covariance
        Shape (..., k, k): its scale matrix.
    """
    k = apart.shape[-1]
    lower = np.linalg.cholesky(covariance)
    z = np.linalg.solve(lower, apart[..., None])[..., 0]
    half_log_det = np.log(np.diagonal(lower, axis1=-2, axis2=-1)).sum(axis=-1)
    constant = math.lgamma(0.5 * (FREEDOM + k)) - math.lgamma(0.5 * FREEDOM)
    constant -= 0.5 * k * math.log(FREEDOM * math.pi)
    spread = np.log1p(np.sum(z**2, axis=-1) / FREEDOM)
    return np.asarray(constant - half_log_det - 0.5 * (FREEDOM + k) * spread)


@dataclass(frozen=True)
class Agreement:
    """A set of causes held against a reading at many places of its prior.

    Parameters
    ----------
    places
        Shape (m, d): equally likely beforehand within the part that was explored.
    log_volume
        Logarithm of that part's share of the whole prior.
    mean, covariance
        Shapes (m, 5) and (m, 5, 5): a single run's reading; scatter and reading error together.
    log_shown
        Shape (m, 5): logarithm of the share of runs that show a feature.
    reading
        What was measured.
    """

    hypothesis: Hypothesis
    places: NDArray[np.float64]
    log_volume: float
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    log_shown: NDArray[np.float64]
    reading: Reading

    @cached_property
    def std(self) -> NDArray[np.float64]:
        """Standard deviations of a single run's reading, shape (m, 5)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @cached_property
    def _known(self) -> NDArray[np.int64]:
        return np.flatnonzero(np.isfinite(self.reading.values))

    @cached_property
    def log_likelihood(self) -> NDArray[np.float64]:
        """Shape (m,)."""
        return self._log_likelihood_of(self._known)

    def _log_likelihood_of(self, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
        """The same from some of the numbers, by their place in `FEATURES`."""
        apart = self.reading.values[numbers] - self.mean[:, numbers]
        covariance = self.covariance[:, numbers[:, None], numbers]
        return log_density(apart, covariance) + self.log_shown[:, numbers].sum(axis=1)

    @cached_property
    def log_evidence(self) -> float:
        """Logarithm of the likelihood's mean over the prior; nothing counts beyond what was run."""
        top = float(self.log_likelihood.max())
        return self.log_volume + top + math.log(np.mean(np.exp(self.log_likelihood - top)))

    @cached_property
    def weight(self) -> NDArray[np.float64]:
        """Posterior of the places, shape (m,), sum 1."""
        return _normalised(self.log_likelihood)

    @cached_property
    def _likeliest(self) -> int:
        return int(np.argmax(self.log_likelihood))

    @property
    def best(self) -> NDArray[np.float64]:
        """The likeliest place, shape (d,)."""
        return self.places[self._likeliest]

    @property
    def at_best(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Mean and standard deviation of a single run's reading there, shape (5,)."""
        return self.mean[self._likeliest], self.std[self._likeliest]

    @property
    def departure(self) -> NDArray[np.float64]:
        """Measured less predicted at the likeliest place, in its std, shape (5,)."""
        mean, std = self.at_best
        return np.asarray((self.reading.values - mean) / std)

    def moments(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Posterior mean and standard deviation of the place, shape (d,) each."""
        return _mixture(self.weight, self.places, np.zeros_like(self.places))

    def held_out(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Each number predicted from the other ones: mean and standard deviation, shape (5,).

        NaN where a number was not measured.
        """
        mean, std = np.full((2, len(self.reading.values)), np.nan)
        for k in self._known:
            others = self._known[self._known != k]
            weight = _normalised(self._log_likelihood_of(others))
            across = self.covariance[:, k, others]
            gain = np.linalg.solve(self.covariance[:, others[:, None], others], across[..., None])[
                ..., 0
            ]
            apart = self.reading.values[others] - self.mean[:, others]
            centre = self.mean[:, k] + np.sum(gain * apart, axis=1)
            variance = self.covariance[:, k, k] - np.sum(gain * across, axis=1)
            mean[k], std[k] = _mixture(weight, centre, np.sqrt(variance))
        return mean, std

    def draw(self, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
        """Places drawn from the posterior, shape (count, d)."""
        return self.places[rng.choice(len(self.places), size=count, p=self.weight)]

    def draw_runs(
        self, count: int, rng: np.random.Generator, *, at_best: bool = False
    ) -> NDArray[np.float64]:
        """Readings of single runs, shape (count, 5), from the posterior or the likeliest place."""
        chances = rng.choice(len(self.places), size=count, p=self.weight)
        at = np.full(count, self._likeliest) if at_best else chances
        lower = np.linalg.cholesky(self.covariance)[at]
        normal = np.einsum("nij,nj->ni", lower, rng.standard_normal((count, lower.shape[-1])))
        stretch = np.sqrt(FREEDOM / rng.chisquare(FREEDOM, size=(count, 1)))
        return np.asarray(self.mean[at] + normal * stretch)

    def probability_of_worse(self) -> float:
        """Share of readings drawn from the likeliest place that agree worse than this, 0 to 1."""
        at = self._likeliest
        lower = np.linalg.cholesky(self.covariance[at][self._known[:, None], self._known])
        apart = (self.reading.values - self.mean[at])[self._known]
        squares = float(np.sum(np.linalg.solve(lower, apart) ** 2))
        k = len(self._known)
        return float(fisher.sf(squares / k, k, FREEDOM))

    def box(self, heat: float, margin: float) -> NDArray[np.float64]:
        """Shape (d, 2): the part of the range that agrees, likelihood to the power 1 / heat."""
        weight = _normalised(self.log_likelihood / heat)
        return weighted_box(self.places, weight, margin)


def agree(explored: Explored, reading: Reading, prior: RatioPrior) -> Agreement:
    """Hold a set of causes against a reading all over the part of its prior that was explored.

    Sizes are equally likely beforehand in every octave of their plausible range.
    """
    surface, box = explored.surface, explored.box
    dimension = len(box)
    count = _PLACES.get(dimension, _MOST_PLACES)
    places = qmc.Sobol(dimension, rng=np.random.default_rng(0)).random(count)
    low, high = box[1:, 0], box[1:, 1]
    places[:, 1:] = low + (high - low) * places[:, 1:]
    places[:, 0] = prior.draw(places[:, 0])
    mean, scatter, shown = surface.predict(places)
    covariance = scatter[:, :, None] * surface.correlation * scatter[:, None, :]
    covariance = covariance + np.diag(reading_error(reading, explored.hypothesis.unit) ** 2)
    log_volume = float(np.sum(np.log(high - low)))
    return Agreement(
        explored.hypothesis, places, log_volume, mean, covariance, np.log(shown), reading
    )


def weighted_box(
    places: NDArray[np.float64], weight: NDArray[np.float64], margin: float
) -> NDArray[np.float64]:
    """Shape (d, 2): smallest box that holds all but the outermost 3 % on each side, and a margin.

    Coordinate 0, the ratio, is left whole.
    """
    box = np.tile([0.0, 1.0], (places.shape[1], 1))
    for k in range(1, places.shape[1]):
        order = np.argsort(places[:, k])
        share = np.cumsum(weight[order])
        ends = places[order[np.searchsorted(share, [0.03, 0.97])], k]
        box[k] = np.clip([ends[0] - margin, ends[1] + margin], 0.0, 1.0)
    return box


def _normalised(log_weight: NDArray[np.float64]) -> NDArray[np.float64]:
    weight = np.exp(log_weight - log_weight.max())
    return np.asarray(weight / weight.sum())


def _mixture(
    weight: NDArray[np.float64], mean: NDArray[np.float64], std: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    centre = weight @ mean
    return centre, np.sqrt(weight @ (std**2 + (mean - centre) ** 2))
