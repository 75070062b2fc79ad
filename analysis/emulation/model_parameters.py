"""How large the parameters of a candidate are, and how sure that is.

Owns the step from a candidate's runs to its coordinates with honest errors; the
method is that of the estimate (`analysis.emulation.parameter_posterior`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.parameter_posterior import NEAREST, ParameterPosterior, calibrate
from analysis.ensemble.datasheet_spread import spread_of
from analysis.observation.observation import Observation

__all__ = ["estimate_parameters", "widen_if_open"]

_OPEN = 1.5
"""So many times the standard deviation of the ratio is much more; chance makes it a tenth more or
less."""


def estimate_parameters(
    candidate: FittedModel,
    observation: Observation,
    rng: np.random.Generator,
    nearest: int = NEAREST,
) -> ParameterPosterior:
    """Mean (d,) and covariance (d, d) of the coordinates, from runs left out in turn.

    `nearest`: how many of the runs take part where the answer lies.
    """
    runs, width = candidate.population, _width(candidate)
    gain = spread_of(candidate.hypothesis.unit).gain
    return _clipped(calibrate(observation, runs, width, gain, rng, nearest=nearest))


def widen_if_open(
    found: ParameterPosterior,
    candidate: FittedModel,
    observation: Observation,
    rng: np.random.Generator,
    nearest: int = NEAREST,
) -> ParameterPosterior:
    """What was found of a candidate, or what is with more caution where that leaves much more open.

    Rounds place runs ever closer about an answer; where the data say nothing, it seems known.
    """
    runs, width = candidate.population, _width(candidate)
    gain = spread_of(candidate.hypothesis.unit).gain
    open_ = calibrate(observation, runs, width, gain, rng, nearest=nearest, cautious=True)
    wider = np.sqrt(np.diag(open_.covariance) / np.diag(found.covariance))
    return _clipped(open_) if wider[0] > _OPEN else found


def _width(candidate: FittedModel) -> NDArray[np.float64]:
    surface = candidate.surface
    bent = surface.chart is not None and surface.chart.bent.any()
    # The widths of a chart are not those of the places.
    return candidate.population.places.std(axis=0) + 1e-6 if bent else surface.width


def _clipped(found: ParameterPosterior) -> ParameterPosterior:
    return replace(found, mean=np.clip(found.mean, 0.0, 1.0))
