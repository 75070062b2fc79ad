"""Trying the linear model on a level: which window, which surrounding, and is it to be believed.

Owns the choice of windows and orders and the gate that a fit must pass. It
fits nothing itself (`analysis.resonance.rational_model` does) and reports no feature.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaincc

from analysis.resonance.neighbour_noise import Vector
from analysis.resonance.rational_model import Extremum, Pair, RationalFit, fit_rational
from analysis.resonance.samples import Samples
from daq.frf import DB_PER_NEPER

__all__ = ["LinearReading", "Start", "read_both", "read_one"]

LEAST_PROBABILITY = 1e-3
"""A chi-square less likely than this contradicts the model, or the stated errors."""
MOST_SCATTER = 1.6
"""Residuals may exceed the stated errors by this factor if they are white: cycles of
a sweep are not quite independent. The result's errors grow with it."""
MOST_CORRELATION = 3.0
"""Neighbouring residuals' correlation, in its standard errors, that is still white."""
HARMLESS_DB = 0.02
"""Residuals below this are accepted whatever the stated errors are: they belong to
distant modes of the structure and move an extremum by far less than a step."""
GREATEST_CORRELATION = 0.95
"""Correlation of neighbouring residuals from which errors are inflated no further."""
TOO_FEW = "too few points for a linear fit"
LEAST_POINTS = 6
"""A window with fewer points is not tried."""
HIGHEST_ORDER = {"band": 3, "window": 2}
"""Greatest degree of the surrounding over the whole band, and in a window of it."""
REACHES = (math.inf, 4.0, 3.0, 2.0)
"""Half-windows of a single feature in half-power half-widths."""


@dataclass(frozen=True, slots=True)
class Start:
    """Start values of one feature: sign -1 anti-resonance, +1 resonance; Hz.

    `side` is -1 where the phase falls through an anti-resonance: its zeros lie in
    the right half plane.
    """

    sign: int
    frequency_hz: float
    half_width_hz: float
    side: int

    @property
    def pair(self) -> Pair:
        """Zeros for an anti-resonance, poles for a resonance."""
        zeta = float(np.clip(self.half_width_hz / self.frequency_hz, 0.002, 0.5))
        return Pair(self.frequency_hz, zeta, -self.sign, self.side)


@dataclass(frozen=True, slots=True)
class LinearReading:
    """A believed fit, its extrema in the order of the starts, and its errors' corrections.

    Parameters
    ----------
    inflation
        Factor on all errors: the residuals' scatter over the stated errors.
    misfit_hz
        Standard error of the frequencies for the model not being quite right, Hz.
    """

    fit: RationalFit
    extrema: tuple[Extremum, ...]
    inflation: float
    misfit_hz: float = 0.0

    @property
    def frequency_covariance(self) -> Vector:
        """Covariance of the extrema's frequencies, shape (extrema, extrema), Hz^2."""
        g = np.stack([extremum.gradient for extremum in self.extrema])
        noise = g @ self.fit.covariance @ g.T * self.inflation**2
        return np.asarray(noise + self.misfit_hz**2 * np.eye(len(g)))

    @property
    def std_hz(self) -> float:
        """One standard error of the first extremum's frequency, Hz."""
        return float(np.sqrt(self.frequency_covariance[0, 0]))

    def beside(self, frequency_hz: float, std_hz: float) -> LinearReading:
        """The same, its error widened by what another reading of the one extremum disagrees.

        Only what chance does not explain counts: two readings of the same data
        differ by chance with the difference of their variances.
        """
        moved = (frequency_hz - self.extrema[0].frequency_hz) ** 2
        own = float(self.frequency_covariance[0, 0]) - self.misfit_hz**2
        misfit = max(self.misfit_hz**2, moved - abs(std_hz**2 - own))
        return replace(self, misfit_hz=float(np.sqrt(misfit)))

    def approximate(self, error_hz: float) -> LinearReading:
        """The same with one more error of the frequency added, Hz."""
        return replace(self, misfit_hz=float(np.hypot(self.misfit_hz, error_hz)))


def read_both(samples: Samples, low: Start, high: Start) -> LinearReading | None:
    """One zero pair and one pole pair over the widest window that the model describes."""
    apart = high.frequency_hz - low.frequency_hz
    reading, _ = _best_order(samples, (low, high), HIGHEST_ORDER["band"])
    for share in (1.0, 0.5):
        window = samples.between(
            low.frequency_hz - share * apart, high.frequency_hz + share * apart
        )
        if reading is None and len(window) < len(samples):
            reading, _ = _best_order(window, (low, high), HIGHEST_ORDER["window"])
    return reading


