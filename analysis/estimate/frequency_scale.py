"""Whether a response fits the plain model at other frequencies than it states.

Owns one question, asked where the plain model is refuted and its runs are at hand: does one factor
on all frequencies undo the misfit? It reads the runs between their frequencies and simulates
nothing. Causes of the catalogue move resonances, but not the motor's own slope and the filter
along with them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.machine import Draws
from analysis.observation.observation import Observation

__all__ = ["REFUTED", "frequency_doubt", "undoes"]

_FACTORS = np.exp(np.arange(-6, 7) * np.log(1.2) / 6.0)
"""Factors that are tried: steps of 3 %, up to 20 % either way."""

REFUTED, _FITS, _SHARE = 3.0, 1.6, 0.35
"""Robust misfit, standard deviations, from which the response as it is must be off, that it may
have at the other frequencies, and what share of the first that may be at most."""

_LEAST_SHARE = 0.5
"""Share of the rows that must lie inside the band at the other frequencies."""


def frequency_doubt(
    observation: Observation,
    draws: Draws,
    misfit: Callable[[Observation, Draws], float],
) -> str:
    """What is to be said of the frequencies of a response, empty where nothing is.

    Parameters
    ----------
    observation, draws
        The response, and runs of the plain model at its frequencies.
    misfit
        Robust misfit of the plain model fitted to an observation with such runs.
    """
    given = misfit(observation, draws)
    if given < REFUTED:
        return ""
    tried = [
        (misfit(*moved), float(factor))
        for factor in _FACTORS
        if abs(factor - 1.0) > 0.01 and (moved := _at(observation, draws, factor)) is not None
    ]
    left, factor = min(tried, default=(given, 1.0))
    if not undoes(left, given):
        return ""
    return (
        f"frequencies are likely {factor:.2f} times what they should be: divided by that, the "
        f"model leaves {left:.1f} standard deviations in place of {given:.1f}; see to the time "
        "base or the sampling rate"
    )


def undoes(left: float, given: float) -> bool:
    """Whether a change that leaves so many standard deviations undoes the misfit given."""
    return given >= REFUTED and left <= min(_FITS, _SHARE * given)


def _at(observation: Observation, draws: Draws, factor: float) -> tuple[Observation, Draws] | None:
    """Rows whose true frequency lies in the band of their level, with what runs show there."""
    kept: list[NDArray[np.int64]] = []
    mean, variance = [], []
    for block in observation.blocks:
        grid = observation.frequency_hz[block]
        true = grid / factor
        inside = (true >= grid[0]) & (true <= grid[-1])
        if len(grid) < 2 or not inside.any():
            continue
        kept.append(np.arange(block.start, block.stop)[inside])
        logs = np.log(np.abs(draws.mean[:, block]))
        phase = np.unwrap(np.angle(draws.mean[:, block]), axis=1)
        spread = np.log(np.maximum(draws.variance[:, block], 1e-14))
        between = _Between(grid, true[inside])
        mean.append(np.exp(between(logs) + 1j * between(phase)))
        variance.append(np.exp(between(spread)))
    if sum(map(len, kept)) < _LEAST_SHARE * len(observation):
        return None
    there = replace(
        draws, mean=np.concatenate(mean, axis=1), variance=np.concatenate(variance, axis=1)
    )
    return observation.at_rows(np.concatenate(kept)), there


class _Between:
    """Straight lines between the points of a grid, along the last axis."""

    def __init__(self, grid: NDArray[np.float64], at: NDArray[np.float64]) -> None:
        self._left = np.clip(np.searchsorted(grid, at) - 1, 0, len(grid) - 2)
        self._share = (at - grid[self._left]) / (grid[self._left + 1] - grid[self._left])

    def __call__(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        left, right = values[:, self._left], values[:, self._left + 1]
        return np.asarray(left + self._share * (right - left))
