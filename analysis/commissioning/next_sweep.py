"""The sweep that would tell most of what the first ones leave open.

Owns a grid of sweeps within the unit's limits and the choice among them, by the expected reduction
of the posterior's entropy (D-optimal design: Fedorov 1972). Sensitivities are those of the linear
response with describing functions. It simulates no motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.commissioning.coordinates import RATIO, Coordinates
from analysis.commissioning.regression import Gaussian
from analysis.ensemble.linear_response import linear_response
from analysis.observation.observation import Observation
from sim.unit import Unit

__all__ = ["NextSweep", "propose_next_sweep"]

_POINTS = 31
_LEVELS = ((0.1, 0.2), (0.2, 0.4), (0.4, 0.8), (0.2, 0.8))
"""Pairs of source levels, as shares of what the unit may be given."""

_BANDS = ((0.0, 0.5), (0.25, 0.75), (0.5, 1.0), (0.0, 1.0))
"""Bands, as shares of the logarithm of what the unit may be driven in."""

_ERROR = 0.05
"""Standard deviation of log gain and phase (rad) of a point about the model: run to run, and what
a linear model misses. That of drives simulated about one response is 0.02 to 0.1."""

_STEP = 0.01
_WORTHWHILE = 0.8
"""A sweep is proposed where it would leave some parameter less than this share of its error."""


@dataclass(frozen=True, slots=True)
class NextSweep:
    """A sweep, and the error of each parameter (share of its value) that it would leave.

    `gains`: symbol, error now and expected error, most reduced first.
    """

    levels_vpk: tuple[float, ...]
    start_hz: float
    stop_hz: float
    gains: tuple[tuple[str, float, float], ...]

    def to_json(self) -> dict[str, Any]:
        """The entry ``next_sweep`` of the document."""
        return {
            "levels_vpk": list(self.levels_vpk),
            "start_hz": self.start_hz,
            "stop_hz": self.stop_hz,
            "points": _POINTS,
            "expected": {s: {"std_share": now, "then": then} for s, now, then in self.gains},
        }

    def lines(self) -> list[str]:
        """Lines of text for a person."""
        levels = " and ".join(f"{level:g}" for level in self.levels_vpk)
        told = ", ".join(
            f"{s} {100 * now:.2g} -> {100 * then:.2g} %" for s, now, then in self.gains[:4]
        )
        return [
            f"  next sweep: {_POINTS} points from {self.start_hz:.4g} to {self.stop_hz:.4g} Hz at "
            f"{levels} V; expected {told}"
        ]


def propose_next_sweep(
    coordinates: Coordinates, posterior: Gaussian, observation: Observation
) -> NextSweep | None:
    """The sweep with the largest expected information gain; None where none is worth its while."""
    known = [s for s in coordinates.symbols if s not in (RATIO, "b_t_deg")]
    at = [coordinates.symbols.index(s) for s in known]
    values = coordinates.values(posterior.mean)
    unit = coordinates.unit.with_parameters(**{s: values[s] for s in known})
    shares = coordinates.slopes(posterior.mean)[at]
    now = posterior.covariance[np.ix_(at, at)]
    information = np.linalg.inv(now)
    best: tuple[float, NDArray[np.float64], tuple[float, ...], float, float] | None = None
    for levels, start_hz, stop_hz in _sweeps(unit):
        s = _sensitivities(unit, known, shares, np.geomspace(start_hz, stop_hz, _POINTS), levels)
        told = information + s.T @ s / _ERROR**2
        gain = float(np.linalg.slogdet(told)[1])
        if best is None or gain > best[0]:
            best = gain, np.sqrt(np.diag(np.linalg.inv(told))), levels, start_hz, stop_hz
    assert best is not None
    _, then, levels, start_hz, stop_hz = best
    std = np.sqrt(np.diag(now))
    order = np.argsort(then / std)
    gains = tuple((known[i], float(shares[i] * std[i]), float(shares[i] * then[i]))
                  for i in order if then[i] < _WORTHWHILE * std[i])  # fmt: skip
    if not gains:
        return None
    return NextSweep(levels, round(start_hz, 1), round(stop_hz, 1), gains)


def _sweeps(unit: Unit) -> Iterator[tuple[tuple[float, ...], float, float]]:
    low, high = np.log(unit.limits.start_hz), np.log(unit.limits.stop_hz)
    for levels in _LEVELS:
        for first, last in _BANDS:
            ends = np.exp([low + first * (high - low), low + last * (high - low)])
            yield (
                tuple(float(f"{share * unit.limits.source_vpk:.2g}") for share in levels),
                float(ends[0]),
                float(ends[1]),
            )


def _sensitivities(
    unit: Unit,
    symbols: list[str],
    shares: NDArray[np.float64],
    frequency_hz: NDArray[np.float64],
    levels: tuple[float, ...],
) -> NDArray[np.float64]:
    """Change of log gain and phase (rows, d) by each coordinate."""
    plain, values = linear_response(unit, frequency_hz, levels), unit.parameters
    columns = []
    for symbol in symbols:
        off = unit.with_parameters(**{symbol: (1.0 + _STEP) * values[symbol]})
        change = np.log(linear_response(off, frequency_hz, levels) / plain) / _STEP
        columns.append(np.concatenate([change.real, change.imag]))
    return np.stack(columns, axis=1) * shares
