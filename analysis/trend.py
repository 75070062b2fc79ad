"""How an estimated quantity changes from measurement to measurement, with its error.

Owns the straight line through values with error bars over time. What the
values mean, and whether a change matters, is for others to say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daq.errors import InputError

__all__ = ["SECONDS_PER_DAY", "Trend", "fit_trend"]

_SURELY = 1.96
"""Standard errors from which on a slope is one."""

SECONDS_PER_DAY = 86400.0


@dataclass(frozen=True, slots=True)
class Trend:
    """A line through values over time.

    Parameters
    ----------
    mean, mean_std
        Weighted mean of the values and one standard error.
    slope_per_day, slope_std
        Change per day and one standard error; None where fewer than two
        moments or no error bars leave it open.
    chi2, degrees
        Squared distance of the values from the line (or from the mean where
        there is no slope) in units of their errors, and degrees of freedom.
    """

    mean: float
    mean_std: float
    slope_per_day: float | None
    slope_std: float | None
    chi2: float
    degrees: int
    middle_s: float
    """Moment at which the line passes through the mean."""

    def reaches(self, lower: float | None, upper: float | None) -> tuple[float, float] | None:
        """When the line meets the limit that it moves towards.

        Parameters
        ----------
        lower, upper
            Limits of the quantity; None where there is none.

        Returns
        -------
        tuple or None
            The limit and the moment in s, by the origin of the times. None if the slope is not
            significantly different from 0 (95 %), or no limit lies that way.
        """
        if self.slope_per_day is None or self.slope_std is None:
            return None
        if abs(self.slope_per_day) <= _SURELY * self.slope_std:
            return None
        limit = upper if self.slope_per_day > 0 else lower
        if limit is None:
            return None
        days = (limit - self.mean) / self.slope_per_day
        return limit, self.middle_s + days * SECONDS_PER_DAY


def fit_trend(
    times_s: Sequence[float], values: Sequence[float], stds: Sequence[float]
) -> Trend | None:
    """Fit a straight line by weighted least squares.

    Parameters
    ----------
    times_s
        Moments in s, any origin, shape (n,).
    values, stds
        Values and one standard error each, shape (n,); errors above 0.

    Returns
    -------
    Trend or None
        None without a single value.

    Raises
    ------
    InputError
        If the lists differ in length or an error is not above 0.
    """
    if not len(times_s) == len(values) == len(stds):
        raise InputError("trend: times, values and errors differ in number")
    if len(values) == 0:
        return None
    times, y, std = (np.asarray(column, dtype=float) for column in (times_s, values, stds))
    if not np.all(np.isfinite(times) & np.isfinite(y) & np.isfinite(std) & (std > 0)):
        raise InputError("trend: every value needs a moment, and an error above 0")
    # From the first moment on, so that a far origin costs no digits.
    days, weight = (times - times.min()) / SECONDS_PER_DAY, 1.0 / np.square(std)
    total = float(weight.sum())
    mean, middle = float(weight @ y / total), float(weight @ days / total)
    middle_s = float(times.min()) + middle * SECONDS_PER_DAY
    if not np.any(days):
        chi2 = float(weight @ np.square(y - mean))
        return Trend(mean, total**-0.5, None, None, chi2, len(y) - 1, middle_s)
    spread = float(weight @ np.square(days - middle))
    slope = float(weight @ ((days - middle) * y) / spread)
    chi2 = float(weight @ np.square(y - mean - slope * (days - middle)))
    return Trend(mean, total**-0.5, slope, spread**-0.5, chi2, len(y) - 2, middle_s)
