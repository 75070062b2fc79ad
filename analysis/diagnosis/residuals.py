"""Where a simulation departs from a measurement: bands, levels, gain or phase.

Owns the table of departures and what they look like as a whole. A band's mean
departure is held against how single runs of the same model depart in that
band, chaotic stretches and all; many bands are looked at, so that false
discoveries are controlled. It names no cause.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from analysis.emulation.fitted_model import FittedModel
from analysis.observation.observation import Observation
from daq.frf import DB_PER_NEPER

__all__ = ["Residual", "describe_residuals", "find_residuals"]

_BANDS = 8
_FALSE_DISCOVERIES = 0.05
_NEAR = 60


@dataclass(frozen=True, slots=True)
class Residual:
    """One band of one level of one sweep in which measured minus simulated is not chance.

    `mean` in dB (gain) or degrees (phase); `sigma`: in standard deviations of
    what single runs and the reading scatter there. `sweep`: which of several,
    from 0; None where there is one.
    """

    low_hz: float
    high_hz: float
    source_vpk: float
    quantity: Literal["gain", "phase"]
    mean: float
    sigma: float
    sweep: int | None = None

    def to_json(self) -> dict[str, Any]:
        """One entry of ``residual``; the sweep only where there are several."""
        return {
            **({} if self.sweep is None else {"sweep": self.sweep}),
            "band_hz": [self.low_hz, self.high_hz],
            "source_vpk": self.source_vpk,
            "quantity": self.quantity,
            "mean": self.mean,
            "sigma": self.sigma,
        }


def find_residuals(candidate: FittedModel, observation: Observation) -> tuple[Residual, ...]:
    """Departures of the measurement from a hypothesis at its best place, strongest first."""
    residual = candidate.best.residual
    runs = _scatter_of_runs(candidate)
    found, chance = [], []
    for block in observation.blocks:
        for band in np.array_split(np.arange(block.start, block.stop), _BANDS):
            for channel, quantity, factor in ((0, "gain", DB_PER_NEPER), (1, "phase", 180 / np.pi)):
                read = band[np.isfinite(residual[channel, band])]
                # Half of it speaks for a band, and no less.
                if len(read) == 0 or 2 * len(read) < len(band):
                    continue
                mean = float(residual[channel, read].mean())
                spread = runs[:, channel, read].mean(axis=1).std(ddof=1)
                noise = np.sqrt(np.sum(observation.noise[read] ** 2)) / len(read)
                sigma = mean / float(np.hypot(spread, noise))
                found.append(
                    Residual(
                        float(observation.frequency_hz[band[0]]),
                        float(observation.frequency_hz[band[-1]]),
                        float(observation.source_vpk[band[0]]),
                        quantity,  # type: ignore[arg-type]
                        factor * mean,
                        sigma,
                        _sweep_of(int(band[0]), observation),
                    )
                )
                chance.append(2.0 * float(stdtr(len(runs) - 1, -abs(sigma))))
    if not found:
        return ()
    # Half a second to load, which whoever only imports a diagnosis does not need.
    from scipy.stats import false_discovery_control

    kept = false_discovery_control(chance) <= _FALSE_DISCOVERIES
    real = [one for one, keep in zip(found, kept, strict=True) if keep]
    return tuple(sorted(real, key=lambda one: -abs(one.sigma)))


def _sweep_of(row: int, observation: Observation) -> int | None:
    """Which sweep a row belongs to, where there are several."""
    if len(observation.plans) == 1:
        return None
    return next(n for n, (_, rows) in enumerate(observation.plans) if row in rows)


def _scatter_of_runs(candidate: FittedModel) -> NDArray[np.float64]:
    """(near, 3, rows): runs near the best place less what is expected at their own places."""
    surface, best = candidate.surface, candidate.best
    distance = surface.distance(best.place)
    near = np.argsort(distance, kind="stable")[:_NEAR]
    return np.stack([surface.difference[i] - surface.expected(surface.places[i])[0] for i in near])


def describe_residuals(departures: tuple[Residual, ...], observation: Observation) -> str:
    """One sentence on the shape of what is left, for a person who has to go on from there."""
    if not departures:
        return "no band departs by itself by more than chance"
    worst = departures[0]
    unit = "dB" if worst.quantity == "gain" else "deg"
    band = f"{worst.low_hz:.4g} to {worst.high_hz:.4g} Hz and {worst.source_vpk:.4g} V"
    where = "" if worst.sweep is None else f" of sweep {worst.sweep + 1}"
    bands = "1 band" if len(departures) == 1 else f"{len(departures)} bands"
    return (
        f"{_what(departures, observation)} in {bands}{_at_levels(departures, observation)}; "
        f"most at {band}{where}, where the {worst.quantity} is {worst.mean:+.2g} {unit} off "
        f"({abs(worst.sigma):.0f} sigma)"
    )


def _what(departures: tuple[Residual, ...], observation: Observation) -> str:
    """Whether gain, phase or both depart; a phase that was not read agrees with nothing."""
    quantities = {one.quantity for one in departures}
    if len(quantities) == 2:
        return "gain and phase depart"
    (quantity,) = quantities
    if not np.any(np.isfinite(observation.values[1])):
        return f"the {quantity} departs"
    return f"the {quantity} alone departs"


def _at_levels(departures: tuple[Residual, ...], observation: Observation) -> str:
    """How departures go with the level, where there are several."""
    levels = np.unique(observation.source_vpk)
    count = np.array([sum(one.source_vpk == level for one in departures) for level in levels])
    if len(levels) == 1:
        return ""
    at = [f"{level:.4g} V" for level in levels[count > 0]]
    if len(at) < len(levels):
        return f", at {' and '.join(at)} alone"
    if count[-1] >= 2 * count[0]:
        return ", mostly at high source levels"
    if count[0] >= 2 * count[-1]:
        return ", mostly at low source levels"
    return ", at all source levels alike"
