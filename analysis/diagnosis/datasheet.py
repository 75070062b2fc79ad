"""What a diagnosis says of each datasheet value, beside what the datasheet said.

Owns the step from the accepted model and its sizes to what `analysis.estimate` tells of a datasheet
without causes. It simulates nothing.
"""

from __future__ import annotations

import numpy as np

from analysis.emulation.emulator import Emulator
from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.datasheet_spread import spread_of
from analysis.estimate.datasheet_posterior import (
    DatasheetValue,
    Departures,
    datasheet_values,
    find_departures,
)

__all__ = ["learn_datasheet"]


def learn_datasheet(accepted: FittedModel, found: ParameterPosterior) -> tuple[DatasheetValue, ...]:
    """Every value with a tolerance, as the measurement leaves it, but those that are causes.

    Parameters
    ----------
    found
        Ratio and sizes of the accepted model; what they leave open is in the errors.
    """
    surface, unit = accepted.surface, accepted.hypothesis.unit
    spread = spread_of(unit)
    places = found.sigma_points(surface.places.min(axis=0), surface.places.max(axis=0))
    learned = [_departures(surface, place) for place in places]
    values = datasheet_values(
        unit, surface.observation, spread, np.ones(len(spread), dtype=bool), learned
    )
    sized = {parameter.name for _, parameter in accepted.hypothesis.parameters}
    return tuple(one for one in values if one.symbol not in sized)


def _departures(surface: Emulator, place: np.ndarray) -> Departures:
    fit = surface.fit(place)
    gain = np.zeros((1, *fit.residual.shape))
    gain[0, 0] = 1.0
    slopes = np.concatenate([surface.slopes, gain])
    sigmas = np.append(surface.sigmas, surface.gain)
    return find_departures(fit.residual, fit.std, fit.deviations, slopes, sigmas)
