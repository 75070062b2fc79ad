"""Where the next simulations of a hypothesis go.

Owns how groups are placed: evenly about a place that is proposed or about an answer
that was learned from runs, or over all places that agree about as well as the best.
It simulates nothing.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.likelihood import TEMPERATURE
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.model import Hypothesis
from analysis.ensemble.runs import Group

__all__ = ["Reach", "runs_about", "runs_along_ridge", "runs_around_estimate"]

_RATIOS = 5
"""Machines in a group. At three levels they fill two narrow vectors or a wide one, so that groups
of ten take as long as twice as many of five, which have twice as many sizes."""

Reach = tuple[float, float | NDArray[np.float64]]
"""How far groups about a place lie in ratio and in sizes, to either side."""

_RATIO_REACH, _JITTER = 0.1, 0.01
_WIDE, _LEAST_STD = 3.0, 0.015
"""Reach about a learned answer in its standard deviations, and the least of those."""

_BEYOND, _CLOUD = 0.3, 250
"""How far beyond what was simulated to look, as a share of it, and at how many places."""


def runs_about(
    hypothesis: Hypothesis,
    best: NDArray[np.float64],
    groups: int,
    rng: np.random.Generator,
    reach: Reach,
) -> Iterator[Group]:
    """Groups about a place (d,), each of their sizes spread evenly."""
    ratio_reach, size_reach = reach
    steps = np.array([rng.permutation(groups) for _ in range(hypothesis.d - 1)])
    for step in steps.T.reshape(groups, hypothesis.d - 1):
        offset = 2.0 * (step + rng.uniform(size=len(step))) / groups - 1.0
        sizes = np.clip(best[1:] + size_reach * offset, 0.0, 1.0)
        yield Group(hypothesis, _ratios(best[0], ratio_reach, rng), sizes)


def runs_along_ridge(
    candidate: FittedModel, groups: int, rng: np.random.Generator
) -> Iterator[Group]:
    """Groups over the places that agree about as well as the best, which may form a ridge.

    Each stands for an equal share of the likelihood, taken to the power 1 / `TEMPERATURE`; they may
    lie beyond what was simulated so far.
    """
    surface = candidate.surface
    low, high = surface.places.min(axis=0), surface.places.max(axis=0)
    margin = _BEYOND * (high - low)
    bottom, top = np.clip([low - margin, high + margin], 0.0, 1.0)
    cloud = np.vstack([rng.uniform(bottom, top, (_CLOUD, len(low))), candidate.best.place])
    likelihood = surface.scan(cloud, leaning=True)
    weight = np.exp((likelihood - likelihood.max()) / TEMPERATURE)
    order = np.argsort(cloud[:, min(1, cloud.shape[1] - 1)])
    share = np.cumsum(weight[order]) / weight.sum()
    picked = np.searchsorted(share, (np.arange(groups) + rng.uniform()) / groups)
    for place in cloud[order[np.minimum(picked, len(order) - 1)]]:
        sizes = place[1:] + _JITTER * rng.uniform(-1.0, 1.0, len(place) - 1)
        ratios = _ratios(place[0], _RATIO_REACH, rng)
        yield Group(candidate.hypothesis, ratios, np.clip(sizes, 0.0, 1.0))


def runs_around_estimate(
    hypothesis: Hypothesis, found: ParameterPosterior, groups: int, rng: np.random.Generator
) -> Iterator[Group]:
    """Groups evenly about an answer that was learned from runs, a few of its errors wide.

    A regression leans towards where its runs are; these lie alike on all sides.
    """
    std = np.maximum(np.sqrt(np.diag(found.covariance)), _LEAST_STD)
    for step in rng.permutation(groups):
        offset = _WIDE * rng.uniform(-1.0, 1.0, hypothesis.d - 1)
        offset[:1] = _WIDE * (2.0 * (step + rng.uniform()) / groups - 1.0)
        sizes = found.mean[1:] + offset * std[1:]
        # Where size and ratio trade off, the ratio that goes with this size.
        lean = float(np.sum(found.covariance[1:, 0] * offset / std[1:]))
        ratios = _ratios(found.mean[0] + lean, max(_WIDE * std[0], _RATIO_REACH), rng)
        yield Group(hypothesis, ratios, np.clip(sizes, 0.0, 1.0))


def _ratios(ratio: float, reach: float, rng: np.random.Generator) -> NDArray[np.float64]:
    bottom, top = np.clip([ratio - reach, ratio + reach], 0.0, 1.0)
    return bottom + (top - bottom) * (np.arange(_RATIOS) + rng.uniform()) / _RATIOS
