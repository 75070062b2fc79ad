"""How large each cause could be and not show, where nothing was found.

Owns the difference between what is not there and what is not seen. Every cause of an atlas is held
against a measurement by itself, at all ratios, on the few rows that the atlas has: what it cannot
be larger than is what these rows speak against, and the whole measurement may say more. It
simulates nothing, ranks nothing and passes no verdict.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.atlas import Atlas
from analysis.atlas_surfaces import felt_singles, surfaces_of
from analysis.causes import Hypothesis
from analysis.observation import Observation
from analysis.screening import mesh
from analysis.surface import Surface
from analysis.unseen import Unseen
from sim.unit import Unit

__all__ = ["bound_causes"]

_COUNTS = {1: (31,), 2: (31, 61), 3: (21, 31, 7), 4: (11, 13, 9, 3)}
"""Places looked at along each coordinate: the ratio, the size that is asked about, the others."""

_SPOKEN_AGAINST = 10.0
"""Log-likelihood by which the best of a size must lie behind the best of all for the size to be
ruled out. An atlas is coarse: a Gaussian would need 2."""


def bound_causes(unit: Unit, few: Observation, atlas: Atlas) -> tuple[Unseen, ...]:
    """How large each cause may be where nothing is missing from the plain model.

    Parameters
    ----------
    few
        The rows of a measurement that the atlas holds, with its reading noise.
    """
    surfaces = surfaces_of(unit, few, atlas)
    felt = felt_singles(unit, few, atlas, atlas)
    plain = float(_profile(surfaces[()], 1).max())
    found = []
    for effects, own in surfaces.items():
        if effects:
            hypothesis = Hypothesis(unit, effects)
            seen = [own, felt[effects]] if effects in felt else [own]
            profile = np.max([_profile(one, hypothesis.d) for one in seen], axis=0)
            found.append(_bound(hypothesis, profile, plain))
    return tuple(found)


def _profile(surface: Surface, d: int) -> NDArray[np.float64]:
    """The best log-likelihood at each of the sizes (sizes,) of the first parameter, if any."""
    counts = _COUNTS[d]
    grid = mesh([np.linspace(0.0, 1.0, count) for count in counts])
    found = surface.scan(grid).reshape(counts)
    return found.max(axis=tuple(axis for axis in range(d) if axis != 1))


def _bound(hypothesis: Hypothesis, profile: NDArray[np.float64], plain: float) -> Unseen:
    """Between which sizes one cause lies, by log-likelihoods (sizes,) and the plain model's."""
    effect, parameter = hypothesis.parameters[0]
    start, end = hypothesis.logs[0]
    sizes = np.exp(np.linspace(start, end, len(profile)))
    known, least = parameter.nominal(hypothesis.unit), plain
    from_zero = parameter.allowed[0] <= 0.0
    # Where a cause does nothing its runs, which lie further apart, must do as well as the plain
    # model's. What must not be zero, a voltage at which something clips, does nothing if large.
    nothing = known if known is not None else None if from_zero else sizes[-1]
    if nothing is not None:
        least = min(plain, float(np.interp(nothing, sizes, profile)))
    possible = np.flatnonzero(profile >= least - _SPOKEN_AGAINST)
    first, last = (possible[0], possible[-1]) if len(possible) else (0, -1)
    low = float(sizes[first - 1]) if first > 0 else None
    high = float(sizes[last + 1]) if last + 1 < len(sizes) else None
    if not hypothesis.amid[0]:
        low, high = (None, high) if from_zero else (low, None)
    return Unseen(effect, parameter.name, parameter.unit_symbol, low, high, known)
