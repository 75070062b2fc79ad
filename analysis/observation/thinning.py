"""The part of a large response that an estimate or a diagnosis is made from.

Owns the choice of levels and frequencies where there are more than hundreds of machines can be
taken through. Rows are chosen, never averaged: a simulated point is one dwell, too. It simulates
nothing, and leaves responses of a usual size as they are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.resonance.neighbour_noise import running
from daq.frf import DB_PER_NEPER, FrequencyResponse, PointFlag

__all__ = ["thin", "thin_responses"]

MOST_ROWS = 720
"""Rows of all responses together up to which nothing is left out: four times those of a usual
sweep, three levels of 61 frequencies. An estimate of so many takes a minute, a diagnosis some."""

_KEPT_ROWS, _MOST_LEVELS = 366, 6
"""Rows and levels that are kept of more: twice those of a usual sweep."""

_EVEN = 0.4
"""Share of the frequencies that is spread evenly, by logarithm; the others go where the gain
changes."""

_MOST_DB = 3.0
"""Change from one frequency to the next that counts: a jump says no more than its neighbours."""


def thin_responses(
    responses: Sequence[FrequencyResponse],
) -> tuple[tuple[FrequencyResponse, ...], list[str]]:
    """Responses of a size that can be simulated, and what is to be said of what was left out.

    Parameters
    ----------
    responses
        Of one unit, to be taken together.

    Returns
    -------
    tuple
        The responses, each with all rows or some, and one warning if any row was left out.
    """
    total = sum(map(len, responses))
    if total <= MOST_ROWS:
        return tuple(responses), []
    most = max(_KEPT_ROWS // len(responses), 1)
    kept = tuple(thin(one, most) for one in responses)
    used = sum(map(len, kept))
    if used == total:
        return kept, []
    levels = len(np.unique(np.concatenate([one.source_vpk for one in responses])))
    left = len(np.unique(np.concatenate([one.source_vpk for one in kept])))
    at = f" at {left} of {levels} source levels," if left < levels else ""
    return kept, [
        f"of {total} points {used} were used,{at} most where the gain changes: machines are "
        "simulated through each of them; for others, give a file that holds only those"
    ]


def thin(response: FrequencyResponse, most: int) -> FrequencyResponse:
    """A response with at most so many usable rows, spread over its levels and frequencies.

    Levels are chosen evenly by logarithm, the lowest and highest among them; frequencies are the
    same at levels that share them.
    """
    if len(response) <= most:
        return response
    usable = (response.flags & (PointFlag.SPOILT | PointFlag.OVERLOAD)) == 0
    usable &= (np.abs(response.gain) > 0.0) & np.isfinite(response.source_vpk)
    if not usable.any():
        return response.take(np.arange(most))
    rows = np.flatnonzero(usable)
    levels = _spread_levels(response.source_vpk[rows], min(_MOST_LEVELS, most))
    parts = [rows[response.source_vpk[rows] == level] for level in levels]
    each = max(most // len(parts), 1)
    grids: dict[bytes, list[NDArray[np.intp]]] = {}
    for part in parts:
        part = part[np.argsort(response.frequency_hz[part], kind="stable")]
        grids.setdefault(response.frequency_hz[part].tobytes(), []).append(part)
    kept = [part[_informative(response, alike, each)] for alike in grids.values() for part in alike]
    return response.take(np.sort(np.concatenate(kept)))


def _spread_levels(source_vpk: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    levels = np.unique(source_vpk)
    if len(levels) <= most:
        return levels
    wanted = np.geomspace(levels[0], levels[-1], most)
    return levels[np.unique([np.argmin(np.abs(np.log(levels / one))) for one in wanted])]


def _informative(
    response: FrequencyResponse, alike: Sequence[NDArray[np.intp]], most: int
) -> NDArray[np.intp]:
    """Places in a common grid of levels: evenly, and more where their gains change."""
    frequency = response.frequency_hz[alike[0]]
    if len(frequency) <= most:
        return np.arange(len(frequency))
    change = np.zeros(len(frequency) - 1)
    for rows in alike:
        gain = np.log(np.abs(response.gain[rows])) * DB_PER_NEPER
        change += np.minimum(np.abs(np.diff(_smooth(gain, 2 * most))), _MOST_DB)
    even = np.diff(np.log(frequency))
    weight = _EVEN * even / max(even.sum(), 1e-300)
    weight += (1.0 - _EVEN) * change / max(change.sum(), 1e-300)
    way = np.append(0.0, np.cumsum(weight))
    wanted = np.linspace(0.0, way[-1], most)
    return np.unique(np.clip(np.searchsorted(way, wanted), 0, len(frequency) - 1))


def _smooth(gain: NDArray[np.float64], blocks: int) -> NDArray[np.float64]:
    """Gains without what scatters over a few points, which is no change of them."""
    parts = np.array_split(np.arange(len(gain)), min(blocks, len(gain)))
    middle = np.array([part.mean() for part in parts])
    median = np.array([np.median(gain[part]) for part in parts])
    return np.interp(np.arange(len(gain)), middle, running(median, 5, np.median))
