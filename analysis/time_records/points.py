"""Points of a response that is estimated from a record.

Owns the noun that every way of estimating returns. It estimates nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.excitation.signal import Excitation

__all__ = ["Points"]


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Gain at frequencies with one standard error along and across it; shapes (points,).

    Parameters
    ----------
    frequency_hz, level_vpk
        Hz; amplitude of the input there, V peak.
    gain
        Complex.
    along, across
        Standard errors of the gain along and across its phasor, as a share of it.
    method
        How it was estimated, in words.
    notes
        What a reader should know, one sentence each.
    """

    frequency_hz: NDArray[np.float64]
    level_vpk: NDArray[np.float64]
    gain: NDArray[np.complex128]
    along: NDArray[np.float64]
    across: NDArray[np.float64]
    method: str
    notes: tuple[str, ...] = ()
    settle_cycles: int | None = None
    integrate_cycles: int | None = None
    coherence: NDArray[np.float64] | None = None
    """Of the input with the output at each frequency, 0 to 1, where it is known."""
    signal: Excitation | None = None
    """What drove the servo, where a simulation can be driven by it."""
