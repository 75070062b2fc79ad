"""What the runs of an atlas tell between them: a surface for every hypothesis.

Owns how far a run reaches where runs are few, and which runs tell of what: a
hypothesis's own, or all of those with something linear at the load, seen by
what the load is felt as. It looks for no place and judges nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from analysis.atlas import Atlas
from analysis.branches import Motions
from analysis.candidate import Effects
from analysis.causes import Hypothesis
from analysis.chart import Chart, is_at_load
from analysis.observation import Observation
from analysis.population import Population
from analysis.spread import spread_of
from analysis.surface import Surface, differences
from sim.unit import Unit

__all__ = ["felt_pairs", "felt_singles", "surfaces_of"]

_WIDTHS = {1: (0.06,), 2: (0.1, 0.13), 3: (0.12, 0.15, 0.2), 4: (0.15, 0.25, 0.25, 0.25)}
"""Distances over which a coarse surface reaches, by number of coordinates."""

_ENOUGH = {1: 4.0, 2: 5.0, 3: 6.0, 4: 25.0}
"""How many runs a regression takes, by number of coordinates: so few of so coarse an atlas, lest
what is far away counts. True pairs then rank best."""

_FELT_WIDTHS, _FELT_ENOUGH = (0.15, 0.3, 0.3), 12.0
"""The same where the load is seen by what it reflects."""

_ONE_SIZE = 2
"""Coordinates of a cause of one size: the ratio is the first."""


def felt_pairs(unit: Unit, coarse: Observation, atlas: Atlas) -> dict[Effects, Surface]:
    """A surface for every pair of one size each at the load."""
    charts = [
        Chart(Hypothesis(unit, (*first, *second)), coarse.frequency_hz, most=0)
        for first, second in combinations(_one_size_at_load(unit, atlas), 2)
    ]
    return _felt_surfaces(unit, coarse, atlas, charts)


def felt_singles(
    unit: Unit, coarse: Observation, atlas: Atlas, wanted: Collection[Effects]
) -> dict[Effects, Surface]:
    """A surface for every one of some causes that has one size and is at the load."""
    charts = [
        Chart(Hypothesis(unit, effects), coarse.frequency_hz, most=0)
        for effects in _one_size_at_load(unit, wanted)
    ]
    return _felt_surfaces(unit, coarse, atlas, charts)


def _one_size_at_load(unit: Unit, known: Collection[Effects]) -> list[Effects]:
    at_load = sorted(k for k in known if len(k) == 1 and is_at_load(k[0]))
    return [k for k in at_load if Hypothesis(unit, k).d == _ONE_SIZE]


def surfaces_of(unit: Unit, coarse: Observation, atlas: Atlas) -> dict[Effects, Surface]:
    """A surface for every hypothesis of an atlas.

    A load that is felt alike does alike, whatever hangs on it: what swings on the load is seen by
    all runs with something linear there.
    """
    charts = [Chart(Hypothesis(unit, effects), coarse.frequency_hz) for effects in atlas]
    felt = _felt_surfaces(unit, coarse, atlas, [chart for chart in charts if chart.bent.any()])
    return {k: felt[k] if k in felt else _surface(unit, coarse, atlas[k]) for k in atlas}


def _felt_surfaces(
    unit: Unit, coarse: Observation, atlas: Atlas, wanted: Sequence[Chart]
) -> dict[Effects, Surface]:
    """Surfaces over the ratio and what the load reflects, by all runs of what is at the load."""
    if not wanted:
        return {}
    charts = {effects: Chart(Hypothesis(unit, effects), coarse.frequency_hz) for effects in atlas}
    at_load = [effects for effects, chart in charts.items() if chart.at_load]
    runs = np.concatenate([differences(coarse, atlas[k]) for k in at_load])
    felt = np.concatenate([charts[k].felt(atlas[k].places) for k in at_load], axis=1)
    return {
        chart.hypothesis.effects: _plain_surface(
            unit,
            coarse,
            # Where the runs are says nothing of a range that other hypotheses have.
            np.array([np.zeros(chart.hypothesis.d), np.ones(chart.hypothesis.d)]),
            runs,
            _FELT_WIDTHS,
            _FELT_ENOUGH,
            chart=chart,
            coordinates=felt,
        )
        for chart in wanted
    }


def _surface(unit: Unit, coarse: Observation, population: Population) -> Surface:
    d = population.places.shape[1]
    runs = differences(coarse, population)
    return _plain_surface(unit, coarse, population.places, runs, _WIDTHS[d], _ENOUGH[d])


def _plain_surface(
    unit: Unit,
    coarse: Observation,
    places: NDArray[np.float64],
    difference: NDArray[np.float64],
    width: Sequence[float],
    enough: float,
    chart: Chart | None = None,
    coordinates: NDArray[np.float64] | None = None,
) -> Surface:
    """A surface that knows nothing of deviations and states of motion."""
    return Surface(
        coarse,
        places,
        difference,
        np.array(width),
        np.empty((0, 3, len(coarse))),
        np.empty(0),
        Motions.unknown(len(difference), len(coarse)),
        spread_of(unit).gain,
        enough,
        tailed=False,
        chart=chart,
        coordinates=coordinates,
    )
