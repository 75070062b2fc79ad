"""How large the parameters of a candidate are, and how sure that is.

Owns the step from a candidate's runs to its coordinates with honest errors; the
method is that of the estimate (`analysis.calibration`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.calibration import Calibrated, calibrate
from analysis.candidate import Candidate
from analysis.observation import Observation

__all__ = ["size_candidate"]


def size_candidate(
    candidate: Candidate, observation: Observation, rng: np.random.Generator
) -> Calibrated:
    """Mean (d,) and covariance (d, d) of the coordinates, from runs left out in turn."""
    runs, surface = candidate.population, candidate.surface
    bent = surface.chart is not None and surface.chart.bent.any()
    # The widths of a chart are not those of the places.
    width = runs.places.std(axis=0) + 1e-6 if bent else surface.width
    found = calibrate(observation, runs, width, rng)
    return replace(found, mean=np.clip(found.mean, 0.0, 1.0))
