"""Fitting the free numbers of a machine to an observation.

Owns the order of looks, a coarse one over the whole range and a closer one about
the answer so far, and the posterior that follows. What is free (contribution
ratio, total backlash) is the caller's; which machines are held against the
observation is settled in `analysis.estimate.design`, how far the answer can be trusted
is found out in `analysis.emulation.parameter_posterior`. It decides nothing about causes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.likelihood import Match, match_prediction
from analysis.emulation.noise_level import likeliest_noise, possible_noises
from analysis.emulation.parameter_posterior import ParameterPosterior, calibrate
from analysis.emulation.quadratic import QuadraticEmulator
from analysis.ensemble.datasheet_spread import Spread, spread_of
from analysis.ensemble.machine import Draws, Machine
from analysis.ensemble.run_cache import run_families
from analysis.ensemble.runs import Population
from analysis.estimate.datasheet_posterior import (
    DatasheetValue,
    datasheet_values,
    predicted_departures,
)
from analysis.estimate.design import RATIO, Axis, Families, near_families, wide_families
from analysis.execution.executor import Executor
from analysis.execution.progress import Progress
from analysis.observation.observation import Observation
from sim.unit import Unit

__all__ = ["Posterior", "fit_posterior", "match_runs", "robust_rms"]


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Posterior of the free numbers on a regular grid.

    `values` one array per axis; `weight` (...) sums to one over the grid;
    `best` its centre and `match` what is left there; `draws` all runs made; `datasheet` what is
    learned of each value of it.
    """

    axes: tuple[Axis, ...]
    values: tuple[NDArray[np.float64], ...]
    weight: NDArray[np.float64]
    best: tuple[float, ...]
    match: Match
    draws: Draws
    datasheet: tuple[DatasheetValue, ...] = ()


def fit_posterior(
    unit: Unit,
    observation: Observation,
    axes: Sequence[Axis] = (RATIO,),
    *,
    seed: int = 0,
    cache: Path | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Posterior:
    """Fit the free numbers of a unit to an observation.

    `cache` and `executor` are those of `analysis.ensemble.run_cache.run_families`.

    Raises
    ------
    AnalysisError
        If a motion grew without bound, or the data leave no likelihood.
    """

    def runs(families: Families, low: float, high: float, text: str) -> Draws:
        def tell(part: float) -> None:
            if progress is not None:
                progress(low + (high - low) * part, text)

        return run_families(
            unit, families, observation, cache=cache, executor=executor, progress=tell
        )

    rng, spread = np.random.default_rng(seed), spread_of(unit)
    axes = tuple(axes)
    scales = np.array([axis.scale for axis in axes])
    wide = wide_families(axes, observation, spread, seed)
    draws = runs(wide, 0.0, 0.5, "simulating the range")
    found = calibrate(
        observation, _population(axes, draws, spread), scales, spread.gain, rng, cautious=True
    )
    std = np.sqrt(np.diag(found.covariance))
    near = near_families(axes, found.mean, std, observation, spread, seed)
    draws = draws.joined(runs(near, 0.5, 0.95, "simulating near the answer"))
    population, width = _population(axes, draws, spread), 0.6 * scales
    calibrated = calibrate(observation, population, width, spread.gain, rng, cautious=True)
    weight = calibrated.density(_grid(axes))
    best = np.clip(calibrated.mean, [axis.low for axis in axes], [axis.high for axis in axes])

    def match(seen: Observation) -> Match:
        return match_prediction(seen, _emulator(seen, population, width, spread).predict(best))

    heard = likeliest_noise(possible_noises(observation), lambda s: match(s).log_likelihood)
    if progress is not None:
        progress(1.0, "done")
    return Posterior(
        axes,
        tuple(np.linspace(axis.low, axis.high, _fine_count(axis)) for axis in axes),
        weight.reshape(tuple(_fine_count(axis) for axis in axes)),
        tuple(float(v) for v in best),
        match(heard),
        draws,
        _datasheet(unit, heard, population, calibrated, axes, spread),
    )


def _datasheet(
    unit: Unit,
    observation: Observation,
    population: Population,
    found: ParameterPosterior,
    axes: Sequence[Axis],
    spread: Spread,
) -> tuple[DatasheetValue, ...]:
    """What is learned of the datasheet, over the places that the answer leaves open."""
    low, high = np.array([axis.low for axis in axes]), np.array([axis.high for axis in axes])
    width = 0.6 * np.array([axis.scale for axis in axes])
    emulator = _emulator(observation, population, width, spread)
    used = np.any(population.deviations != 0.0, axis=0)
    places = found.sigma_points(low, high)
    learned = [predicted_departures(observation, emulator.predict(place)) for place in places]
    return datasheet_values(unit, observation, spread, used, learned)


def match_runs(
    unit: Unit, observation: Observation, axes: Sequence[Axis], draws: Draws, seed: int = 0
) -> Match:
    """What the best place between runs leaves of an observation; nothing is simulated."""
    spread = spread_of(unit)
    scales = np.array([axis.scale for axis in axes])
    population, width = _population(axes, draws, spread), 0.6 * scales
    rng = np.random.default_rng(seed)
    mean = calibrate(observation, population, width, spread.gain, rng, cautious=True).mean
    best = np.clip(mean, [axis.low for axis in axes], [axis.high for axis in axes])

    def match(seen: Observation) -> Match:
        return match_prediction(seen, _emulator(seen, population, width, spread).predict(best))

    noises = possible_noises(observation)
    return match(likeliest_noise(noises, lambda s: match(s).log_likelihood))


def robust_rms(match: Match) -> float:
    """What is left of gain and phase, standard deviations, by its median."""
    z = match.residual[:2] / match.std[:2]
    z = z[np.isfinite(z)]
    return float(1.4826 * np.median(np.abs(z))) if z.size else 0.0


def _population(axes: Sequence[Axis], draws: Draws, spread: Spread) -> Population:
    """Runs with the places of their machines along the axes."""
    places = np.array([[_value(axis, m) for axis in axes] for m in draws.machines])
    deviations = np.array([spread.along(m.deviations) for m in draws.machines])
    return Population(
        places, deviations, draws.mean, draws.variance, (deviations[:, 0] > 0.0).astype(int)
    )


def _emulator(
    observation: Observation, population: Population, width: NDArray[np.float64], spread: Spread
) -> QuadraticEmulator:
    """What machines between these would show on the bench of an observation."""
    used = np.any(population.deviations != 0.0, axis=0)
    return QuadraticEmulator(
        population.places,
        population.deviations[:, used],
        population.channels(observation),
        observation.blocks,
        width,
        spread.sigmas[used],
        spread.gain,
    )


def _value(axis: Axis, machine: Machine) -> float:
    value = getattr(machine, axis.name)
    return float(value)


def _grid(axes: Sequence[Axis]) -> NDArray[np.float64]:
    lines = [np.linspace(axis.low, axis.high, _fine_count(axis)) for axis in axes]
    mesh = np.meshgrid(*lines, indexing="ij")
    return np.stack([m.ravel() for m in mesh], axis=1)


def _fine_count(axis: Axis) -> int:
    return 6 * (axis.coarse - 1) // 2 + 1
