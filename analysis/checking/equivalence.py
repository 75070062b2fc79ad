"""Whether a set of causes says of the load what a simpler one says.

Owns that comparison: a damped payload that swings far below all that was
measured is a brake, and a stiff one far above it a heavier load, however well
each is told from nothing. It simulates nothing and names no cause.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from analysis.emulation.coordinates import added_inertias, is_at_load, reflected
from analysis.emulation.fitted_model import Effects, FittedModel
from analysis.ensemble.model import Hypothesis

__all__ = ["is_equivalent_at_load"]

_ALIKE = 1.0 / 3.0
"""Share of what a set adds at the load that may be left where a simpler one stands in its place:
a tenth, squared, of what it explains better than the plain model."""

_NOTHING = 1e-12
"""Of a reflection: nothing is left of less."""

_TOLERANCE = 0.021
"""Of the load's inertia, which cannot be told from what is added: three standard deviations of its
own, and as much of the shaft's stiffness, with which it resonates."""


def is_equivalent_at_load(one: FittedModel, simpler: FittedModel) -> bool:
    """Whether what a set adds at the load could be that of one with fewer sizes.

    Both must agree in all that is not at the load. Looked at over the frequencies that were
    measured, at the best place of the set and any sizes of the other.
    """
    if _elsewhere(one.hypothesis) != _elsewhere(simpler.hypothesis):
        return False
    if simpler.hypothesis.d >= one.hypothesis.d:
        return False
    return _left_at_most(one, simpler.hypothesis, simpler.best.place) < _ALIKE


def _left_at_most(one: FittedModel, other: Hypothesis, start: NDArray[np.float64]) -> float:
    """Share of what a set adds at the load that another one leaves, from a start (d,)."""
    frequency_hz = np.unique(one.surface.observation.frequency_hz)
    felt = added_inertias(one.hypothesis, one.best.place[None], frequency_hz)[0]

    def left(free: NDArray[np.float64]) -> NDArray[np.float64]:
        place, own = free[:-1], free[-1]
        added = own + added_inertias(other, place[None], frequency_hz)[0]
        apart = reflected(felt) - reflected(added)
        return np.concatenate([apart.real, apart.imag])

    low, high = np.append(np.zeros(other.d), -_TOLERANCE), np.append(np.ones(other.d), _TOLERANCE)
    begin = np.append(np.clip(start, 0.01, 0.99), 0.0)
    nearest = least_squares(left, begin, bounds=(low, high), x_scale=high - low)
    size = float(np.linalg.norm(reflected(felt) - reflected(0.0 * felt)))
    return float(np.linalg.norm(nearest.fun) / max(size, _NOTHING))


def _elsewhere(one: Hypothesis) -> Effects:
    """Its effects that are not linear and at the load."""
    return tuple(e for e in one.effects if not is_at_load(e))
