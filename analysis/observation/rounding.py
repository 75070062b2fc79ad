"""A response to as many digits as every file format keeps.

Owns the rounding that makes equal readings equal numbers. A CSV holds decibels and degrees, an
HDF5 file the complex gain; converting one into the other changes the last digit, and motion with
play turns that into another simulated run. It knows no file format.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from daq.frf import FrequencyResponse

__all__ = ["settled"]

_DECIMALS = 7
"""Of the logarithm of a gain and of its phase in rad: 1e-6 dB, hundreds of times less than an
analyser resolves, and a hundred thousand times more than a conversion changes."""


def settled(response: FrequencyResponse) -> FrequencyResponse:
    """The response with log gain and phase rounded; what is zero or no number stays."""
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log(response.gain)
        gain = np.exp(np.round(np.real(logs), _DECIMALS) + 1j * np.round(np.imag(logs), _DECIMALS))
    usable = np.isfinite(logs)
    return replace(response, gain=np.where(usable, gain, response.gain))