def read_one(
    samples: Samples, start: Start, low_hz: float, high_hz: float
) -> tuple[LinearReading | None, str]:
    """One pair alone, over all that lies within two frequencies or in a window of it.

    A response that one linear model does not describe as a whole need not be
    linear near one extremum either. So several windows are fitted, what the others
    move the extremum beyond chance is added to the error of each, and the one with
    the least error is taken.

    Returns
    -------
    The reading, or None, and why the narrowest window with enough points was refused.
    """
    believed: list[LinearReading] = []
    why = TOO_FEW
    for reach in REACHES:
        half = reach * start.half_width_hz
        window = samples.between(
            max(low_hz, start.frequency_hz - half), min(high_hz, start.frequency_hz + half)
        )
        whole = len(window) == len(samples)
        reading, reason = _best_order(
            window, (start,), HIGHEST_ORDER["band" if whole else "window"]
        )
        why = why if reason == TOO_FEW else reason
        believed += [reading] if reading is not None else []
    alone = [(one.extrema[0].frequency_hz, one.std_hz) for one in believed]
    for k in range(len(believed)):
        for frequency_hz, std_hz in alone[:k] + alone[k + 1 :]:
            believed[k] = believed[k].beside(frequency_hz, std_hz)
    return min(believed, key=lambda one: one.std_hz, default=None), why


def _best_order(
    window: Samples, starts: tuple[Start, ...], highest: int
) -> tuple[LinearReading | None, str]:
    """The believed fit whose order of the surrounding has the best criterion.

    The highest order that the points allow is tried first: where it is not
    believed, no lower one is.
    """
    best: LinearReading | None = None
    why = TOO_FEW
    if len(window) < LEAST_POINTS:
        return None, why
    pairs = tuple(start.pair for start in starts)
    for order in range(highest, 0, -1):
        fit = fit_rational(window, best.fit.pairs if best else pairs, order)
        if fit is None and best is None:
            continue
        if fit is None or (best is not None and fit.criterion >= best.fit.criterion):
            break
        reading, why = _believe(fit, starts)
        if reading is None:
            break
        best = reading
    return best, why


def _believe(fit: RationalFit, starts: tuple[Start, ...]) -> tuple[LinearReading | None, str]:
    """Apply the gate: chi-square and whiteness, then each extremum and the points next to it."""
    known = fit.samples.noise_known
    rms = float(np.sqrt(np.mean((fit.residual[0] * fit.samples.std) ** 2)))
    harmless = rms * DB_PER_NEPER < HARMLESS_DB
    white = fit.whiteness < MOST_CORRELATION
    likely = known and fit.probability > LEAST_PROBABILITY
    if not harmless and not (white and (likely or fit.scale < MOST_SCATTER)):
        if fit.scale < MOST_SCATTER:
            return None, "a linear fit leaves residuals that hang together"
        return None, f"a linear fit misses by {fit.scale:.1f} standard errors"
    inflation = max(1.0, fit.scale) if known else fit.scale
    if not white:
        r = min(fit.correlation, GREATEST_CORRELATION)
        inflation *= float(np.sqrt((1.0 + r) / (1.0 - r)))
    extrema = []
    for start, (low_hz, high_hz) in zip(starts, _bands(fit), strict=True):
        extremum = fit.extremum(low_hz, high_hz, start.sign)
        if extremum is None:
            return None, "the linear fit has no extremum there"
        if not harmless and not _fits_near(fit, extremum, start, max(1.0, inflation)):
            return None, "a linear fit misses the points at the extremum"
        std = np.sqrt(extremum.gradient @ fit.covariance @ extremum.gradient) * inflation
        if not std < start.half_width_hz:
            return None, "a linear fit leaves the extremum undetermined"
        extrema.append(extremum)
    return LinearReading(fit, tuple(extrema), float(inflation)), ""


def _fits_near(fit: RationalFit, extremum: Extremum, start: Start, inflation: float) -> bool:
    """Whether the points within a half-width of the extremum alone fit too."""
    away = np.abs(fit.samples.frequency_hz - extremum.frequency_hz)
    near = fit.residual[:, away <= start.half_width_hz] / inflation
    count = int(np.count_nonzero(near))
    if count == 0:
        return True
    return bool(gammaincc(count / 2.0, float(np.sum(near**2)) / 2.0) > LEAST_PROBABILITY)


def _bands(fit: RationalFit) -> Iterator[tuple[float, float]]:
    """The band in which each extremum is searched: the window, split between two features."""
    ends = fit.samples.frequency_hz[[0, -1]]
    inner = [np.clip(pair.frequency_hz, *ends) for pair in fit.pairs]
    edges = [ends[0], *(np.sqrt(inner[:-1]) * np.sqrt(inner[1:])), ends[1]]
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        yield float(low), float(high)
