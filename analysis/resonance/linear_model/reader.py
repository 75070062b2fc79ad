"""All anti-resonances and resonances of a level that one linear model describes.

Owns the test that the model may be believed, and the errors of what is read from it. It tries no
other way of reading: where the model is refused it says why.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc, stdtrit

from analysis.resonance.linear_model.choice import Choice, choose
from analysis.resonance.linear_model.extrema import Extremum, find_extrema, zeta_position
from analysis.resonance.linear_model.fitting import Fit, Readings
from analysis.resonance.neighbour_noise import Vector
from analysis.resonance.records import Feature
from analysis.resonance.samples import Samples
from daq.frf import DB_PER_NEPER

__all__ = ["ModelReading", "Read", "read_model"]

LEAST_PROBABILITY = 1e-3
"""A chi-square less likely than this contradicts the model, or the stated errors."""
MOST_SCATTER = 1.25
"""Residuals may exceed errors that are estimated from neighbouring readings by this factor."""
MOST_CORRELATION = 3.0
"""Correlation of neighbouring residuals, in its standard errors, that is still white."""
ALMOST_WHITE = 0.3
"""Correlation that widens the errors where chi-square agrees with those that are stated."""
HARMLESS_DB = 0.02
"""Residuals below this are accepted whatever the stated errors are."""
WHITE_DB = 0.5
"""White residuals below this are accepted, too: the stated errors are too small."""
CLEAR = 3.5
"""An extremum must stand out from its neighbours by this many standard errors."""
WIDEST_BAND = 1e5
"""A wider band is no sweep."""
WIDEST_GAIN = 40.0
"""Greatest span of ln |G|; 350 dB."""
_GREATEST_CORRELATION = 0.95
_SAME = 0.1
"""Extrema of two fits are the same within this in ln f, or within three standard errors."""


@dataclass(frozen=True, slots=True)
class Read:
    """A feature, where it stands among the extrema, and whether a pair makes it."""

    sign: int
    feature: Feature
    made: bool


@dataclass(frozen=True, slots=True, eq=False)
class ModelReading:
    """What a believed model shows.

    Parameters
    ----------
    found
        Minima and maxima inside the band, ascending.
    covariance
        Of their frequencies, Hz^2.
    scatter
        Residuals over the stated errors.
    lonely_hz
        Readings that were left out because nothing near them shows what they do, Hz.
    """

    found: tuple[Read, ...]
    covariance: Vector
    scatter: float
    lonely_hz: tuple[float, ...]


def read_model(samples: Samples) -> ModelReading | str:
    """Read a level by the model that predicts it best, or say why none is believed."""
    if len(samples) < 6:
        return "too few points for a linear fit"
    f, g = samples.frequency_hz, samples.log_gain
    if not (f[-1] < WIDEST_BAND * f[0] and np.ptp(g) < WIDEST_GAIN):
        return "the readings span more than a linear fit can"
    choice = _choice(samples)
    if choice is None:
        return "too few points for a linear fit"
    fit = choice.best
    used = np.delete(np.arange(len(samples)), choice.lonely)
    inflation = _inflation(fit, samples, used)
    if isinstance(inflation, str):
        return inflation
    extrema = _clear(fit, find_extrema(fit, float(f[1]), float(f[-2])), inflation)
    for one in extrema:
        if not _fits_near(fit, one, inflation):
            return "a linear fit misses the points at an extremum"
    covariance = _covariance(fit, extrema, inflation)
    spread = [_spread(choice, one, math.sqrt(covariance[k, k])) for k, one in enumerate(extrema)]
    covariance = covariance + np.diag([s[0] ** 2 for s in spread])
    found = tuple(
        Read(one.sign, _feature(fit, one, inflation, covariance[k, k], s), one.section is not None)
        for k, (one, s) in enumerate(zip(extrema, spread, strict=True))
    )
    lonely = tuple(float(f[k]) for k in choice.lonely)
    return ModelReading(found, covariance, fit.scale, lonely)


def _choice(samples: Samples) -> Choice | None:
    if samples.noise_known:
        return choose(Readings.of(samples), MOST_SCATTER)
    # Errors that nobody stated are a share of the gain or the same everywhere: as is likelier.
    guess = _slope(np.log(samples.std), samples.log_gain) < -0.5
    first = choose(Readings.of(samples, absolute=guess), math.inf)
    if first is None:
        return None
    share = np.abs(first.best.gain_off)
    if (_slope(np.log(share + 1e-300), first.best.log_gain) < -0.5) == guess:
        return first
    other = choose(Readings.of(samples, absolute=not guess), math.inf)
    return first if other is None or first.best.cost <= other.best.cost else other


def _slope(y: Vector, x: Vector) -> float:
    """Slope of the straight line through points; 0 where they share one abscissa."""
    off = x - np.mean(x)
    return float(np.sum(off * y) / max(float(np.sum(off**2)), 1e-300))


def _inflation(fit: Fit, samples: Samples, used: NDArray[np.intp]) -> float | str:
    """Factor on all errors, or why the fit is not believed."""
    known = samples.noise_known
    r = fit.residual
    harmless = fit.off_db < HARMLESS_DB
    total = float(np.sum(r**2))
    correlation = float(np.sum(r[:, 1:] * r[:, :-1]) / total) if total > 0.0 else 0.0
    white = correlation * math.sqrt(np.count_nonzero(r)) < MOST_CORRELATION
    if known:
        scale = fit.scale
        likely = gammaincc(fit.dof / 2.0, fit.chi_square / 2.0) > LEAST_PROBABILITY
    else:
        neighbours = float(np.sqrt(np.mean(samples.std[used] ** 2))) * DB_PER_NEPER
        scale = fit.off_db / neighbours
        likely = scale < MOST_SCATTER
    small = white and fit.off_db < WHITE_DB
    if not harmless and not small and not (likely and (white or correlation < ALMOST_WHITE)):
        if likely:
            return "a linear fit leaves residuals that hang together"
        return f"a linear fit misses by {scale:.1f} standard errors"
    inflation = max(1.0, fit.scale) if known else fit.scale
    if not known or fit.scale > 1.0:
        # A scatter learned from few readings is itself uncertain.
        inflation *= float(stdtrit(max(fit.dof, 1), 0.975) / 1.96)
    if not white:
        c = min(correlation, _GREATEST_CORRELATION)
        inflation *= math.sqrt((1.0 + c) / (1.0 - c))
    return inflation


def _clear(fit: Fit, extrema: list[Extremum], inflation: float) -> list[Extremum]:
    """Extrema without those neighbours between which the gain rises by no more than chance."""
    extrema = list(extrema)
    while len(extrema) > 1:
        clear = []
        for left, right in zip(extrema[:-1], extrema[1:], strict=True):
            by = left.by_gain - right.by_gain
            std = math.sqrt(max(float(by @ fit.covariance @ by), 0.0)) * inflation
            clear.append(abs(left.gain_db - right.gain_db) / max(std, 1e-300))
        worst = int(np.argmin(clear))
        if clear[worst] > CLEAR:
            break
        del extrema[worst : worst + 2]
    return extrema


def _fits_near(fit: Fit, one: Extremum, inflation: float) -> bool:
    """Whether the points within a half-width of the extremum alone fit too."""
    zeta = 0.05 if one.section is None else fit.sections[one.section].zeta or 0.05
    away = np.abs(fit.readings.x * fit.readings.f_0 - one.frequency_hz)
    near = fit.residual[:, away <= max(zeta, 1e-3) * one.frequency_hz] / max(1.0, inflation)
    count = int(np.count_nonzero(near))
    chance = gammaincc(count / 2.0, float(np.sum(near**2)) / 2.0) if count else 1.0
    return bool(chance > LEAST_PROBABILITY)


def _covariance(fit: Fit, extrema: list[Extremum], inflation: float) -> Vector:
    if not extrema:
        return np.zeros((0, 0))
    by = np.stack([one.by_frequency for one in extrema])
    return np.asarray(by @ fit.covariance @ by.T) * inflation**2


def _spread(choice: Choice, one: Extremum, std_hz: float) -> tuple[float, float, float]:
    """Standard deviation of frequency, gain and ln zeta over fits that are nearly as good."""
    best = choice.best
    weight, moved = [1.0], [(0.0, 0.0, 0.0)]
    within = max(3.0 * std_hz, _SAME * one.frequency_hz)
    low, high = one.frequency_hz - within, one.frequency_hz + within
    for fit, share in choice.rivals:
        there = [other for other in find_extrema(fit, max(low, 1e-300), high)
                 if other.sign == one.sign]  # fmt: skip
        if not there:
            continue
        other = min(there, key=lambda at: abs(at.frequency_hz - one.frequency_hz))
        zeta = 0.0
        if one.section is not None and other.section is not None:
            zeta = _log_zeta(fit, other.section) - _log_zeta(best, one.section)
        weight.append(share)
        moved.append((other.frequency_hz - one.frequency_hz, other.gain_db - one.gain_db, zeta))
    off = np.sqrt(np.average(np.square(moved), axis=0, weights=weight))
    return float(off[0]), float(off[1]), float(off[2])


def _log_zeta(fit: Fit, section: int) -> float:
    return float(fit.theta[zeta_position(fit, section)])


def _feature(
    fit: Fit, one: Extremum, inflation: float, variance: float, spread: tuple[float, float, float]
) -> Feature:
    gain_variance = float(one.by_gain @ fit.covariance @ one.by_gain) * inflation**2
    zeta = zeta_std = None
    if one.section is not None:
        at = zeta_position(fit, one.section)
        zeta = float(np.exp(fit.theta[at]))
        own = float(fit.covariance[at, at]) * inflation**2
        zeta_std = zeta * math.sqrt(own + spread[2] ** 2)
    return Feature(
        frequency_hz=one.frequency_hz,
        std_hz=math.sqrt(variance),
        gain_db=one.gain_db,
        gain_std_db=math.sqrt(gain_variance + spread[1] ** 2),
        damping_ratio=zeta,
        damping_std=zeta_std,
        method="rational",
    )
