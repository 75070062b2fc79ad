"""Identification: rounds of simulated drives that close in on the one that was swept.

Owns how drives are drawn and simulated in each round, and the reading that a bench would take of
them. What they tell is worked out in `analysis.commissioning.regression`. It writes nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.commissioning.coordinates import NOISE, Coordinates
from analysis.commissioning.regression import Gaussian, Round, regress
from analysis.ensemble.batch import Family, read_families
from analysis.execution.executor import Executor
from analysis.observation.observation import CHANNELS, Observation, channels_of_readings
from analysis.observation.reading_noise import USUAL_NOISE_V

Vector = NDArray[np.float64]

__all__ = ["Identified", "identify", "simulate_drives"]

_ROUNDS, _PER_COORDINATE, _LEAST = 6, 3, 12
"""Rounds, and families of each for every coordinate, at least so many; the last one, which settles
the covariance, has twice as many."""

_UNLIKE, _LEAST_MISFIT, _LARGE = 0.999, 1.5, 2.0
"""Share of simulated drives that the values describe better than the one that was swept, from which
on it is not such a drive if its misfit is at least this; nor is it with a misfit this large. Of 50
drives whose values explain their sweep it is 1.2 at most, which widens the errors; of one with a
load that swings 4.5, which a few simulated drives that lie far out have, too."""

_EARLIER = 2
"""Rounds before, whose drives tell slopes as well. They were drawn wider, where slopes differ."""

_USUAL = 0.95
"""Share of simulated drives below which a misfit tells of nothing but values."""

_LANES = 5
"""Drives of a family: they share their linear part, so that five cost hardly more than one."""


@dataclass(frozen=True, slots=True, eq=False)
class Identified:
    """The posterior of the coordinates and how well the last round's drives describe the sweep.

    `misfit`: root mean square of what the regression leaves of the measurement over that of the
    simulated drives; 1 is usual. `misfit_rank`: share of the simulated drives that it leaves less
    of.
    """

    posterior: Gaussian
    misfit: float
    misfit_rank: float

    @property
    def unlike(self) -> bool:
        """Whether what was swept is no such drive, whatever its values are."""
        return self.misfit > (_LEAST_MISFIT if self.misfit_rank >= _UNLIKE else _LARGE)

    @property
    def usual(self) -> bool:
        """Whether values leave no more of what was swept than they do of such drives."""
        return self.misfit_rank < _USUAL


def identify(
    coordinates: Coordinates,
    observation: Observation,
    *,
    prior: Gaussian | None = None,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
) -> Identified:
    """Identify the parameters of the drive that was swept.

    Parameters
    ----------
    coordinates
        Which parameters.
    observation
        One or several sweeps; the channels (3, rows) may hold NaN.
    prior
        Of the coordinates; standard normal if not given.
    seed
        Of the drives that are drawn.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    rng = np.random.default_rng(seed)
    prior = prior or Gaussian(coordinates.nominal(), np.eye(len(coordinates)))
    d, prior = len(coordinates), _with_another(prior)
    noise_v, spread = _possible_noise(observation)
    coordinates, observation = coordinates.with_noise(spread), observation.with_noise(noise_v)
    at = proposal = prior
    measured = observation.values.ravel()
    fit, earlier = None, list[Round]()
    families = max(_PER_COORDINATE * len(coordinates), _LEAST)
    for number in range(_ROUNDS):
        last = number == _ROUNDS - 1
        proposal = at.proposal(proposal) if number else prior
        drawn = simulate_drives(
            coordinates, observation, proposal, (1 + last) * families, rng, executor
        )
        fit = regress(drawn, measured, proposal, prior, earlier=earlier[-_EARLIER:], last=last)
        at = fit.posterior
        earlier.append(drawn)
        if progress is not None:
            progress((number + 1) / _ROUNDS)
    assert fit is not None
    return Identified(Gaussian(at.mean[:d], at.covariance[:d, :d]), fit.misfit, fit.misfit_rank)


