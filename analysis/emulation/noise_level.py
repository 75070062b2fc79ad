"""How noisy the reading itself is, where no point is quiet enough to show it.

Owns which noises are worth trying and how believable each is. Where the motion
chatters at every point, the quietest of them show more than the reading's own
noise, and a noise that is taken for too loud hides chatter: a machine with
less of it then looks right. Simulations decide between the noises that are
possible, as far as they can; what is learned from runs has to allow for all of
them. Nothing is simulated here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.likelihood import TEMPERATURE
from analysis.execution.executor import side_by_side
from analysis.observation.observation import Observation
from analysis.observation.reading_noise import USUAL_NOISE_V

__all__ = ["draw_noises", "likeliest_noise", "possible_noises"]

_NEAR = 1.3
"""Quietest points this close to the usual noise show it, and leave nothing to be tried."""

_NOISES = 6
_SPREAD = 0.5
"""One standard deviation of the logarithm of a bench's noise about the usual one."""


def possible_noises(observation: Observation) -> Sequence[Observation]:
    """The observation with every noise worth trying: from the usual one to what it shows itself."""
    if not _is_doubtful(observation):
        return [observation]
    noises = np.geomspace(USUAL_NOISE_V, observation.loudest_v, _NOISES)
    return [observation.with_noise(float(noise)) for noise in noises]


def draw_noises(
    observation: Observation, count: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Noises (count,) in V that runs may be read with, for what they tell of the observation.

    Where it is in doubt evenly, by logarithm, over all that are worth trying: the likeliest alone
    hides how far the answer depends on it, and a bench louder than most is not thought of by a
    belief about benches.
    """
    if not _is_doubtful(observation):
        return np.full(count, observation.noise_v)
    share = rng.permutation((np.arange(count) + rng.uniform(size=count)) / count)
    return np.asarray(USUAL_NOISE_V * (observation.loudest_v / USUAL_NOISE_V) ** share)


def _is_doubtful(observation: Observation) -> bool:
    return observation.loudest_v > _NEAR * USUAL_NOISE_V


def likeliest_noise(
    observations: Sequence[Observation],
    log_likelihood: Callable[[Observation], float],
) -> Observation:
    """The most probable among observations that differ in their noise.

    Parameters
    ----------
    log_likelihood
        Of the best that simulations do with each.
    """
    if len(observations) == 1:
        return observations[0]
    found = side_by_side(log_likelihood, observations)
    believed = [
        one / TEMPERATURE + _log_prior(seen) for one, seen in zip(found, observations, strict=True)
    ]
    return observations[int(np.argmax(believed))]


def _log_prior(observation: Observation) -> float:
    return -0.5 * float(np.log(observation.noise_v / USUAL_NOISE_V) / _SPREAD) ** 2
