"""Whether what a fit leaves has a shape that a hypothesis's own runs do not leave.

Owns one number for that. A false cause that fits nearly as well as a true one
does leaves a little of the same sign over a whole band, where a sum over points
sees next to nothing; and it leans on datasheet values to get so far. It fits
nothing and ranks no hypotheses.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

from analysis.observation import Observation
from analysis.surface import Fit

__all__ = ["judge_structure"]

_BANDS = 6
"""Into which the frequencies of a level are parted."""

_FAR = 5.0
"""Standard deviations at which a residual is cut off: a single point makes no band."""

_FEW = 8
"""Own runs below which their scatter is not known well enough to say anything."""

_LEAST = 1e-3
"""Scatter of a band's mean that is taken as given, in standard deviations of a point."""


def judge_structure(
    seen: Fit, own: Sequence[Fit], observation: Observation, sigmas: NDArray[np.float64]
) -> float:
    """Standard deviations by which a fit leaves more structure than those of own runs do.

    0 where there are too few of them to tell.

    The sum over bands of the squared mean residual, gain and phase, each in units of what own
    runs leave there, is compared with theirs; that is joined with the probability of the
    datasheet values (S. A. Stouffer et al., "The American Soldier", 1949: the mean of two normal
    scores, times the root of two).

    Parameters
    ----------
    seen, own
        Fits of the observation, and of own runs in its place.
    observation
        Whose rows they are.
    sigmas
        (k,): standard deviations of the datasheet values within their tolerances. In own runs
        these are known, so that they tell nothing of them.
    """
    if len(own) < _FEW:
        return 0.0
    means = _means_by_band([seen, *own], observation.blocks)
    theirs = means[1:]
    total = np.sum(theirs**2, axis=0)
    # Each run is held against the others, as the observation is.
    among_others = (total - theirs**2) / (len(theirs) - 1)
    own_sums = np.log(np.mean(theirs**2 / (among_others + _LEAST**2), axis=1))
    seen_sum = np.log(np.mean(means[0] ** 2 / (total / len(theirs) + _LEAST**2)))
    centre = np.median(own_sums)
    spread = 1.4826 * np.median(abs(own_sums - centre))
    left = float((seen_sum - centre) / max(spread, 1e-9))
    if not len(sigmas):
        return left
    off = np.sum((seen.deviations[: len(sigmas)] / sigmas) ** 2)
    unlikely = -float(ndtri(np.clip(chdtrc(len(sigmas), off), 1e-12, 1.0 - 1e-12)))
    return float((left + unlikely) / np.sqrt(2.0))


def _means_by_band(fits: Sequence[Fit], levels: Sequence[slice]) -> NDArray[np.float64]:
    """Mean residual of gain and phase in every band (fits, means), of what was observed."""
    left = np.stack([fit.residual[:2] / fit.std[:2] for fit in fits])
    left = np.clip(left, -_FAR, _FAR)
    bands = [
        band
        for level in levels
        for band in np.array_split(left[..., level], _BANDS, axis=2)
        if band.shape[2]
    ]
    counts = [np.maximum(np.count_nonzero(~np.isnan(band), axis=2), 1) for band in bands]
    means = [np.nansum(band, axis=2) / count for band, count in zip(bands, counts, strict=True)]
    return np.concatenate(means, axis=1)
