"""Damping read from half-power points, and the frequency that damping takes away.

Owns the paper's equations (22) to (24) and the search for half-power points.
It fits no model and does not look for the extremum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.errors import AnalysisError

__all__ = [
    "HalfPower",
    "frequency_reduction",
    "measure_half_power",
    "resonance_damping",
]

HALF_POWER_DB = 10.0 * math.log10(2.0)
"""Half-power points lie this far below a maximum, or above a minimum, dB."""
GREATEST_ZETA = math.sqrt(0.5)
"""A second-order response with more damping has no resonance, so (24) has no meaning."""


def resonance_damping(zeta_AR: float, f_AR_hz: float, f_R_hz: float) -> float:
    """Damping ratio at the resonance from that at the anti-resonance, equation (23).

    Returns
    -------
    zeta_R = zeta_AR f_R / f_AR.

    Raises
    ------
    AnalysisError
        If a frequency is not positive or the damping ratio negative, or any is not finite.
    """
    for name, value in (("f_AR", f_AR_hz), ("f_R", f_R_hz)):
        if not (math.isfinite(value) and value > 0.0):
            raise AnalysisError(f"{name} = {value} Hz is not a frequency; give one above 0 Hz")
    if not (math.isfinite(zeta_AR) and zeta_AR >= 0.0):
        raise AnalysisError(f"damping ratio {zeta_AR} has no meaning; give one of 0 or more")
    return zeta_AR * f_R_hz / f_AR_hz


def frequency_reduction(zeta: float) -> float:
    """Share of the undamped frequency that damping takes away, equation (24).

    Returns
    -------
    R = 1 - sqrt(1 - 2 zeta^2), between 0 and 1; not in percent.

    Raises
    ------
    AnalysisError
        If zeta is outside 0 to 1/sqrt(2): beyond it there is no resonance to shift.
    """
    if not 0.0 <= zeta <= GREATEST_ZETA:
        raise AnalysisError(
            f"damping ratio {zeta} is outside 0 to 0.707, where equation (24) holds; "
            "a response with more damping has no resonance"
        )
    return 1.0 - math.sqrt(max(0.0, 1.0 - 2.0 * zeta * zeta))


@dataclass(frozen=True, slots=True)
class HalfPower:
    """Half-power points about an extremum, Hz, each with one standard error.

    A point that the data do not reach is NaN, as is its error.
    """

    extremum_hz: float
    low_hz: float
    high_hz: float
    low_std_hz: float
    high_std_hz: float

    @property
    def damping_ratio(self) -> float:
        """Equation (22); NaN where a point is missing."""
        return (self.high_hz - self.low_hz) / (2.0 * self.extremum_hz)

    @property
    def damping_std(self) -> float:
        """One standard error of the damping ratio."""
        return math.hypot(self.low_std_hz, self.high_std_hz) / (2.0 * self.extremum_hz)


def measure_half_power(
    frequency_hz: NDArray[np.float64],
    gain_db: NDArray[np.float64],
    index: int,
    sign: int,
    gain_std_db: NDArray[np.float64] | None = None,
) -> HalfPower:
    """The half-power points of a response about one of its readings.

    Between readings the gain in dB is taken as linear. The search on each side
    ends at the first crossing.

    Parameters
    ----------
    frequency_hz, gain_db
        The response, shape (points,), ascending, Hz and dB.
    index
        The reading at the extremum.
    sign
        ``+1`` for a maximum (3.01 dB down), ``-1`` for a minimum (3.01 dB up).
    gain_std_db
        Standard errors of the readings, dB; without them the errors are 0.
    """
    above = sign * (gain_db - gain_db[index]) + HALF_POWER_DB
    std = np.zeros_like(gain_db) if gain_std_db is None else gain_std_db

    def crossing(step: int) -> tuple[float, float]:
        k = index
        while 0 <= k + step < above.size:
            if above[k + step] <= 0.0:
                drop = above[k] - above[k + step]
                width = frequency_hz[k + step] - frequency_hz[k]
                error = math.hypot(std[index], max(std[k], std[k + step]))
                at = frequency_hz[k] + width * above[k] / drop
                return float(at), float(abs(width) / drop * error)
            k += step
        return math.nan, math.nan

    (low, low_std), (high, high_std) = crossing(-1), crossing(1)
    return HalfPower(float(frequency_hz[index]), low, high, low_std, high_std)
