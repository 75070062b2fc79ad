"""From samples to complex amplitudes: a lock-in, cycle by cycle, by least squares.

Owns the arithmetic. A cycle need not hold a whole number of samples: offset, fundamental and a
few harmonics are fitted to those that fall into it. It talks to nobody.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["amplitudes", "delay_of"]

_HARMONICS = 5
_LEAST_SAMPLES = 4.0
"""Samples in a period of the highest harmonic that is fitted."""


def amplitudes(
    frames: NDArray[np.float64], first: float, frequency_hz: float, rate_hz: float, cycles: int
) -> NDArray[np.complex128]:
    """Amplitude of each cycle of each channel, relative to a sine that begins at frame 0.

    Parameters
    ----------
    frames
        Volts, shape (n, channels).
    first
        Where the first cycle begins, in frames.
    cycles
        How many follow.

    Returns
    -------
    ndarray of complex128
        V peak, shape (channels, cycles); the phase is that of ``sin(2 pi f n / rate)``.
    """
    per_cycle = rate_hz / frequency_hz
    highest = max(1, min(_HARMONICS, int(per_cycle / _LEAST_SAMPLES)))
    found = np.empty((frames.shape[1], cycles), dtype=complex)
    for cycle in range(cycles):
        low = int(np.ceil(first + cycle * per_cycle - 1e-9))
        high = int(np.ceil(first + (cycle + 1) * per_cycle - 1e-9))
        turns = 2 * np.pi * frequency_hz / rate_hz * np.arange(low, high)
        columns = [np.ones_like(turns)]
        for harmonic in range(1, highest + 1):
            columns += [np.sin(harmonic * turns), np.cos(harmonic * turns)]
        fit, *_ = np.linalg.lstsq(np.column_stack(columns), frames[low:high], rcond=None)
        found[:, cycle] = fit[1] + 1j * fit[2]
    return found


def delay_of(phases: tuple[complex, complex], frequencies_hz: tuple[float, float]) -> float:
    """The delay that explains the phases of one signal at two frequencies, s.

    It is known up to one over their difference; the smallest that is not negative is taken.
    """
    turn = float(np.angle(phases[0] / phases[1])) / (2 * np.pi)
    return (turn % 1.0) / (frequencies_hz[1] - frequencies_hz[0])
