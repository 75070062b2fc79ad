"""Over which distances in its coordinates the response of a hypothesis changes smoothly.

Owns how runs widen what is known of them beforehand (`analysis.chart`). It
compares nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
    count, n, k = offset.shape
    basis = np.concatenate([np.ones((count, n, 1)), offset], axis=2)
    # Gain and phase: all rows are one problem where they share their coordinates.
    values = np.nan_to_num(difference[:, :2]).transpose(2, 0, 1)
    values = values if count > 1 else values.transpose(1, 2, 0).reshape(1, n, -1)
    weight, reach = _weigh(np.sum(offset**2, axis=2), _RUNS_PER_COORDINATE * k)
    ridge = np.zeros((count, k + 1))
    ridge[:, 0], ridge[:, 1:] = 1e-9, _RIDGE * reach[:, None] ** 2
    weighed = (basis * weight[..., None]).transpose(0, 2, 1)
    normal = weighed @ basis + ridge[:, :, None] * np.eye(k + 1)
    slopes = np.linalg.solve(normal, weighed @ values)
    squares = (values - basis @ slopes) ** 2
    variance = (weight[:, None] @ squares)[:, 0] / weight.sum(axis=1)[:, None]
    channels = variance if count > 1 else variance.reshape(2, -1).T
    shared = channels + _SHARED * np.median(channels, axis=0) + _LEAST_VARIANCE
    variance = shared if count > 1 else shared.T.reshape(1, -1)
    change = np.sqrt(np.mean(slopes[:, 1:] ** 2 / variance[:, None], axis=(0, 2)))
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
