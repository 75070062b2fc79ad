"""Over which distances in its coordinates the response of a hypothesis changes smoothly.

Owns these widths: what is known of them beforehand, and how runs widen them.
It compares nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.causes import Hypothesis

__all__ = ["learn_width", "plain_width"]

_RATIO, _SIZE = 0.08, 0.06
_SIZES = {"f_p": 0.02, "zeta_p": 0.15}
"""Widths near the answer, in coordinates: a resonance is narrow, and what damps it matters
little."""

_WIDEST = 4.0
"""How much wider a coordinate along which little changes is believed to be."""

_REACHES: NDArray[np.float64] = 1.3 ** np.arange(4, 16, dtype=np.float64)
_RUNS_PER_COORDINATE = 3.0
_RIDGE = 0.3
_LEAST_VARIANCE = 1e-6
"""How the slopes are found: from the nearest runs that suffice, none steeper than they tell."""

_SHARED = 0.1
"""Share of a channel's middle variance in that of each row: few runs may agree by chance."""


def plain_width(hypothesis: Hypothesis) -> NDArray[np.float64]:
    """Widths (d,) as known before anything was simulated."""
    names = [parameter.name for _, parameter in hypothesis.parameters]
    return np.array([_RATIO, *(_SIZES.get(name, _SIZE) for name in names)])


def learn_width(
    places: NDArray[np.float64],
    difference: NDArray[np.float64],
    width: NDArray[np.float64],
    centre: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Widths (d,), wider where the response changes less than along the most telling coordinate.

    `places` (n, d), `difference` (n, 3, rows) of runs, NaN where nothing was
    observed; how they change is looked at about `centre` (d,).
    """
    offset = (places - centre) / width
    basis = np.column_stack([np.ones(len(offset)), offset])
    values = np.nan_to_num(difference[:, :2]).reshape(len(offset), -1)
    distance = np.sum(offset**2, axis=1)
    needed = _RUNS_PER_COORDINATE * len(width)
    for reach in _REACHES:
        weight = np.clip(1.0 - distance / (2.0 * reach) ** 2, 0.0, None) ** 2
        if weight.sum() >= needed:
            break
    ridge = np.full(basis.shape[1], _RIDGE * reach**2)
    ridge[0] = 1e-9
    weighed = basis.T * weight
    slopes = np.linalg.solve(weighed @ basis + np.diag(ridge), weighed @ values)
    variance = weight @ (values - basis @ slopes) ** 2 / weight.sum()
    middle = np.median(variance.reshape(2, -1), axis=1)
    variance += _SHARED * np.repeat(middle, values.shape[1] // 2) + _LEAST_VARIANCE
    change = np.sqrt(np.mean(slopes[1:] ** 2 / variance, axis=1))
    return np.asarray(width * np.clip(change.max() / np.maximum(change, 1e-9), 1.0, _WIDEST))
