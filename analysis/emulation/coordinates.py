"""The coordinates in which runs of a hypothesis are compared, at every frequency.

Owns what is known beforehand of a resonance: whatever hangs on the load and is
linear is felt, at one frequency, as one complex inertia. Payloads that are
felt alike at a frequency do alike there, however their sizes differ; a
regression over that number is smooth where one over the sizes is not. It holds no runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.model import Hypothesis
from sim.catalogue import CATALOGUE

__all__ = ["FeatureMap", "added_inertias", "is_at_load", "reflected", "reflections"]

_RATIO, _SIZE, _REFLECTED = 0.08, 0.06, 0.16
"""Widths near the answer: of the ratio, of a size, of a reflection."""

_PARTS = 2
"""Of a complex number."""


@dataclass(frozen=True, eq=False)
class FeatureMap:
    """How places of a hypothesis look at the rows of an observation.

    Where what is at the load has more than two sizes, the two parts of a complex number
    stand in for them, last; else coordinates are the place itself.

    `frequency_hz` (rows,).
    """

    hypothesis: Hypothesis
    frequency_hz: NDArray[np.float64]

    @cached_property
    def bent(self) -> NDArray[np.bool_]:
        """(d,): which coordinates of a place are replaced."""
        at_load = [is_at_load(e) for e, _ in self.hypothesis.parameters]
        return np.array([False, *at_load]) & (sum(at_load) > _PARTS)

    @property
    def width(self) -> NDArray[np.float64]:
        """Distance (k,) over which a response is known to change smoothly beforehand."""
        kept = int(np.count_nonzero(~self.bent)) - 1
        return np.array([_RATIO, *[_SIZE] * kept, *[_REFLECTED] * (_PARTS * int(self.bent.any()))])

    def __call__(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Coordinates (1 or rows, m, k) of places (m, d): one for all rows where they are alike."""
        if not self.bent.any():
            return places[None]
        kept = places[:, ~self.bent]
        felt = reflections(self.hypothesis, places, self.frequency_hz).T
        beside = np.broadcast_to(kept, (*felt.shape, kept.shape[1]))
        return np.concatenate([beside, felt.real[..., None], felt.imag[..., None]], axis=2)


def is_at_load(effect: str) -> bool:
    """Whether an effect is linear, and at the load."""
    return CATALOGUE[effect].added_inertia is not None


def reflections(
    hypothesis: Hypothesis, places: NDArray[np.float64], frequency_hz: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """What is at the load, as a reflection (m, rows) of its motion, for places (m, d).

    An inertia J besides that of the datasheet is (i J - J_L) / (i J + J_L), J complex where it
    brakes or resonates. Without gain of energy that lies inside the unit circle: -1 is
    nothing, 1 holds the load fast.
    """
    return reflected(added_inertias(hypothesis, places, frequency_hz))


def reflected(inertia: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """What is reflected by so many times the load's own inertia besides it."""
    return np.asarray((1j * inertia - 1.0) / (1j * inertia + 1.0))


def added_inertias(
    hypothesis: Hypothesis, places: NDArray[np.float64], frequency_hz: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """By how many times its own inertia the load is felt to have more (m, rows)."""
    omega, unit = 2.0 * np.pi * frequency_hz, hypothesis.unit
    values = np.exp(hypothesis.logs[:, 0] + np.ptp(hypothesis.logs, axis=1) * places[:, 1:])
    added = np.zeros((len(places), len(omega)), dtype=complex)
    for effect in hypothesis.effects:
        of = CATALOGUE[effect].added_inertia
        if of is not None:
            sizes = {
                p.name: values[:, [at]]
                for at, (owner, p) in enumerate(hypothesis.parameters)
                if owner == effect
            }
            added += of(unit, sizes, omega)
    return np.asarray(added / unit.load.J_L, dtype=complex)
