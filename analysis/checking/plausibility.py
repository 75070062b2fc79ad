"""Whether a size is where no bench has it, or where none could see it.

Owns what "at the end of a plausible range" and "out of sight" mean:
the cause is another then. It simulates nothing and passes no verdict.
"""

from __future__ import annotations

from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.likelihood import TEMPERATURE
from sim.catalogue import CATALOGUE

__all__ = [
    "EDGE",
    "is_out_of_sight",
    "is_pressed",
]

EDGE = 0.02
"""How near its end, as a share of its range, a size is at the end."""

_INWARDS = 0.05
"""How far inside it is put to see whether it is pressed against that end: whether that costs more
than the heat, as it does not where the size says little."""

_TOWARDS, _AS_GOOD = 0.15, 2.0 * TEMPERATURE
"""How near to an end of its range a datasheet value is that may as well be there, half or twice of
what it should be, and the log-likelihood by which the end must be worse (two standard
deviations). A shaft that hardens is taken for one that is twice as stiff, or more."""


_IN_SIGHT = 2.0
"""By what factor a resonance may lie outside the frequencies that were measured, and its shape tell
it from a load or a brake: one found at 22 Hz, below a band from 100, was a brake, withheld."""


def is_pressed(candidate: FittedModel) -> bool:
    """Whether a size wants to be beyond its plausible range, or may as well be at its end."""
    best, fit = candidate.best, candidate.surface.fit
    for at, amid in enumerate(candidate.hypothesis.amid, start=1):
        inside, beyond = best.place.copy(), best.place.copy()
        inside[at] += _INWARDS if inside[at] < 0.5 else -_INWARDS
        beyond[at] = round(best.place[at])
        off = abs(best.place[at] - beyond[at])
        if off < EDGE and fit(inside).log_likelihood < best.log_likelihood - TEMPERATURE:
            return True
        if amid and off < _TOWARDS and fit(beyond).log_likelihood > best.log_likelihood - _AS_GOOD:
            return True
    return False


def is_out_of_sight(candidate: FittedModel) -> bool:
    """Whether what its best fit is told by is a resonance far outside all that was measured."""
    hypothesis, measured = candidate.hypothesis, candidate.surface.observation.frequency_hz
    low, high = measured.min() / _IN_SIGHT, measured.max() * _IN_SIGHT
    values = zip(hypothesis.parameters, hypothesis.values(candidate.best.place), strict=True)
    return any(
        CATALOGUE[effect].resonance == parameter.name and not low < value < high
        for (effect, parameter), value in values
    )
