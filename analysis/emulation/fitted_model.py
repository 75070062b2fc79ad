"""A hypothesis together with the runs made for it: what a diagnosis compares.

Owns how runs become a candidate: a surface over their places, cleared of what
deviations of datasheet values do, and the best fit on it. It decides neither
where to simulate nor who wins.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.coordinates import FeatureMap
from analysis.emulation.emulator import TRIES, Emulator, Fit, differences
from analysis.emulation.length_scales import learn_width
from analysis.emulation.regimes import find_regimes
from analysis.ensemble.datasheet_spread import Spread, spread_of
from analysis.ensemble.model import Hypothesis
from analysis.ensemble.runs import Population
from analysis.execution.executor import side_by_side
from analysis.observation.observation import Observation
from sim.unit import Unit

__all__ = ["FittedModel", "Effects", "fit_models"]

Effects = tuple[str, ...]
"""Identifiers of a hypothesis's effects, sorted."""


@dataclass(frozen=True, slots=True, eq=False)
class FittedModel:
    """A hypothesis with the runs made for it at all rows, and its best fit."""

    hypothesis: Hypothesis
    population: Population
    surface: Emulator
    best: Fit


def fit_models(
    unit: Unit,
    observation: Observation,
    fine: Mapping[Effects, Population],
    starts: Mapping[Effects, NDArray[np.float64]],
    tries: int = TRIES,
) -> dict[Effects, FittedModel]:
    """Candidates from the runs of several hypotheses, each climbing from its start.

    In so many steps (`Emulator.climb`).
    """
    spread = spread_of(unit)
    raw = {
        key: _surface(observation, population, Hypothesis(unit, key))
        for key, population in fine.items()
    }
    slopes = _pooled_slopes(observation, fine, raw, len(spread))

    def formed(key: Effects) -> FittedModel:
        surface = _without_deviations(raw[key], fine[key], slopes, spread)
        charts = surface.on_chart(surface.places), surface.on_chart(starts[key][None])
        width = learn_width(charts[0], surface.difference, surface.width, charts[1])
        surface = replace(surface, width=width)
        best = surface.climb(starts[key], tries)
        return FittedModel(Hypothesis(unit, key), fine[key], surface, best)

    return dict(zip(fine, side_by_side(formed, fine), strict=True))


def _surface(observation: Observation, population: Population, hypothesis: Hypothesis) -> Emulator:
    none = np.empty((0, 3, len(observation)))
    chart = FeatureMap(hypothesis, observation.frequency_hz)
    return Emulator(
        observation,
        population.places,
        differences(observation, population),
        chart.width,
        none,
        np.empty(0),
        find_regimes(observation, population),
        spread_of(hypothesis.unit).gain,
        # As few as there are slopes leave a plane that turns with every group: of pairs with four
        # sizes runs left out were predicted worse by hundreds in log density.
        enough=(len(chart.width) + 1) ** 2,
        chart=chart,
    )


def _without_deviations(
    surface: Emulator, population: Population, slopes: NDArray[np.float64], spread: Spread
) -> Emulator:
    shift = np.tensordot(population.deviations, slopes, axes=1)
    return replace(
        surface, difference=surface.difference - shift, slopes=slopes, sigmas=spread.sigmas
    )


def _pooled_slopes(
    observation: Observation,
    fine: Mapping[Effects, Population],
    surfaces: Mapping[Effects, Emulator],
    k: int,
) -> NDArray[np.float64]:
    """How the channels follow deviations (k, 3, rows), from the runs of all hypotheses together.

    Near where each agrees best they all show about the same response, so that they share
    their slopes.
    """
    shape = (3, len(observation))
    normal = np.zeros((*shape, k, k))
    right = np.zeros((*shape, k))
    for key, population in fine.items():
        places, surface = population.places, surfaces[key]
        offset = (places - np.median(places, axis=0)) / np.maximum(np.ptp(places, axis=0), 1e-6)
        basis = np.column_stack([np.ones(len(places)), offset, offset[:, :1] ** 2])
        values = np.nan_to_num(surface.difference)
        # Runs in another state of motion follow deviations in another way.
        trust = _robust(values) * surface.alike[:, None]
        inside, seen = _apart(basis, population.deviations, values, trust)
        normal += inside
        right += seen
    # A slope of one is what a gain does; hundreds are not believed without evidence.
    ridge = np.eye(k) / 30.0**2
    solved = np.linalg.solve(normal + ridge, right[..., None])[..., 0]
    return np.asarray(np.moveaxis(solved, -1, 0), dtype=float)


def _apart(
    basis: NDArray[np.float64],
    deviations: NDArray[np.float64],
    values: NDArray[np.float64],
    trust: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Normal matrices (3, rows, k, k) and right sides of deviations, what places do taken out."""
    p = basis.shape[1]
    both = np.column_stack([basis, deviations])
    products = (both[:, :, None] * both[:, None, :]).reshape(len(both), -1)
    flat = trust.reshape(len(trust), -1)
    whole = (products.T @ flat).T.reshape(*trust.shape[1:], both.shape[1], both.shape[1])
    right = (both.T @ (flat * values.reshape(flat.shape))).T.reshape(*trust.shape[1:], -1)
    placed = (
        whole[..., :p, :p]
        + 1e-9 * np.eye(p) * np.trace(whole[..., :p, :p], axis1=-2, axis2=-1)[..., None, None]
    )
    across = np.swapaxes(np.linalg.solve(placed, whole[..., :p, p:]), -1, -2)
    return (
        whole[..., p:, p:] - across @ whole[..., :p, p:],
        right[..., p:] - (across @ right[..., :p, None])[..., 0],
    )


def _robust(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights (runs, columns) that are 1/variance and let runs far off count less."""
    centre = np.median(values, axis=0)
    scale = 1.4826 * np.median(np.abs(values - centre), axis=0) + 0.005
    z2 = ((values - centre) / scale) ** 2
    return 5.0 / (4.0 + z2) / scale**2
