"""How large each cause could be and not show, where nothing was found, or beside what was.

Owns the difference between what is not there and what is not seen. Every cause of an atlas is held
against a measurement, by itself or added to what was found, on the few rows that the atlas has:
what it cannot be larger than is what these rows speak against, and the whole measurement may say
more. It simulates nothing, ranks nothing and passes no verdict.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.agreement import total_densities
from analysis.atlas import Atlas
from analysis.atlas_surfaces import felt_singles, surfaces_of
from analysis.calibration import Calibrated
from analysis.candidate import Candidate
from analysis.causes import Hypothesis
from analysis.observation import Observation
from analysis.screening import Added, add_causes, mesh, ratios_of_pairs, rows_of
from analysis.surface import Surface
from analysis.unseen import Unseen
from sim.unit import Unit

__all__ = ["bound_beside", "bound_causes"]

_COUNTS = {1: (31,), 2: (31, 61), 3: (21, 31, 7), 4: (11, 13, 9, 3)}
"""Places looked at along each coordinate: the ratio, the size that is asked about, the others."""

_SPOKEN_AGAINST = 10.0
"""Log-likelihood by which the best of a size must lie behind the best of all for the size to be
ruled out. An atlas is coarse: a Gaussian would need 2."""

_SPOKEN_AGAINST_SUM = 60.0
"""The same where it is added to what was found, which a sum gets wrong in detail: of 126 small
causes that were there beside a larger one, true sizes lay 52, 41 and 36 behind, and one 120."""

_BETWEEN = 61
"""Sizes looked at between those of the sums."""

_NEAR, _DRAWS = (0.5, 1.0, 2.0, 3.0), 40
"""Error bars about what was found within which it may lie if there is another cause beside it, and
how many places are drawn for each."""


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
            found.append(_bound_by_itself(hypothesis, profile, plain))
    return tuple(found)


def bound_beside(
    unit: Unit, few: Observation, atlas: Atlas, found: Candidate, sharp: Calibrated
) -> tuple[Unseen, ...]:
    """How large every other cause may be beside those that were found.

    Parameters
    ----------
    few
        As `bound_causes`.
    found, sharp
        What is named, and how well its ratio and sizes are known.
    """
    additions = add_causes(unit, few, atlas)
    shown = _shown_near(found, sharp, rows_of(few, found.surface.observation))
    bounds = []
    for effects, further in additions.added.items():
        if not set(effects) & set(found.hypothesis.effects):
            hypothesis = Hypothesis(unit, effects)
            coordinates, profile = _profile_beside(shown, further)
            bounds.append(_bound_in_sum(hypothesis, coordinates, profile))
    return tuple(bounds)


def _profile(surface: Surface, d: int) -> NDArray[np.float64]:
    """The best log-likelihood at each of the sizes (sizes,) of the first parameter, if any."""
    counts = _COUNTS[d]
    grid = mesh([np.linspace(0.0, 1.0, count) for count in counts])
    found = surface.scan(grid).reshape(counts)
    return found.max(axis=tuple(axis for axis in range(d) if axis != 1))


def _bound_by_itself(hypothesis: Hypothesis, profile: NDArray[np.float64], plain: float) -> Unseen:
    """Between which sizes one cause lies, by log-likelihoods (sizes,) and the plain model's."""
    _, parameter = hypothesis.parameters[0]
    sizes = _sizes(hypothesis, np.linspace(0.0, 1.0, len(profile)))
    known, least = parameter.nominal(hypothesis.unit), plain
    from_zero = parameter.allowed[0] <= 0.0
    # Where a cause does nothing its runs, which lie further apart, must do as well as the plain
    # model's. What must not be zero, a voltage at which something clips, does nothing if large.
    nothing = known if known is not None else None if from_zero else sizes[-1]
    if nothing is not None:
        least = min(plain, float(np.interp(nothing, sizes, profile)))
    return _bound(hypothesis, sizes, np.flatnonzero(profile >= least - _SPOKEN_AGAINST))


_Shown = tuple[NDArray[np.float64], NDArray[np.float64], int]
"""Mean and scatter (columns,) of what was found at a place, and which ratio of sums is nearest."""


def _shown_near(found: Candidate, sharp: Calibrated, rows: NDArray[np.intp]) -> list[_Shown]:
    """What the causes that were found show on some rows at places that they may have."""
    d, rng = len(sharp.mean), np.random.default_rng(0)
    root = np.linalg.cholesky(sharp.covariance + 1e-9 * np.eye(d))
    far = np.repeat(_NEAR, _DRAWS)[:, None] * (
        rng.standard_normal((len(_NEAR) * _DRAWS, d)) @ root.T
    )
    ran = found.population.places
    drawn = np.clip(sharp.mean + far, ran.min(axis=0), ran.max(axis=0))
    shown = []
    for place in (found.best.place, sharp.mean, *drawn):
        mean, std = found.surface.expected(place)
        nearest = int(np.argmin(abs(ratios_of_pairs() - place[0])))
        shown.append((mean[:, rows].ravel(), std[:, rows].ravel(), nearest))
    return shown


def _profile_beside(
    shown: Sequence[_Shown], further: Added
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sizes looked at (sizes,), as coordinates, and by how much each does better than none.

    With the scatter that the runs of the further cause have either way, which is no evidence.
    """
    sizes, shift, std = further.between(_BETWEEN)
    nothing = np.zeros((1, shift.shape[2]))
    beside, alone = (
        np.concatenate(
            [
                total_densities(mean, nothing, share * shift[at], own[None], std[at])
                for mean, own, at in shown
            ]
        ).max(axis=0)
        for share in (1.0, 0.0)
    )
    first = np.unique(sizes[:, 0])
    gain = beside - alone
    return first, np.array([gain[sizes[:, 0] == one].max() for one in first])


def _bound_in_sum(
    hypothesis: Hypothesis, coordinates: NDArray[np.float64], gain: NDArray[np.float64]
) -> Unseen:
    """Between which sizes one cause lies beside others, by what it gains (sizes,)."""
    _, parameter = hypothesis.parameters[0]
    sizes, known = _sizes(hypothesis, coordinates), parameter.nominal(hypothesis.unit)
    # Where it does nothing, or next to it, what it seems to do is what a sum gets wrong.
    least = gain[0 if parameter.allowed[0] <= 0.0 else -1]
    if known is not None:
        least = np.interp(known, sizes, gain)
    possible = gain >= min(0.0, float(least)) - _SPOKEN_AGAINST_SUM
    return _bound(hypothesis, sizes, np.flatnonzero(possible))


def _bound(
    hypothesis: Hypothesis, sizes: NDArray[np.float64], possible: NDArray[np.intp]
) -> Unseen:
    """Between which sizes one cause lies, by which of the sizes looked at are possible."""
    effect, parameter = hypothesis.parameters[0]
    first, last = (possible[0], possible[-1]) if len(possible) else (0, -1)
    low = float(sizes[first - 1]) if first > 0 else None
    high = float(sizes[last + 1]) if last + 1 < len(sizes) else None
    if not hypothesis.amid[0]:
        low, high = (None, high) if parameter.allowed[0] <= 0.0 else (low, None)
    known = parameter.nominal(hypothesis.unit)
    return Unseen(effect, parameter.name, parameter.unit_symbol, low, high, known)


def _sizes(hypothesis: Hypothesis, coordinates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values of the first parameter at coordinates (count,)."""
    start, end = hypothesis.logs[0]
    return np.asarray(np.exp(start + (end - start) * coordinates))
