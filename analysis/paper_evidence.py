"""How well a hypothesis agrees with measured features: likelihood, evidence, what it predicts.

Owns the likelihood of five numbers given a surface of simulated ones, and the
sums over the prior that follow: evidence, posterior of ratio and sizes, and the
prediction of each number from the others. It simulates nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc
from scipy.stats import t as student

from analysis.causes import Hypothesis
from analysis.paper_surface import FREEDOM, Surface
from analysis.paper_sweeps import Reading

__all__ = ["Agreement", "RatioPrior", "agree"]

TOLERANCE = 0.0035
"""Spread of a unit's own frequencies from that of its inertias and stiffnesses, as a share."""

_IS_HZ = np.array([True, False, True, False, True])

_PLACES = {1: 128, 2: 512, 3: 1024}
_MOST_PLACES = 2048
"""Places of the prior at which a hypothesis is held against the measurement, by dimension."""


@dataclass(frozen=True, slots=True)
class RatioPrior:
    """What is known of the contribution ratio beforehand: nothing, or a measured value."""

    value: float | None = None
    std: float = 0.0

    def draw(self, uniform: NDArray[np.float64]) -> NDArray[np.float64]:
        """Ratios at the quantiles `uniform`, 0 to 1."""
        if self.value is None:
            return uniform
        # The ends of a normal distribution fall outside 0 to 1 for a ratio near an end.
        from scipy.stats import truncnorm

        low, high = (0.0 - self.value) / self.std, (1.0 - self.value) / self.std
        drawn = truncnorm.ppf(uniform, low, high, loc=self.value, scale=self.std)
        return np.asarray(drawn, dtype=np.float64)


@dataclass(frozen=True)
class Agreement:
    """A hypothesis held against a reading at many places of its prior.

    Parameters
    ----------
    places
        Shape (m, d): equally likely beforehand.
    mean, std
        Shape (m, 5): prediction of a single run, its scatter and reading error included.
    terms
        Shape (m, 5): log-likelihood of each number; 0 where it was not measured.
    reading
        What was measured.
    """

    hypothesis: Hypothesis
    places: NDArray[np.float64]
    mean: NDArray[np.float64]
    std: NDArray[np.float64]
    terms: NDArray[np.float64]
    reading: Reading

    @cached_property
    def log_likelihood(self) -> NDArray[np.float64]:
        """Shape (m,)."""
        return np.asarray(self.terms.sum(axis=1))

    @cached_property
    def log_evidence(self) -> float:
        """Logarithm of the likelihood's mean over the prior."""
        return _log_mean(self.log_likelihood)

    @cached_property
    def weight(self) -> NDArray[np.float64]:
        """Posterior of the places, shape (m,), sum 1."""
        return _normalised(self.log_likelihood)

    @property
    def best(self) -> NDArray[np.float64]:
        """The likeliest place, shape (d,)."""
        return self.places[int(np.argmax(self.log_likelihood))]

    @property
    def sigma(self) -> NDArray[np.float64]:
        """Measured less predicted at the likeliest place over the prediction's std, shape (5,)."""
        at = int(np.argmax(self.log_likelihood))
        return np.asarray((self.reading.values - self.mean[at]) / self.std[at])

    @property
    def effective_places(self) -> float:
        """How many places carry the posterior."""
        return float(1.0 / np.sum(self.weight**2))

    def moments(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Posterior mean and standard deviation of the place, shape (d,) each."""
        mean = self.weight @ self.places
        return mean, np.sqrt(self.weight @ (self.places - mean) ** 2)

    def predicted(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Mean and standard deviation of each number over the posterior, shape (5,)."""
        return _mixture(self.weight, self.mean, self.std)

    def held_out(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Each number predicted from the other ones: mean and standard deviation, shape (5,)."""
        found = []
        for k in range(self.terms.shape[1]):
            others = self.log_likelihood - self.terms[:, k]
            weight = _normalised(others)
            found.append(_mixture(weight, self.mean[:, k], self.std[:, k]))
        mean, std = (np.array(part) for part in zip(*found, strict=True))
        return mean, std

    def probability_of_worse(self) -> float:
        """Share of readings drawn from the likeliest place that would agree worse, 0 to 1."""
        known = np.isfinite(self.reading.values)
        rng = np.random.default_rng(0)
        drawn = student.logpdf(rng.standard_t(FREEDOM, size=(4000, int(known.sum()))), FREEDOM).sum(
            axis=1
        )
        here = student.logpdf(self.sigma[known], FREEDOM).sum()
        return float(np.mean(drawn < here))


def agree(
    hypothesis: Hypothesis, surface: Surface, reading: Reading, prior: RatioPrior, seed: int = 0
) -> Agreement:
    """Hold a hypothesis against a reading over its whole prior.

    Sizes are equally likely beforehand in every octave of their plausible range.
    """
    dimension = surface.places.shape[1]
    count = _PLACES.get(dimension, _MOST_PLACES)
    places = qmc.Sobol(dimension, rng=np.random.default_rng(seed)).random(count)
    places[:, 0] = prior.draw(places[:, 0])
    mean, scatter, shown = surface.predict(places)
    tolerance = np.where(_IS_HZ, TOLERANCE * np.abs(reading.values), 0.0)
    known = np.isfinite(reading.values)
    error = np.where(known, np.hypot(reading.std, tolerance), 0.0)
    std = np.hypot(scatter, error)
    z = np.where(known, (reading.values - mean) / std, 0.0)
    terms = np.where(known, student.logpdf(z, FREEDOM) - np.log(std) + np.log(shown), 0.0)
    return Agreement(hypothesis, places, mean, std, terms, reading)


def _normalised(log_weight: NDArray[np.float64]) -> NDArray[np.float64]:
    weight = np.exp(log_weight - log_weight.max())
    return np.asarray(weight / weight.sum())


def _log_mean(values: NDArray[np.float64]) -> float:
    top = float(values.max())
    return top + math.log(float(np.mean(np.exp(values - top))))


def _mixture(
    weight: NDArray[np.float64], mean: NDArray[np.float64], std: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    centre = weight @ mean
    return centre, np.sqrt(weight @ (std**2 + (mean - centre) ** 2))
