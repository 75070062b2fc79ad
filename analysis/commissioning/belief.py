"""What is believed of the values of a drive before it is measured.

Owns the prior of values that nothing has changed: by the record of its commissioning, or by the
tolerances of its datasheet. It compares nothing and simulates nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from analysis.commissioning.coordinates import BACKLASH, RATIO, Coordinates
from analysis.commissioning.response_model import LEAST_STD
from sim.commissioning import Commissioning
from sim.unit import Unit

Vector = NDArray[np.float64]

__all__ = ["CHANGE", "Belief", "believed_by_datasheet", "believed_since_commissioning"]

CHANGE = 0.15
"""Standard deviation of the logarithm of a value that has changed; one coordinate of a belief."""

_NEAREST_END = 0.02
"""A contribution ratio is taken to be no nearer to 0 or 1 than this where it was identified."""


@dataclass(frozen=True, eq=False)
class Belief:
    """The normal distribution of the values of a drive of which nothing has changed.

    `centre` (d,) and `common` (d, d): mean and covariance of the coordinates. `commissioned`:
    whether a commissioning told them, and the contribution ratio of two stages, too.
    """

    coordinates: Coordinates
    centre: Vector
    common: Vector
    commissioned: bool


def believed_since_commissioning(unit: Unit) -> Belief | None:
    """As commissioning left the values; None where that tells too little of them.

    Of two stages or more it must tell the ratio as well. A backlash that was not identified is
    exact.
    """
    known = unit.commissioning
    shared = unit.stages > 1
    if known is None or (shared and RATIO not in known.order):
        return None
    values = unit.parameters
    symbols = [s for s in known.order if values.get(s, 0.0) > 0.0 or (s == RATIO and shared)]
    if not symbols:
        return None
    coordinates = _of_changes(unit, symbols)
    centre = _centre(coordinates, known)
    return Belief(coordinates, centre, _covariance(coordinates, centre, known), True)


def believed_by_datasheet(unit: Unit) -> Belief | None:
    """As the datasheet states them, each by itself; None where all of them are exact.

    Any contribution ratio is as likely as any other.
    """
    held = Coordinates.of(unit)
    if set(held.symbols) <= {RATIO}:
        return None
    coordinates = _of_changes(unit, held.symbols)
    shares = dict(zip(held.symbols, held.shares, strict=True)) | {RATIO: CHANGE}
    stds = np.array([shares.get(symbol, LEAST_STD) / CHANGE for symbol in coordinates.symbols])
    return Belief(coordinates, np.zeros(len(coordinates)), np.diag(stds**2), False)


def _of_changes(unit: Unit, symbols: Sequence[str]) -> Coordinates:
    """These values and the total backlash of one stage.

    Of more stages it takes no part: with that and the ratio open the regression tells neither.
    """
    open_too = unit.stages == 1 and unit.backlash.b_t_deg > 0.0 and BACKLASH not in symbols
    named = (*symbols, BACKLASH) if open_too else tuple(symbols)
    return Coordinates(unit, named, tuple(float("nan") if s == RATIO else CHANGE for s in named))


def _centre(coordinates: Coordinates, known: Commissioning) -> Vector:
    """Coordinates (d,) as they were identified."""
    ratio = 0.5 if known.contribution_ratio is None else known.contribution_ratio
    at = float(ndtri(np.clip(ratio, _NEAREST_END, 1.0 - _NEAREST_END)))
    return np.array([at if symbol == RATIO else 0.0 for symbol in coordinates.symbols])


def _covariance(coordinates: Coordinates, centre: Vector, known: Commissioning) -> Vector:
    """Covariance (d, d) of the coordinates as they were identified."""
    place = {symbol: i for i, symbol in enumerate(known.order)}
    told = np.array([symbol in place for symbol in coordinates.symbols])
    rows = [place[symbol] for symbol in coordinates.symbols if symbol in place]
    slopes = coordinates.slopes(centre)
    found = np.zeros((len(coordinates), len(coordinates)))
    found[np.ix_(told, told)] = np.array(known.covariance)[np.ix_(rows, rows)]
    sizes, ways = np.linalg.eigh(0.5 * (found + found.T) / np.outer(slopes, slopes))
    return (ways * np.maximum(sizes, 0.0)) @ ways.T + np.diag((LEAST_STD / slopes) ** 2)
