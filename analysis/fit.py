"""Fitting the free numbers of a machine to an observation.

Owns where simulations are placed: a coarse look over the whole range, then
closer ones about the answer so far, and the posterior that follows. What is
free (contribution ratio, total backlash) is the caller's; how far the answer
can be trusted is found out in `analysis.calibration`. It decides nothing about
causes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.calibration import Calibrated, calibrate
from analysis.emulator import Emulator
from analysis.ensemble import TOLERANCES, Draws, Machine
from analysis.executor import Executor
from analysis.library import run_families
from analysis.likelihood import Match, match_prediction
from analysis.observation import Observation
from analysis.population import DEVIATING, Population
from analysis.progress import Progress
from analysis.reading_noise import likeliest_noise, possible_noises
from sim.response import START_SPREAD
from sim.unit import Unit

__all__ = ["Axis", "Posterior", "RATIO", "fit_posterior"]


_WIDE_FAMILIES, _NEAR_FAMILIES = 5, 8
"""Families of machines that share their deviations, and so are stepped together, per axis."""

_FULL_LANES, _LEAST_KIN, _MOST_KIN = 64, 8, 32
"""A family at all its levels fills the engine's lanes, or nearly."""

_REACH = 3.5
"""Machines lie up to so many standard deviations from the answer so far."""

_LEAST_STD, _CENTRES, _REACHES = 0.6, 1.25, 1.5
"""The answer so far is known to so much of an axis's scale at best; it is looked at about places
so much of the scale apart, over reaches that grow by this factor. Measurements that lie close
together are thus held against the same machines, which may have been kept."""


@dataclass(frozen=True, slots=True)
class Axis:
    """One free number: its range and how many coarse places span it.

    `machine` puts a value into a machine. `scale` is the distance over which
    a response changes smoothly, the same unit as the range.
    """

    name: str
    low: float
    high: float
    coarse: int
    scale: float
    machine: Callable[[Machine, float], Machine]


RATIO = Axis("ratio", 0.0, 1.0, 33, 0.08, lambda m, v: replace(m, ratio=float(v)))


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Posterior of the free numbers on a regular grid.

    `values` one array per axis; `weight` (...) sums to one over the grid;
    `best` its centre and `match` what is left there; `draws` all runs made.
    """

    axes: tuple[Axis, ...]
    values: tuple[NDArray[np.float64], ...]
    weight: NDArray[np.float64]
    best: tuple[float, ...]
    match: Match
    draws: Draws


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

    `cache` and `executor` are those of `analysis.library.run_families`.

    Raises
    ------
    AnalysisError
        If a motion grew without bound, or the data leave no likelihood.
    """

    def runs(families: list[list[Machine]], low: float, high: float, text: str) -> Draws:
        def tell(part: float) -> None:
            if progress is not None:
                progress(low + (high - low) * part, text)

        return run_families(
            unit, families, observation, cache=cache, executor=executor, progress=tell
        )

    rng = np.random.default_rng(seed)
    axes = tuple(axes)
    scales = np.array([axis.scale for axis in axes])
    wide = _wide_families(axes, _kin(observation), seed)
    draws = runs(wide, 0.0, 0.5, "simulating the range")
    found = calibrate(observation, _population(axes, draws), scales, rng)
    near = _near_families(axes, found, _kin(observation), seed)
    draws = draws.joined(runs(near, 0.5, 0.95, "simulating near the answer"))
    population, width = _population(axes, draws), 0.6 * scales
    calibrated = calibrate(observation, population, width, rng)
    weight = calibrated.density(_grid(axes))
    best = np.clip(calibrated.mean, [axis.low for axis in axes], [axis.high for axis in axes])

    def match(seen: Observation) -> Match:
        return match_prediction(seen, _emulator(seen, population, width).predict(best))

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
    )


def _population(axes: Sequence[Axis], draws: Draws) -> Population:
    """Runs with the places of their machines along the axes."""
    places = np.array([[_value(axis, m) for axis in axes] for m in draws.machines])
    deviations = np.array(
        [[dict(m.deviations).get(s, 0.0) for s in DEVIATING] for m in draws.machines]
    )
    return Population(places, deviations, draws.mean, draws.variance)


