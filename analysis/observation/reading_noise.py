"""How loud the reading itself is: its own noise, beside the scatter of the motion.

Owns what scatter from cycle to cycle says of that noise, and what a point says that drowns in it.
It knows no response and no simulation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "QUIET_SHARE",
    "USUAL_NOISE_V",
    "estimate_noise",
    "noise_and_floor",
    "scatter_sampling",
    "shown_noise",
]

QUIET_SHARE = 0.02
"""Share of the points that are no louder than what counts as the quietest of them."""

_ALIKE = 3.2
"""Points whose quietest are quieter than their median by no more standard deviations of a scatter's
logarithm than this are as quiet as each other: of 75 such points of 12 cycles the quietest are by
2.3 +- 0.4, and a fifth of louder ones among them adds 0.2."""

USUAL_NOISE_V = 5e-4
"""What a bench adds to each component of a reading, where nothing else is known, V."""

_DROWNED, _FLOOR = 0.25, 2.0
"""Noise per component, as a share of the response, from which on a point has drowned: its phase is
chance, and its gain that of noise, which is compared above so many times the noise alone. There a
servo that friction holds, whose simulation moves by nothing, reads as what it is."""


def scatter_sampling(cycles: int) -> float:
    """Relative standard deviation of a standard error along one component, of so many cycles."""
    return float(1.0 / np.sqrt(2.0 * max(cycles - 1, 1)))


def shown_noise(volts: NDArray[np.float64]) -> float:
    """Noise of each component, V, that the quietest points show.

    `volts`: scatter of the readings, V, of both components; the usual noise where none is known.
    """
    known = _known(volts)
    return float(np.quantile(known, QUIET_SHARE) / np.sqrt(2.0)) if known.size else USUAL_NOISE_V


def estimate_noise(volts: NDArray[np.float64], sampling: float) -> float:
    """Noise of each component, V: what the quietest points show, as there the motion repeats.

    Where it repeats at most points, the quietest are so by chance, and the median shows the noise.
    Where it repeats nowhere both are too much (see `analysis.emulation.noise_level`).

    Parameters
    ----------
    volts
        Scatter of the readings, V, of both components.
    sampling
        Its relative standard deviation where the motion repeats, by `scatter_sampling`.
    """
    shown, known = shown_noise(volts), _known(volts)
    middle = float(np.median(known) / np.sqrt(2.0)) if known.size else shown
    return middle if middle < shown * np.exp(_ALIKE * sampling) else shown


def _known(volts: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(volts[np.isfinite(volts) & (volts > 0)])


def noise_and_floor(
    gain: NDArray[np.float64], source_vpk: NDArray[np.float64] | float, noise_v: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Relative noise (rows,) of gains at source levels, V, and their floors: 0 where none drowned.

    `noise_v` is that of each component of the reading, V.
    """
    volts = gain * source_vpk
    drowned = volts < noise_v / _DROWNED
    share = np.where(drowned, _DROWNED, noise_v / np.maximum(volts, 1e-300))
    return share, np.where(drowned, _FLOOR * noise_v / source_vpk, 0.0)
