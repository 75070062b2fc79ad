"""The paper's error index, equation (21), with the standard error that the paper left out.

Owns one formula. It extracts no feature and chooses no ratio.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from numpy.typing import ArrayLike, NDArray

__all__ = ["ErrorIndex", "error_index"]

_NODES, _WEIGHTS = hermegauss(24)


class ErrorIndex(NamedTuple):
    """Equation (21) and its standard error, both in Hz and of the same shape."""

    value_hz: NDArray[np.float64]
    std_hz: NDArray[np.float64]


def error_index(
    arf_s_hz: ArrayLike,
    rf_s_hz: ArrayLike,
    arf_e_hz: ArrayLike,
    rf_e_hz: ArrayLike,
    *,
    arf_s_std_hz: ArrayLike = 0.0,
    rf_s_std_hz: ArrayLike = 0.0,
    arf_e_std_hz: ArrayLike = 0.0,
    rf_e_std_hz: ArrayLike = 0.0,
) -> ErrorIndex:
    """Distance between simulated (S) and measured (E) features, equation (21).

    |f_AR,S - f_AR,E| + |f_R,S - f_R,E| + |f_D,S - f_D,E| with f_D = f_R - f_AR.
    All arguments broadcast; frequencies and standard errors in Hz.

    The index has kinks where a misfit changes sign, and there a gradient would
    promise too small an error. So the standard error is the spread of the
    index over normal errors of the features, taken as independent, by
    Gauss-Hermite quadrature in the two misfits. An unknown (NaN) error of any
    feature makes the index's error NaN.
    """
    arf_misfit = np.subtract(arf_s_hz, arf_e_hz)
    rf_misfit = np.subtract(rf_s_hz, rf_e_hz)
    arf_std = np.hypot(arf_s_std_hz, arf_e_std_hz)
    rf_std = np.hypot(rf_s_std_hz, rf_e_std_hz)
    value = _index(arf_misfit, rf_misfit)
    if not (np.any(arf_std) or np.any(rf_std)):
        # Nothing to spread: a diagnosis asks for the index alone, of thousands of runs.
        return ErrorIndex(value, np.zeros(np.shape(value)))
    spread = _index(
        arf_misfit[..., None, None] + arf_std[..., None, None] * _NODES[:, None],
        rf_misfit[..., None, None] + rf_std[..., None, None] * _NODES,
    )
    weights = np.outer(_WEIGHTS, _WEIGHTS) / _WEIGHTS.sum() ** 2
    mean = np.sum(weights * spread, axis=(-2, -1))
    variance = np.sum(weights * (spread - mean[..., None, None]) ** 2, axis=(-2, -1))
    std = np.sqrt(variance)
    return ErrorIndex(value, np.broadcast_to(std, np.shape(value)) if std.ndim == 0 else std)


def _index(arf_misfit: NDArray[np.float64], rf_misfit: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.abs(arf_misfit) + np.abs(rf_misfit) + np.abs(rf_misfit - arf_misfit)
