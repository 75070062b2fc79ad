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

from analysis.emulation.emulator import Fit
from analysis.observation.observation import Observation

__all__ = ["judge_structure"]

_BANDS = 6
"""Into which the frequencies of a level of a sweep are parted."""

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
    runs leave there, is compared with theirs. That is joined with the probability of the datasheet
    values (S. A. Stouffer et al., "The American Soldier", 1949: the mean of two normal scores,
    times the root of two).

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
    fits, blocks = [seen, *own], observation.blocks
    by_block = np.stack([_structure(fits, block) for block in blocks], axis=1)
    left = _more_than_others(by_block.mean(axis=1))
    if not len(sigmas):
        return left
    off = np.sum((seen.deviations[: len(sigmas)] / sigmas) ** 2)
    unlikely = -float(ndtri(np.clip(chdtrc(len(sigmas), off), 1e-12, 1.0 - 1e-12)))
    return float((left + unlikely) / np.sqrt(2.0))


def _more_than_others(sums: NDArray[np.float64]) -> float:
    """Standard deviations by which the first of some sums is larger than the others."""
    seen, own = np.log(sums[0]), np.log(sums[1:])
    centre = np.median(own)
    return float((seen - centre) / max(1.4826 * np.median(abs(own - centre)), 1e-9))


def _structure(fits: Sequence[Fit], block: slice) -> NDArray[np.float64]:
    """Mean over the bands of a block (fits,) of the squares, in units of own runs'."""
    squares = _means_by_band(fits, block) ** 2
    own = squares[1:]
    total = np.sum(own, axis=0)
    # Each run is held against the others, as the observation is.
    usual = np.vstack([total / len(own), (total - own) / (len(own) - 1)])
    return np.asarray(np.mean(squares / (usual + _LEAST**2), axis=1))


def _means_by_band(fits: Sequence[Fit], block: slice) -> NDArray[np.float64]:
    """Mean residual of gain and phase in every band (fits, means), of what was observed."""
    left = np.stack([fit.residual[:2, block] / fit.std[:2, block] for fit in fits])
    left = np.clip(left, -_FAR, _FAR)
    bands = [band for band in np.array_split(left, _BANDS, axis=2) if band.shape[2]]
    counts = [np.maximum(np.count_nonzero(~np.isnan(band), axis=2), 1) for band in bands]
    means = [np.nansum(band, axis=2) / count for band, count in zip(bands, counts, strict=True)]
    return np.concatenate(means, axis=1)