def _emulator(
    observation: Observation, population: Population, width: NDArray[np.float64]
) -> Emulator:
    """What machines between these would show on the bench of an observation."""
    used = np.any(population.deviations != 0.0, axis=0)
    return Emulator(
        population.places,
        population.deviations[:, used],
        population.channels(observation),
        observation.blocks,
        width,
        np.array([TOLERANCES[s] for s, u in zip(DEVIATING, used, strict=True) if u]),
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


def _kin(observation: Observation) -> int:
    """Machines in a family: each of them takes a lane per level."""
    levels = max(len(plan.levels_vpk) for plan, _ in observation.plans)
    return int(np.clip(_FULL_LANES // levels, _LEAST_KIN, _MOST_KIN))


def _wide_families(axes: Sequence[Axis], kin: int, seed: int) -> list[list[Machine]]:
    """Machines over the whole range: a lattice as the datasheet says, and families that are not."""
    lines = [np.linspace(axis.low, axis.high, axis.coarse) for axis in axes]
    places = np.stack([m.ravel() for m in np.meshgrid(*lines, indexing="ij")], axis=1)
    lattice = [_machine_at(axes, place, number) for number, place in enumerate(places)]
    low = np.array([axis.low for axis in axes])
    high = np.array([axis.high for axis in axes])
    rng = np.random.default_rng([seed, 1])
    return [lattice[at : at + kin] for at in range(0, len(lattice), kin)] + _families(
        axes, low, high, _WIDE_FAMILIES * len(axes), kin, rng
    )


def _near_families(
    axes: Sequence[Axis], found: Calibrated, kin: int, seed: int
) -> list[list[Machine]]:
    """Families about the answer so far."""
    low = np.array([axis.low for axis in axes])
    high = np.array([axis.high for axis in axes])
    scale = np.array([axis.scale for axis in axes])
    least = _LEAST_STD * scale
    std = np.sqrt(np.diag(found.covariance))
    growth = np.ceil(np.log(np.maximum(std / least, 1.0)) / np.log(_REACHES)).astype(int)
    steps = np.round((np.clip(found.mean, low, high) - low) / (_CENTRES * scale)).astype(int)
    centre = low + _CENTRES * scale * steps
    reach = _REACH * least * _REACHES**growth
    bottom, top = np.maximum(centre - reach, low), np.minimum(centre + reach, high)
    rng = np.random.default_rng([seed, 2, *steps.tolist(), *growth.tolist()])
    return _families(axes, bottom, top, _NEAR_FAMILIES * len(axes), kin, rng)


def _families(
    axes: Sequence[Axis],
    bottom: NDArray[np.float64],
    top: NDArray[np.float64],
    count: int,
    kin: int,
    rng: np.random.Generator,
) -> list[list[Machine]]:
    """Machines evenly over a box, each family of them off its datasheet in its own way.

    They differ from the datasheet as units do, so that what the regression gets
    wrong about them is what it will get wrong about a unit.
    """
    first = int(rng.integers(2**30))
    families = []
    for family in range(count):
        deviations = tuple(
            (symbol, float(rng.normal(0.0, TOLERANCES[symbol]))) for symbol in DEVIATING
        )
        # Evenly along every axis, in an order of its own along each.
        strata = np.stack([rng.permutation(kin) for _ in axes], axis=1)
        places = bottom + (top - bottom) * (strata + rng.uniform(size=strata.shape)) / kin
        families.append(
            [
                replace(_machine_at(axes, place, first + 1000 * family + i), deviations=deviations)
                for i, place in enumerate(places)
            ]
        )
    return families


def _machine_at(axes: Sequence[Axis], place: NDArray[np.float64], seed: int) -> Machine:
    # Nobody knows where the gears lie when a sweep starts, and at low drive that
    # decides which branch it follows: half of the machines start anywhere.
    machine = Machine(ratio=0.0, seed=seed, start_spread=START_SPREAD if seed % 2 else 1.0)
    for axis, value in zip(axes, place, strict=True):
        machine = axis.machine(machine, float(value))
    return machine
