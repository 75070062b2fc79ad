"""How much the readings of a sweep scatter, told from the readings themselves.

Owns the statistics of neighbouring readings. It knows no features and no files.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Vector", "evened", "neighbour_noise", "neighbour_residual", "running"]

Vector = NDArray[np.float64]

MEDIAN_SQUARE = {1: 0.4549, 2: 0.6931}
"""Median of the mean of one and of two squared standard normals."""
CHANCE = {1: 0.5, 2: 0.3}
"""Variance of the logarithm of a mean over nine overlapping residuals, white noise, with
one and with two channels."""


def running(values: Vector, width: int, statistic: Callable[..., Any]) -> Vector:
    """A statistic over each value and its neighbours; the ends are mirrored."""
    half = min(width, values.size) // 2
    padded = np.pad(values, half, mode="reflect") if half else values
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1)
    return np.asarray(statistic(windows, axis=1))


def evened(log_gain: Vector, std: Vector) -> Vector:
    """Relative errors evened out over five readings, as they are or times the gain.

    A reading that fell low by chance states a large relative error. Weights made
    of such errors would lift every valley, so one reading's luck must not set
    them. Whichever of relative and absolute error runs more smoothly along the
    sweep is the one that is evened.

    Parameters
    ----------
    log_gain, std
        Shape (points,), nepers.
    """
    log_std = np.log(std)
    if np.sum(np.abs(np.diff(log_std))) <= np.sum(np.abs(np.diff(log_std + log_gain))):
        return np.sqrt(running(std**2, 5, np.mean))
    size = np.exp(np.maximum(log_gain - np.max(log_gain), -300.0))
    absolute = np.sqrt(running((std * size) ** 2, 5, np.mean))
    return np.asarray(absolute / np.maximum(size, running(size, 5, np.median)))


def neighbour_residual(frequency: Vector, values: Vector) -> Vector:
    """Distance of each value to the cubic through its four neighbours, over its noise gain.

    White noise of standard deviation s gives residuals of standard deviation s;
    a curve that a cubic follows over four steps gives none. At the ends the four
    nearest neighbours are used. Needs five values or more.
    """
    n = frequency.size
    start = np.clip(np.arange(n) - 2, 0, n - 5)
    window = start[:, None] + np.arange(5)[None, :]
    others = window[window != np.arange(n)[:, None]].reshape(n, 4)
    x = frequency[others]
    x = (x - frequency[:, None]) / (x[:, -1:] - x[:, :1])
    weight = np.ones((n, 4))
    for j in range(4):
        for k in range(4):
            if k != j:
                weight[:, j] *= x[:, k] / (x[:, k] - x[:, j])
    residual = values - np.sum(weight * values[others], axis=1)
    return np.asarray(residual / np.sqrt(1.0 + np.sum(weight**2, axis=1)))


def neighbour_noise(frequency: Vector, channels: Vector) -> Vector:
    """Standard error of each reading from its distance to its neighbours' cubic.

    The local estimates (over about nine readings) are drawn towards one common
    value as far as their spread is no more than chance would give.

    Parameters
    ----------
    frequency
        Shape (points,), six or more.
    channels
        Readings with the same noise, shape (1 or 2, points).
    """
    square = np.mean([neighbour_residual(frequency, c) ** 2 for c in channels], axis=0)
    tiny = np.finfo(float).tiny
    count = len(channels)
    log_local = np.log(np.maximum(running(square, 9, np.mean), tiny))
    spread = float(np.var(log_local))
    trust = max(0.0, spread - CHANCE[count]) / max(spread, tiny)
    common = np.log(max(float(np.median(square)) / MEDIAN_SQUARE[count], tiny))
    return np.asarray(np.exp((common + trust * (log_local - common)) / 2.0))