def simulate_drives(
    coordinates: Coordinates,
    observation: Observation,
    proposal: Gaussian,
    families: int,
    rng: np.random.Generator,
    executor: Executor | None,
    progress: Callable[[float], None] | None = None,
) -> Round:
    """Drives drawn from a proposal, `_LANES` of each family differing in what is free alone."""
    free = coordinates.free
    common = np.repeat(proposal.draw(rng, families), _LANES, axis=0)
    z = _with_free_redrawn(common, free, proposal, rng) if free.any() else common
    seeds = rng.integers(2**30, size=len(z))
    # What scales the response takes no part in the motion, and would tell families apart.
    moved = np.where(coordinates.scales, 0.0, z)
    machines = [coordinates.machine(m, int(s)) for m, s in zip(moved, seeds, strict=True)]
    lots = [
        Family(
            coordinates.unit,
            tuple(machines[i : i + _LANES]),
            observation.plans,
            observation.components,
        )
        for i in range(0, len(z), _LANES)
    ]
    read = read_families(lots, executor, progress)
    mean = np.concatenate([one for one, _ in read])
    variance = np.concatenate([one for _, one in read])
    only = coordinates.scales
    gain = np.prod(coordinates.factors(np.where(only, z, 0.0))[:, only], axis=1)
    noise = observation.noise
    if NOISE in coordinates.symbols:
        louder = coordinates.factors(z)[:, coordinates.symbols.index(NOISE)]
        noise = noise * louder[:, None]
    # What an analyser adds to each reading is drawn: it is part of what the regression leaves. So
    # is what few cycles tell of the scatter, and of it one component alone.
    disturbed = mean * (gain[:, None] + noise * _complex_normal(rng, mean.shape))
    told = np.exp(observation.scatter_sampling * rng.standard_normal(mean.shape))
    y = channels_of_readings(disturbed, variance * told**2, noise * told, observation.floor)
    angles = np.repeat([name == "phase" for name in CHANNELS], y.shape[-1])
    sweeps = np.concatenate(
        [np.full(b.stop - b.start, place) for place, b in enumerate(observation.blocks)]
    )
    series = np.concatenate([sweeps + len(sweeps) * channel for channel in range(len(CHANNELS))])
    owners = np.repeat(np.arange(families), _LANES)
    return Round(z, owners, y.reshape(len(z), -1), angles, series)


def _with_another(prior: Gaussian) -> Gaussian:
    """A prior of coordinates and one more, which is standard normal."""
    covariance = np.eye(len(prior.mean) + 1)
    covariance[:-1, :-1] = prior.covariance
    return Gaussian(np.append(prior.mean, 0.0), covariance)


def _possible_noise(observation: Observation) -> tuple[float, float]:
    """Reading noise, V, and one standard deviation of its logarithm.

    From the usual one, where the motion scatters at every point, to what the quietest points show.
    """
    quiet = min(USUAL_NOISE_V, observation.loudest_v)
    loud = observation.loudest_v * np.exp(2.0 * observation.scatter_sampling)
    return float(np.sqrt(quiet * loud)), float(0.5 * np.log(loud / quiet))


def _with_free_redrawn(
    z: Vector, free: NDArray[np.bool_], proposal: Gaussian, rng: np.random.Generator
) -> Vector:
    """Coordinates (n, d) whose free ones are drawn anew, given the others."""
    c = proposal.covariance
    across = np.linalg.solve(c[np.ix_(~free, ~free)], c[np.ix_(~free, free)])
    left = c[np.ix_(free, free)] - c[np.ix_(free, ~free)] @ across
    drawn = Gaussian(np.zeros(int(free.sum())), left).draw(rng, len(z))
    found = z.copy()
    found[:, free] = proposal.mean[free] + (z - proposal.mean)[:, ~free] @ across + drawn
    return found


def _complex_normal(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.complex128]:
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
