"""How units that are as their datasheet says still differ: a few ways, and how far along each.

Owns the step from a tolerance per datasheet value to the ways in which simulated machines
deviate. Of seventeen values most change a response alike, so that only as many ways are
simulated as change it differently. It simulates no motion and judges nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.linear_response import linear_response
from sim.effect import SOURCE_MOST_VPK, shaft_at_load
from sim.tolerance import response_scales
from sim.unit import Unit

__all__ = ["Deviations", "Spread", "feature_spread", "spread_of"]

Deviations = tuple[tuple[str, float], ...]
"""Relative departures of datasheet values, by symbol."""

_FIRST = ("R_m", "k_t", "J_L", "k_s1", "k_a")
"""These come first, in this order: the stored runs of the shipped units deviate so."""

_MOST = 7
"""Ways at most: as many as the signs of eight groups tell apart."""

_LEAST_EFFECT = 0.003
"""Root mean square of log gain and phase from which on a way counts: a regression over simulated
runs is no better (`analysis.emulation.emulator`)."""

_LEAST = 1e-4
"""Least tolerance that is computed with: what is exact is taken for known to that."""

_PLAY = "b3_deg"
"""A value that a linear response does not show: a way of its own."""

_STEP = 0.01
_POINTS, _BAND = 24, (0.25, 1.6)
"""Frequencies at which responses are compared, between these multiples of the load's on shaft 1."""

_LEVELS = (0.3 * SOURCE_MOST_VPK, 0.8 * SOURCE_MOST_VPK)
_DIGITS = 6
"""Of a way: libraries of linear algebra differ in the last ones."""


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """Ways in which units of one datasheet differ.

    `ways` (k, p): change of each of the `symbols` by a unit of each way, relative; `sigmas` (k,):
    one standard deviation along each; `back` (p, k): coordinates along the ways, of changes;
    `gain`: one standard deviation of what scales the whole response, as a share.
    """

    symbols: tuple[str, ...]
    ways: NDArray[np.float64]
    back: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    gain: float

    def __len__(self) -> int:
        return len(self.sigmas)

    def deviations(self, along: NDArray[np.float64]) -> Deviations:
        """Departures of the datasheet values of a machine at coordinates (k,) along the ways."""
        return tuple((s, float(d)) for s, d in zip(self.symbols, along @ self.ways, strict=True))

    def along(self, deviations: Deviations) -> NDArray[np.float64]:
        """Coordinates (k,) of departures along the ways."""
        known = dict(deviations)
        return np.array([known.get(symbol, 0.0) for symbol in self.symbols]) @ self.back

    def draw(self, rng: np.random.Generator) -> Deviations:
        """Departures of a machine by chance."""
        return self.deviations(rng.standard_normal(len(self)) * self.sigmas)


def spread_of(unit: Unit) -> Spread:
    """How units of a datasheet differ by the tolerance that is believed of it.

    Up to seven values with a tolerance are ways of their own. Of more, the ways are the principal
    directions of the linear response, friction as its describing function, in values each
    measured by its tolerance; those along which it hardly changes are left out. The play of a third
    stage, which no linear response shows, is a way of its own.
    """
    return _spread_of(_Key(unit))


def feature_spread(unit: Unit) -> tuple[float, float]:
    """Spread of a unit's own frequencies, as a share, and of its gain, as a share.

    The frequencies go with the root of a stiffness over an inertia; the gain with the drive's
    torque over the motor's inertia, and the tachometer.
    """
    shares = unit.tolerances
    frequency = 0.5 * math.hypot(shares["J_L"], shares["k_s1"])
    scales = ("k_a", "k_t", "R_m", "J_m", "k_ts", "filter_numerator")
    return frequency, math.hypot(*(shares.get(s, 0.0) for s in scales))


class _Key:
    """A unit as what its spread depends on."""

    def __init__(self, unit: Unit) -> None:
        self.unit = unit
        self._known = repr((unit.physics, sorted(unit.tolerances.items())))

    def __hash__(self) -> int:
        return hash(self._known)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self._known == other._known


@lru_cache(maxsize=64)
def _spread_of(key: _Key) -> Spread:
    unit, shares, scales = key.unit, key.unit.tolerances, response_scales(key.unit)
    symbols = [s for s in _FIRST if s in shares]
    symbols += [s for s in shares if s not in (*_FIRST, *scales)]
    symbols = [s for s in symbols if shares[s] > 0.0] or [_FIRST[0]]
    tolerance = np.array([max(shares[s], _LEAST) for s in symbols])
    gain = max(math.hypot(*(shares.get(s, 0.0) for s in scales)), _LEAST)
    if len(symbols) <= _MOST:
        every = np.eye(len(symbols))
        return Spread(tuple(symbols), every, every, tolerance, gain)
    _, effects, across = np.linalg.svd(_sensitivities(unit, symbols) * tolerance)
    own = np.eye(len(symbols))[[symbol == _PLAY for symbol in symbols]]
    count = int(np.clip(np.count_nonzero(effects >= _LEAST_EFFECT), 1, _MOST - len(own)))
    # A direction has no sign of its own.
    turned = across[:count] * np.sign(across[:count].sum(axis=1))[:, None]
    turned = np.vstack([np.round(turned, _DIGITS), own])
    sigmas = np.linalg.norm(turned * tolerance, axis=1)
    ways = turned * tolerance / sigmas[:, None]
    back = (turned / tolerance).T * sigmas
    return Spread(tuple(symbols), ways, back, sigmas, gain)


def _sensitivities(unit: Unit, symbols: list[str]) -> NDArray[np.float64]:
    """Change of log gain and phase (rows, p) by a unit of each symbol, over root of the rows."""
    known = unit.parameters
    load_hz = math.sqrt(shaft_at_load(unit) / unit.load.J_L) / (2.0 * math.pi)
    frequency_hz = load_hz * np.geomspace(*_BAND, _POINTS)
    plain = linear_response(unit, frequency_hz, _LEVELS)
    columns = []
    for symbol in symbols:
        off = linear_response(
            unit.with_parameters(**{symbol: (1.0 + _STEP) * known[symbol]}), frequency_hz, _LEVELS
        )
        change = np.log(off / plain) / _STEP
        columns.append(np.concatenate([change.real, change.imag]))
    return np.stack(columns, axis=1) / math.sqrt(len(plain))
