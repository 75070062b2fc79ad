"""Minima and maxima of a fitted gain, and the zeros and poles that make them.

Owns where the extrema are, their derivatives by the parameters, and which pair belongs to which.
It fits nothing and states no error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.resonance.linear_model.fitting import Fit
from analysis.resonance.linear_model.sections import evaluate, positions
from analysis.resonance.neighbour_noise import Vector
from daq.frf import DB_PER_NEPER

__all__ = ["Extremum", "find_extrema"]

MOST_ZETA = np.sqrt(0.5)
"""A pair with more damping makes no minimum or maximum of its own."""
_NEAR = 0.05
"""A pair belongs to an extremum within this in ln f, or within twice its damping ratio."""


@dataclass(frozen=True, slots=True)
class Extremum:
    """A minimum (sign -1) or maximum (+1) of the fitted gain.

    Parameters
    ----------
    section
        Index of the pair that makes it; None where there is none.
    by_frequency, by_gain
        Derivatives of frequency (Hz) and gain (dB) by the fit's parameters.
    """

    sign: int
    frequency_hz: float
    gain_db: float
    section: int | None
    by_frequency: Vector
    by_gain: Vector


def find_extrema(fit: Fit, low_hz: float, high_hz: float) -> list[Extremum]:
    """Extrema inside a band, ascending."""
    f_0 = fit.readings.f_0
    x = _grid(fit, low_hz / f_0, high_hz / f_0)
    g = evaluate(x, fit.theta, fit.sections)[0].real
    turns = np.flatnonzero((g[1:-1] - g[:-2]) * (g[2:] - g[1:-1]) <= 0.0) + 1
    found: list[Extremum] = []
    for k in turns:
        sign = 1 if g[k] >= g[k - 1] and g[k] >= g[k + 1] else -1
        at = _extremum(fit, x[k - 1], x[k], x[k + 1], sign)
        if at is not None and (not found or at.frequency_hz > found[-1].frequency_hz):
            found.append(at)
    return _with_pairs(fit, found)


def _grid(fit: Fit, low: float, high: float) -> Vector:
    parts = [np.exp(np.linspace(np.log(low), np.log(high), 400))]
    for section in fit.sections:
        if section.zeta is not None and section.zeta < 1.0:
            width = section.w * section.zeta
            parts.append(section.w + width * np.linspace(-3.0, 3.0, 25))
    x = np.unique(np.concatenate(parts))
    return x[(x >= low) & (x <= high)]


def _extremum(fit: Fit, left: float, at: float, right: float, sign: int) -> Extremum | None:
    low, high = left, right
    for _ in range(40):
        thirds = low + (high - low) * np.array([1.0, 2.0]) / 3.0
        g = sign * evaluate(thirds, fit.theta, fit.sections)[0].real
        low, high = (thirds[0], high) if g[0] < g[1] else (low, thirds[1])
        if high - low < 1e-7 * high:
            break
    at = 0.5 * (low + high)
    d = 1e-2 * min(right - at, at - left, 0.02 * at)
    if not d > 0.0:
        return None
    x = np.array([at - d, at, at + d])
    value, jacobian = evaluate(x, fit.theta, fit.sections)
    bend = float(value[0].real - 2.0 * value[1].real + value[2].real) / d**2
    if not bend * sign < 0.0:
        return None
    slope = (jacobian[2].real - jacobian[0].real) / (2.0 * d)
    return Extremum(
        sign=sign,
        frequency_hz=at * fit.readings.f_0,
        gain_db=(float(value[1].real) + fit.readings.log_unit) * DB_PER_NEPER,
        section=None,
        by_frequency=-slope / bend * fit.readings.f_0,
        by_gain=jacobian[1].real * DB_PER_NEPER,
    )


def _with_pairs(fit: Fit, extrema: list[Extremum]) -> list[Extremum]:
    """Each extremum with the nearest pair of its kind; each pair belongs to one."""
    distance = []
    for j, section in enumerate(fit.sections):
        if section.zeta is None or not section.zeta < MOST_ZETA:
            continue
        for k, one in enumerate(extrema):
            apart = abs(np.log(one.frequency_hz / (section.w * fit.readings.f_0)))
            if one.sign == -section.kind and apart < max(_NEAR, 2.0 * section.zeta):
                distance.append((apart / (section.zeta + _NEAR), j, k))
    owner: dict[int, int] = {}
    for _, j, k in sorted(distance):
        if k not in owner and j not in owner.values():
            owner[k] = j
    return [
        Extremum(
            one.sign, one.frequency_hz, one.gain_db, owner.get(k), one.by_frequency, one.by_gain
        )
        for k, one in enumerate(extrema)
    ]


def zeta_position(fit: Fit, section: int) -> int:
    """Where ln zeta of a section stands among the parameters."""
    return positions(fit.sections)[section] + 1
