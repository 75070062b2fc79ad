"""Whether a set of causes says of the load what a simpler one says.

Owns that comparison: a damped payload that swings far below all that was
measured is a brake, and a stiff one far above it a heavier load, however well
each is told from nothing. It simulates nothing and names no cause.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from analysis.candidate import Candidate, Effects
from analysis.causes import Hypothesis
from analysis.chart import added_inertias, is_at_load, reflected
from sim.catalogue import CATALOGUE

__all__ = ["is_felt_alike", "plainer_places"]

_ALIKE = 1.0 / 3.0
"""Share of what a set adds at the load that may be left where a simpler one stands in its place:
a tenth, squared, of what it explains better than the plain model."""

_NEARLY = 0.5
"""The same from which on the simpler one is worth a look: the place of many sizes is not known well
while a search goes on. A payload at 198 Hz above 180 that were measured left 0.35, and at 283 Hz,
where it was in the end, 0.1; a heavier load was the truth."""

_NOTHING = 1e-12
"""Of a reflection: nothing is left of less."""

_TOLERANCE = 0.021
"""Of the load's inertia, which cannot be told from what is added: three standard deviations of its
own, and as much of the shaft's stiffness, with which it resonates."""


def is_felt_alike(one: Candidate, simpler: Candidate) -> bool:
    """Whether what a set adds at the load could be that of one with fewer sizes.

    Both must agree in all that is not at the load. Looked at over the frequencies that were
    measured, at the best place of the set and any sizes of the other.
    """
    if _elsewhere(one.hypothesis) != _elsewhere(simpler.hypothesis):
        return False
    if simpler.hypothesis.d >= one.hypothesis.d:
        return False
    return _nearest(one, simpler.hypothesis, simpler.best.place)[1] < _ALIKE


def plainer_places(
    one: Candidate, without: Collection[str] = ()
) -> dict[Effects, NDArray[np.float64]]:
    """Sets that say nearly the same with another cause of fewer sizes at the load; their places.

    None where what is left without any says it, too: that is a part of the set. `without`: effects
    that none of them may have.
    """
    whole, place, found = one.hypothesis, one.best.place, {}
    others = [e for e in CATALOGUE if is_at_load(e) and e not in (*whole.effects, *without)]
    for replaced in filter(is_at_load, whole.effects):
        kept = Hypothesis(whole.unit, tuple(e for e in whole.effects if e != replaced))
        there = whole.part(kept.effects, place)
        if _nearest(one, kept, there)[1] < _NEARLY:
            continue
        for other in others:
            by = Hypothesis(whole.unit, (other,))
            plainer, start = kept.joined(there, by, np.full(by.d - 1, 0.5))
            if plainer.d < whole.d:
                nearest, apart = _nearest(one, plainer, start)
                if apart < _NEARLY:
                    found[plainer.effects] = nearest
    return found


def _nearest(
    one: Candidate, other: Hypothesis, start: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Where (d,) another set adds at the load what is nearest to what one does.

    And the share of that which is left. What is not at the load stays at the start.
    """
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
    at_load = [False, *(is_at_load(effect) for effect, _ in other.parameters)]
    there = np.where(at_load, nearest.x[:-1], start)
    return there, float(np.linalg.norm(nearest.fun) / max(size, _NOTHING))


def _elsewhere(one: Hypothesis) -> Effects:
    """Its effects that are not linear and at the load."""
    return tuple(e for e in one.effects if not is_at_load(e))
