"""The response that an estimator reads from samples of the output, average by average.

Owns the mean over periods and H1 over Hann segments, in the form in which cycles of a sine are
kept: values whose mean is the estimate and whose scatter is its error. It steps nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["h1_values", "lines_of", "period_values"]


def lines_of(samples: NDArray, lines: NDArray[np.int64]) -> NDArray[np.complex128]:
    """Phasors (lines, lanes) of samples (n, lanes) over whole periods, taken from the start.

    A signal is Im(sum_k C_k exp(2 pi i k t / n)); the first sample is that of t = 1.
    """
    n = len(samples)
    spectrum = np.fft.rfft(np.asarray(samples, dtype=float), axis=0)[lines]
    late = np.exp(-2j * np.pi * lines / n)
    return np.asarray(2j / n * late[:, None] * spectrum)


def period_values(
    outputs: NDArray[np.complex128], inputs: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """Gain in each period: `outputs` (periods, points, lanes) over `inputs` (points, lanes)."""
    return np.asarray(outputs / inputs)


def h1_values(
    outputs: NDArray[np.complex128], inputs: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """Values (segments, points, lanes) whose mean is H1, of `outputs` and `inputs` alike.

    Each is H1 and what the residual of its segment adds to it, so that their scatter is that of
    the output which the input does not explain.
    """
    power = np.mean(np.abs(inputs) ** 2, axis=0)
    h1 = np.mean(outputs * np.conj(inputs), axis=0) / power
    return np.asarray(h1 + (outputs - h1 * inputs) * np.conj(inputs) / power)
