"""The meaning given to the analyser's normalised variance, in one place.

The manuals of the 35670A (``XFR:POW:VAR``) and of the SR785 (``MEAS`` 44 and 45) name the
normalised variance of a channel in swept sine and do not define it. Everything that reads
it, or makes it up in simulation, goes through this module. UNVERIFIED on a
real instrument; docs/instrument.md says how to check it there.

The meaning chosen: of the n integrate cycles of a point let c_k be the
complex amplitude of cycle k at the drive frequency. The normalised variance
is the scatter of a single cycle relative to the mean,

    NV = sum |c_k - mean(c)|^2 / ((n - 1) |mean(c)|^2).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from daq.frf import DB_PER_NEPER

__all__ = ["gain_standard_error", "normalised_variance"]


def normalised_variance(cycles: NDArray[np.complex128]) -> float:
    """Scatter of single-cycle amplitudes relative to their mean.

    Parameters
    ----------
    cycles
        Complex amplitude of each integrate cycle, shape (n,).

    Returns
    -------
    float
        NV >= 0, dimensionless; 0 for a single cycle, whose scatter nobody can
        know, and for a mean of exactly 0.
    """
    n = len(cycles)
    if n < 2:
        return 0.0
    mean = np.mean(cycles)
    if mean == 0:
        return 0.0
    scatter = float(np.sum(np.abs(cycles - mean) ** 2)) / (n - 1)
    return scatter / float(np.abs(mean)) ** 2


def gain_standard_error(
    variance_1: float | None, variance_2: float | None, integrate_cycles: int
) -> tuple[float, float] | None:
    """One standard error of a gain from the normalised variances of both channels.

    The mean of n cycles scatters by NV/n relative to itself. The gain is a
    quotient of two means, so the relative variances of the channels add; that
    is an upper bound where a common disturbance moves both. The scatter is
    taken as equal along and across the gain, so each component has half:

        std_rel = sqrt((NV_1 + NV_2) / (2 n)).

    Parameters
    ----------
    variance_1, variance_2
        NV of channels 1 and 2; None where the instrument gave nothing usable.
    integrate_cycles
        Whole cycles n averaged at the point.

    Returns
    -------
    tuple of float, or None
        Standard errors of magnitude (dB) and phase (degrees). None where it
        cannot be known: a channel without a figure, fewer than two cycles, or
        both figures exactly 0, which is also what the display holds where
        nothing was measured.
    """
    if variance_1 is None or variance_2 is None or integrate_cycles < 2:
        return None
    if variance_1 < 0 or variance_2 < 0 or variance_1 + variance_2 == 0:
        return None
    relative = math.sqrt((variance_1 + variance_2) / (2.0 * integrate_cycles))
    return float(DB_PER_NEPER * relative), math.degrees(relative)
