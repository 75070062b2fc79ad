"""Where the next simulations of a hypothesis go.

Owns how groups are placed: evenly about a place from the coarse look or about an
answer that was learned from runs, over all places that agree about as well as the
best, or at a few sizes of a cause beside known ones. It simulates nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from analysis.calibration import Calibrated
from analysis.candidate import Candidate
from analysis.causes import Hypothesis
from analysis.likelihood import HEAT
from analysis.population import Group

__all__ = ["Reach", "groups_about", "groups_along", "groups_around", "groups_beside"]

_RATIOS = 5
"""Machines in a group. At three levels they fill two narrow vectors or a wide one, so that groups
of ten take as long as twice as many of five, which have twice as many sizes."""

Reach = tuple[float, float | NDArray[np.float64]]
"""How far groups about a place lie in ratio and in sizes, to either side."""

_CLOSE, _FAR = (0.14, 0.06), (0.3, 0.12)
"""Reach in ratio and in sizes about a place that the coarse look knows well, and about a pair's."""

_OWN_REACH = {"payload-flexibility": np.array([0.2, 0.04, 0.3])}
"""Reach in the sizes of causes that the coarse look knows otherwise: of what swings on the load it
knows the resonance, the inertia less, and hardly the damping. With `_CLOSE` all runs of four such
loads in seven lay beside the truth, and what was believed stayed there."""

_AMID, _SOME, _IN_BAND, _KNOWN_RATIO_REACH = (0.36, 0.64), (0.4, 0.65), (0.1, 0.5, 0.9), 0.2
"""Sizes of a further cause beside known ones: of a datasheet value amid its range and of others,
and shares of the band. Reach in ratio about what is known: it trades off with the size."""

_RATIO_REACH, _JITTER = 0.1, 0.01
_WIDE, _LEAST_STD = 3.0, 0.015
"""Reach about a learned answer in its standard deviations, and the least of those."""

_BEYOND, _CLOUD = 0.3, 250
"""How far beyond what was simulated to look, as a share of it, and at how many places."""


def groups_about(
    hypothesis: Hypothesis,
    best: NDArray[np.float64],
    groups: int,
    rng: np.random.Generator,
    reach: Reach | None = None,
) -> Iterator[Group]:
    """Groups about a place (d,), each of their sizes spread evenly.

    If not told otherwise they reach further for several causes, whose place is put together from
    what each does alone.
    """
    ratio_reach, size_reach = _reach(hypothesis) if reach is None else reach
    steps = np.array([rng.permutation(groups) for _ in range(hypothesis.d - 1)])
    for step in steps.T.reshape(groups, hypothesis.d - 1):
        offset = 2.0 * (step + rng.uniform(size=len(step))) / groups - 1.0
        sizes = np.clip(best[1:] + size_reach * offset, 0.0, 1.0)
        yield Group(hypothesis, _ratios(best[0], ratio_reach, rng), sizes)


def groups_along(candidate: Candidate, groups: int, rng: np.random.Generator) -> Iterator[Group]:
    """Groups over the places that agree about as well as the best, which may form a ridge.

    Each stands for an equal share of the likelihood, taken to the power 1 / `HEAT`; they may
    lie beyond what was simulated so far.
    """
    surface = candidate.surface
    low, high = surface.places.min(axis=0), surface.places.max(axis=0)
    margin = _BEYOND * (high - low)
    bottom, top = np.clip([low - margin, high + margin], 0.0, 1.0)
    cloud = np.vstack([rng.uniform(bottom, top, (_CLOUD, len(low))), candidate.best.place])
    likelihood = surface.scan(cloud, leaning=True)
    weight = np.exp((likelihood - likelihood.max()) / HEAT)
    order = np.argsort(cloud[:, min(1, cloud.shape[1] - 1)])
    share = np.cumsum(weight[order]) / weight.sum()
    picked = np.searchsorted(share, (np.arange(groups) + rng.uniform()) / groups)
    for place in cloud[order[np.minimum(picked, len(order) - 1)]]:
        sizes = place[1:] + _JITTER * rng.uniform(-1.0, 1.0, len(place) - 1)
        ratios = _ratios(place[0], _RATIO_REACH, rng)
        yield Group(candidate.hypothesis, ratios, np.clip(sizes, 0.0, 1.0))


def groups_around(
    hypothesis: Hypothesis, found: Calibrated, groups: int, rng: np.random.Generator
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


def groups_beside(
    known: Hypothesis,
    place: NDArray[np.float64],
    further: Hypothesis,
    frequency_hz: NDArray[np.float64],
    rng: np.random.Generator,
) -> Iterator[Group]:
    """Groups of known causes at a place (d,) and a further one at sizes all over its range.

    What resonates by itself does so at frequencies of the band that was measured.
    """
    band = np.log([frequency_hz.min(), frequency_hz.max()])
    lines = []
    for (_, parameter), logs in zip(further.parameters, further.logs, strict=True):
        if parameter.unit_symbol == "Hz":
            at = band[0] + np.array(_IN_BAND) * np.ptp(band)
            lines.append(np.clip((at - logs[0]) / np.ptp(logs), 0.0, 1.0))
        else:
            lines.append(np.array(_AMID if further.centred else _SOME))
    for sizes in product(*lines[:2]):
        # Of a third size, how well it is damped, a resonance tells least.
        rest = [float(rng.choice(line)) for line in lines[2:]]
        both, at = known.joined(place, further, np.array([*sizes, *rest]))
        yield Group(both, _ratios(place[0], _KNOWN_RATIO_REACH, rng), at[1:])


def _reach(hypothesis: Hypothesis) -> Reach:
    if len(hypothesis.effects) > 1:
        return _FAR
    ratio_reach, size_reach = _CLOSE
    own = [_OWN_REACH[e] for e in hypothesis.effects if e in _OWN_REACH]
    return ratio_reach, own[0] if own else size_reach


def _ratios(ratio: float, reach: float, rng: np.random.Generator) -> NDArray[np.float64]:
    bottom, top = np.clip([ratio - reach, ratio + reach], 0.0, 1.0)
    return bottom + (top - bottom) * (np.arange(_RATIOS) + rng.uniform()) / _RATIOS
