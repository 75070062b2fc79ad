"""What a measurement says of each datasheet value, beside what the datasheet said.

Owns a linear update about the answer: departures along the ways of a unit, by the slopes of the
emulator and a tempered likelihood, averaged over the places that the answer leaves open. It
simulates nothing, and changes neither the ratio nor the backlash.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.likelihood import TEMPERATURE, match_prediction
from analysis.emulation.quadratic import TAIL_FREEDOM, Prediction
from analysis.ensemble.datasheet_spread import Spread
from analysis.ensemble.linear_response import linear_response
from analysis.observation.observation import Observation
from sim.tolerance import response_scales
from sim.unit import Unit

__all__ = [
    "DatasheetValue",
    "Departures",
    "datasheet_lines",
    "datasheet_values",
    "find_departures",
    "predicted_departures",
]

Departures = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Mean (k + 1,) and covariance of departures along the ways of a unit, and of the gain, last."""

_DETERMINED = 0.9
"""Standard deviation over the tolerance above which a sweep says nothing of a value."""

_LEAST_EFFECT = 0.01
"""Change of log gain and phase below which a slope of the emulator is that of chance."""

_LEAST_SHARE = 0.1

_TOLD = 6
"""Values told to a person, those first of which most was learned."""


@dataclass(frozen=True, slots=True)
class DatasheetValue:
    """One value: of the datasheet, and by the measurement, SI; `tolerance` and `std` as shares."""

    symbol: str
    datasheet: float
    tolerance: float
    value: float
    std: float

    @property
    def determined(self) -> bool:
        """Whether the measurement says more of it than the datasheet."""
        return self.std <= _DETERMINED * self.tolerance

    def to_json(self) -> dict[str, Any]:
        """Its entry of the document, by its symbol."""
        return {
            "datasheet": self.datasheet,
            "datasheet_std": self.tolerance * abs(self.datasheet),
            "value": self.value,
            "std": self.std * abs(self.datasheet),
            "determined": self.determined,
        }


def datasheet_values(
    unit: Unit,
    observation: Observation,
    spread: Spread,
    used: NDArray[np.bool_],
    places: Sequence[Departures],
) -> tuple[DatasheetValue, ...]:
    """Every value with a tolerance, as the measurement leaves it.

    Parameters
    ----------
    used
        (k,): ways along which machines were simulated; of others nothing is known.
    places
        What is learned at places that the answer leaves open, each as likely.
    """
    means, inner = zip(*places, strict=True)
    mean = np.mean(means, axis=0)
    covariance = np.mean(inner, axis=0) + np.cov(np.array(means).T, ddof=0)
    tolerances, known = unit.tolerances, unit.parameters
    told = used & (_effects(unit, observation, spread) >= _LEAST_EFFECT)
    covariance = covariance[np.ix_([*told[used], True], [*told[used], True])]
    mean = mean[[*told[used], True]]
    sigmas, ways = spread.sigmas[told], spread.ways[told]
    found = []
    for i, symbol in enumerate(spread.symbols):
        tolerance = tolerances.get(symbol, 0.0)
        if tolerance <= 0.0:
            continue
        way = ways[:, i]
        off, left = float(way @ mean[:-1]), float(way @ covariance[:-1, :-1] @ way)
        # What the ways leave out of a value stays as the datasheet has it.
        rest = max(tolerance**2 - float(way**2 @ sigmas**2), 0.0)
        found.append(_value(symbol, known[symbol], tolerance, off, left + rest))
    for symbol in response_scales(unit):
        tolerance = tolerances.get(symbol, 0.0)
        if tolerance > 0.0 and known.get(symbol):
            part = (tolerance / spread.gain) ** 2
            left = part**2 * float(covariance[-1, -1]) + tolerance**2 * (1.0 - part)
            found.append(_value(symbol, known[symbol], tolerance, part * float(mean[-1]), left))
    return tuple(sorted(found, key=lambda one: one.std / one.tolerance))


def _effects(unit: Unit, observation: Observation, spread: Spread) -> NDArray[np.float64]:
    """Change (k,) of log gain and phase by each way, root mean square of the linear response."""
    frequency_hz, known = np.unique(observation.frequency_hz), unit.parameters
    levels = tuple(np.unique(observation.source_vpk).tolist())
    plain = linear_response(unit, frequency_hz, levels)
    found = []
    for way, sigma in zip(spread.ways, spread.sigmas, strict=True):
        changes = {
            symbol: known[symbol] * max(1.0 + part * sigma, _LEAST_SHARE)
            for symbol, part in zip(spread.symbols, way, strict=True)
        }
        change = np.log(linear_response(unit.with_parameters(**changes), frequency_hz, levels))
        found.append(np.sqrt(np.mean(np.abs(change - np.log(plain)) ** 2)))
    return np.array(found)


def datasheet_lines(document: Mapping[str, Any]) -> list[str]:
    """The same in words, of a document that holds it; a value of zero has no share to be told."""
    values = document.get("datasheet") or {}
    told, silent = [], []
    for symbol, one in values.items():
        size = abs(one["datasheet"])
        if not size:
            continue
        if one["determined"]:
            off = 100.0 * (one["value"] - one["datasheet"]) / size
            told.append(
                f"{symbol} {off:+.1f} +- {100.0 * one['std'] / size:.1f} % "
                f"(datasheet +- {100.0 * one['datasheet_std'] / size:.2g} %)"
            )
        else:
            silent.append(symbol)
    lines = [f"measured against the datasheet: {text}" for text in told[:_TOLD]]
    if silent:
        lines.append(f"not determined by this sweep: {', '.join(silent)}")
    return lines


def _value(
    symbol: str, nominal: float, tolerance: float, off: float, variance: float
) -> DatasheetValue:
    return DatasheetValue(
        symbol, nominal, tolerance, nominal * (1.0 + off), float(np.sqrt(max(variance, 0.0)))
    )


def predicted_departures(observation: Observation, prediction: Prediction) -> Departures:
    """What is learned where machines show what was predicted, at the best fit of that."""
    match = match_prediction(observation, prediction)
    return find_departures(
        match.residual, match.std, match.deviations, prediction.slopes, prediction.sigmas
    )


def find_departures(
    residual: NDArray[np.float64],
    std: NDArray[np.float64],
    deviations: NDArray[np.float64],
    slopes: NDArray[np.float64],
    sigmas: NDArray[np.float64],
) -> Departures:
    """What is learned by Gauss-Newton about a best fit.

    The likelihood counts to the power 1 / `TEMPERATURE`: neighbouring points err together.

    Parameters
    ----------
    residual, std
        (3, rows): observed minus expected at the best deviations, and its standard deviation.
    deviations, sigmas
        (k + 1,): the best ones, the gain last, and their prior standard deviations.
    slopes
        (k + 1, 3, rows): change of the channels per unit of each.
    """
    seen = np.isfinite(std) & np.isfinite(residual)
    z = residual[seen] / std[seen]
    trust = (TAIL_FREEDOM + 1.0) / (TAIL_FREEDOM + z**2) / std[seen] ** 2 / TEMPERATURE
    along = slopes[:, seen]
    y = residual[seen] + deviations @ along
    covariance = np.linalg.inv((along * trust) @ along.T + np.diag(1.0 / sigmas**2))
    found = covariance @ ((along * trust) @ y)
    return np.asarray(found, dtype=float), np.asarray(covariance, dtype=float)
