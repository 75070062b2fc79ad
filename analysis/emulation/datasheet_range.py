"""Where the datasheet values of a hypothesis lie, as far as its runs tell.

Owns the range in which the next runs of it depart from the datasheet. Over a wide tolerance a sharp
resonance does not follow a departure in proportion; over what the measurement leaves open it does.
It simulates nothing and judges nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.likelihood import TEMPERATURE
from analysis.ensemble.runs import DatasheetRange

__all__ = ["datasheet_range", "range_about"]

_FARTHEST = 2.5
"""Standard deviations of the tolerance beyond which no range is centred."""

_WIDE = 2.0
"""Reach in standard deviations of what is left open: what is learned of a size from runs that lie
closer together than that is too sure."""

_DIGITS = 6
"""Places of what is told, in standard deviations of the tolerance. Another compiler, or the same
one another day, computes the ninth otherwise; motion with backlash would be another one by that."""

_TRIES = 2
"""Random steps of a walk per coordinate and reach."""


def datasheet_range(candidate: FittedModel) -> DatasheetRange:
    """The range about the best fit that is left open; no wider than the tolerance.

    The covariance at the best place (Gauss-Newton, likelihood to the power 1 / `TEMPERATURE`), and
    how far the best departures differ between the places that agree about as well.
    """
    surface, best = candidate.surface, candidate.best
    sigmas = surface.sigmas
    slopes = np.where(np.isfinite(best.std), surface.slopes / best.std, 0.0)
    flat = slopes.reshape(len(sigmas), -1)
    precision = np.diag(1.0 / sigmas**2) + flat @ flat.T / TEMPERATURE
    fits = surface.walk(best.place, tries=_TRIES)
    share = surface.shares(fits)
    found = np.array([fit.deviations[: len(sigmas)] for fit in fits])
    across = share @ (found - share @ found) ** 2
    std = np.sqrt(np.diag(np.linalg.inv(precision)) + across)
    return range_about(best.deviations[: len(sigmas)], std, sigmas)


def range_about(
    centre: NDArray[np.float64], std: NDArray[np.float64], sigmas: NDArray[np.float64]
) -> DatasheetRange:
    """The range about departures (k,) along the ways of a unit that are known to `std` (k,).

    `sigmas` (k,): the tolerance along each, which it is no wider than.
    """
    within = np.clip(centre, -_FARTHEST * sigmas, _FARTHEST * sigmas)
    reach = np.minimum(_WIDE * std, sigmas)
    return DatasheetRange(*(np.round(v / sigmas, _DIGITS) * sigmas for v in (within, reach)))
