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

import numpy as np
from numpy.typing import NDArray

from analysis.calibration import Calibrated, calibrate
from analysis.emulator import Emulator
from analysis.ensemble import TOLERANCES, Draws, Machine, run_machines
from analysis.likelihood import Match, match_prediction
from analysis.observation import Observation
from sim.response import START_SPREAD
from sim.unit import Unit

__all__ = ["Axis", "Posterior", "RATIO", "fit_posterior"]

Progress = Callable[[float, str], None]

_SIMULATED = ("R_m", "k_t", "J_L", "k_s1", "k_a")
"""Datasheet values whose spread is simulated; that of k_ts scales the gain alone."""

_FIRST_GROUPS, _GROUPS, _PER_GROUP = 4, 20, 8
"""Groups of machines that share their deviations, and so are stepped together; machines in each."""

_REACH = 3.5
"""Machines lie up to so many standard deviations from the answer so far."""


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

    def marginal(self, axis: int) -> NDArray[np.float64]:
        """Weights along one axis, summing to one."""
        others = tuple(i for i in range(self.weight.ndim) if i != axis)
        return np.asarray(self.weight.sum(axis=others))


def fit_posterior(
    unit: Unit,
    observation: Observation,
    axes: Sequence[Axis] = (RATIO,),
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> Posterior:
    """Fit the free numbers of a unit to an observation.

    Raises
    ------
    AnalysisError
        If a motion grew without bound, or the data leave no likelihood.
    """

    def report(low: float, high: float, text: str) -> Callable[[float], None] | None:
        if progress is None:
            return None
        return lambda part: progress(low + (high - low) * part, text)

    rng = np.random.default_rng(seed)
    axes = tuple(axes)
    scales = np.array([axis.scale for axis in axes])
    draws = run_machines(
        unit, _coarse_machines(axes), observation, report(0.0, 0.2, "simulating the range")
    )
    # The regression leans towards where its runs are: each round is centred anew.
    for low, high, groups in ((0.2, 0.4, _FIRST_GROUPS), (0.4, 0.95, _GROUPS)):
        found = calibrate(observation, _Look(observation, axes, draws, scales).emulator, rng)
        machines = _fine_machines(axes, found, groups * len(axes), rng)
        text = "simulating near the answer"
        draws = draws.joined(run_machines(unit, machines, observation, report(low, high, text)))
    look = _Look(observation, axes, draws, 0.6 * scales)
    calibrated = calibrate(observation, look.emulator, rng)
    weight = calibrated.density(_grid(axes))
    best = np.clip(calibrated.mean, [axis.low for axis in axes], [axis.high for axis in axes])
    if progress is not None:
        progress(1.0, "done")
    return Posterior(
        axes,
        tuple(np.linspace(axis.low, axis.high, _fine_count(axis)) for axis in axes),
        weight.reshape(tuple(_fine_count(axis) for axis in axes)),
        tuple(float(v) for v in best),
        look.match(best),
        draws,
    )


class _Look:
    """An emulator over draws, asked for likelihoods at places."""

    def __init__(
        self,
        observation: Observation,
        axes: Sequence[Axis],
        draws: Draws,
        width: NDArray[np.float64],
    ) -> None:
        self._observation = observation
        places = np.array([[_value(axis, m) for axis in axes] for m in draws.machines])
        deviations = np.array(
            [[dict(m.deviations).get(s, 0.0) for s in _SIMULATED] for m in draws.machines]
        )
        used = np.any(deviations != 0.0, axis=0)
        symbols = [s for s, u in zip(_SIMULATED, used, strict=True) if u]
        self.emulator = Emulator(
            places,
            deviations[:, used],
            draws.channels,
            observation.blocks,
            width,
            np.array([TOLERANCES[s] for s in symbols]),
        )

    def match(self, place: NDArray[np.float64]) -> Match:
        return match_prediction(self._observation, self.emulator.predict(place))


def _value(axis: Axis, machine: Machine) -> float:
    value = getattr(machine, axis.name)
    return float(value)


def _grid(axes: Sequence[Axis]) -> NDArray[np.float64]:
    lines = [np.linspace(axis.low, axis.high, _fine_count(axis)) for axis in axes]
    mesh = np.meshgrid(*lines, indexing="ij")
    return np.stack([m.ravel() for m in mesh], axis=1)


def _fine_count(axis: Axis) -> int:
    return 6 * (axis.coarse - 1) // 2 + 1


def _coarse_machines(axes: Sequence[Axis]) -> list[Machine]:
    lines = [np.linspace(axis.low, axis.high, axis.coarse) for axis in axes]
    places = np.stack([m.ravel() for m in np.meshgrid(*lines, indexing="ij")], axis=1)
    return [_machine_at(axes, place, seed) for seed, place in enumerate(places)]


def _fine_machines(
    axes: Sequence[Axis], found: Calibrated, groups: int, rng: np.random.Generator
) -> list[Machine]:
    """Machines evenly about the answer so far, each group of them off its datasheet in its own way.

    They differ from the datasheet as units do, so that what the regression gets
    wrong about them is what it will get wrong about a unit.
    """
    low = np.array([axis.low for axis in axes])
    high = np.array([axis.high for axis in axes])
    least = np.array([0.5 * axis.scale for axis in axes])
    reach = _REACH * np.maximum(np.sqrt(np.diag(found.covariance)), least)
    centre = np.clip(found.mean, low, high)
    bottom, top = np.maximum(centre - reach, low), np.minimum(centre + reach, high)

    def place() -> NDArray[np.float64]:
        return rng.uniform(bottom, top)

    first = int(rng.integers(2**30))
    machines = []
    for g in range(groups):
        deviations = tuple(
            (symbol, float(rng.normal(0.0, TOLERANCES[symbol]))) for symbol in _SIMULATED
        )
        for i in range(_PER_GROUP):
            machine = _machine_at(axes, place(), first + 1000 * g + i)
            machines.append(replace(machine, deviations=deviations))
    return machines


def _machine_at(axes: Sequence[Axis], place: NDArray[np.float64], seed: int) -> Machine:
    # Nobody knows where the gears lie when a sweep starts, and at low drive that
    # decides which branch it follows: half of the machines start anywhere.
    machine = Machine(ratio=0.0, seed=seed, start_spread=START_SPREAD if seed % 2 else 1.0)
    for axis, value in zip(axes, place, strict=True):
        machine = axis.machine(machine, float(value))
    return machine
