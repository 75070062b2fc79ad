"""Over which distances in its coordinates the response of a hypothesis changes smoothly.

Owns how runs widen what is known of them beforehand (`analysis.emulation.coordinates`). It
compares nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.plane_fits import fit_planes

__all__ = ["learn_width"]

_WIDEST = 4.0
"""How much wider a coordinate along which little changes is believed to be."""

_REACHES: NDArray[np.float64] = 1.3 ** np.arange(4, 16, dtype=np.float64)
_RUNS_PER_COORDINATE = 3.0
_RIDGE = 0.3
_LEAST_VARIANCE = 1e-6
"""How the slopes are found: from the nearest runs that suffice, none steeper than they tell."""

_SHARED = 0.1
"""Share of a channel's middle variance in that of each row: few runs may agree by chance."""


def learn_width(
    coordinates: NDArray[np.float64],
    difference: NDArray[np.float64],
    width: NDArray[np.float64],
    centre: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Widths (k,), wider where the response changes less than along the most telling coordinate.

    `coordinates` (1 or rows, n, k) and `difference` (n, 3, rows) of runs, NaN
    where nothing was observed; how they change is looked at about `centre`
    (1 or rows, 1, k).
    """
    offset = (coordinates - centre) / width
    # Where rows share their coordinates they are one problem with many columns.
    values = np.nan_to_num(difference[:, :2]).transpose(2, 1, 0)
    values = values.reshape(len(offset), -1, len(difference))
    weight, reach = _weigh(np.sum(offset**2, axis=2), _RUNS_PER_COORDINATE * len(width))
    planes = fit_planes(offset, weight, _RIDGE * reach**2, values)
    variance = (planes.squares @ weight[..., None])[..., 0] / weight.sum(axis=1)[:, None]
    channels = variance.reshape(-1, 2)
    shared = channels + _SHARED * np.median(channels, axis=0) + _LEAST_VARIANCE
    slopes = planes.coefficients[..., 1:].reshape(-1, len(width))
    change = np.sqrt(np.mean(slopes**2 / shared.reshape(-1, 1), axis=0))
    return np.asarray(width * np.clip(change.max() / np.maximum(change, 1e-9), 1.0, _WIDEST))


def _weigh(
    distance: NDArray[np.float64], needed: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Weights (p, n) of runs at squared distances, and the reaches (p,) that give enough."""
    weights = np.clip(1.0 - distance / (2.0 * _REACHES[:, None, None]) ** 2, 0.0, None) ** 2
    enough = weights.sum(axis=2) >= needed
    enough[-1] = True
    pick = np.argmax(enough, axis=0)
    return weights[pick, np.arange(len(distance))], _REACHES[pick]
