"""How a machine as the datasheet has it would read in the same sweep, over all contribution ratios.

Owns a few runs of such machines and local regression over their ratios: the expected reading and
the scatter of single runs. The network reads an observation relative to it, so that it need not
learn what is known without any cause. It names no cause.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.batch import Family, read_families
from analysis.ensemble.machine import Machine
from analysis.ensemble.run_cache import run_families
from analysis.execution.executor import Executor
from analysis.inference.inputs import SweptLevels
from analysis.observation.observation import Observation
from daq.plan import SweepPlan
from sim.unit import Unit

__all__ = [
    "FACTS",
    "Nominal",
    "compare",
    "expected",
    "nominal_families",
    "nominal_of",
    "nominal_runs",
    "relative",
    "remembering",
]

RUNS = 32
"""Machines of the datasheet, their ratios evenly over 0 to 1."""

PROFILE = 33
"""Ratios at which an observation is compared."""

FACTS = PROFILE + 2
"""What the comparison tells of an observation as a whole."""

_ENDS = (0.015, 0.985)

_REACH = 0.06
"""Half-width of the regression, in ratio. With Student's t it finds the ratio of 1,438 machines of
the prior that hide nothing best: 0.043 off in the median."""

_LEAST_STD = np.array([0.01, 0.01, 0.2])
_SEED = 7000
_TURN = np.float32(2.0 * np.pi)
_HEAT = 15.0
"""Neighbouring points err together: so many count for one."""


@dataclass(frozen=True, slots=True, eq=False)
class Nominal:
    """Expected channels of the datasheet's machine at `PROFILE` ratios.

    `mean`, `std` (PROFILE, 3, L, F): log gain, phase and log scatter of the mean (of both
    components, without reading noise), and the scatter of single runs. The phase's mean is an
    angle, rad.
    """

    mean: NDArray[np.float32]
    std: NDArray[np.float32]


def nominal_runs(
    unit: Unit, plan: SweepPlan, executor: Executor | None = None
) -> tuple[NDArray[np.complex64], NDArray[np.float32]]:
    """Mean and relative variance (RUNS, L, F) of machines as the datasheet has them."""
    family = Family(unit, _machines(unit), ((plan, np.arange(plan.points)),))
    ((mean, variance),) = read_families([family], executor)
    shape = (RUNS, len(plan.levels_vpk), len(plan.frequencies_hz))
    return mean.astype(np.complex64).reshape(shape), variance.astype(np.float32).reshape(shape)


def nominal_of(
    unit: Unit,
    observation: Observation,
    cache: Path | None = None,
    executor: Executor | None = None,
) -> Nominal:
    """The datasheet's machine in the sweep of an observation of one plan; its runs are kept."""
    draws = run_families(unit, nominal_families(unit), observation, cache=cache, executor=executor)
    ((plan, rows),) = observation.plans
    shape = (RUNS, len(plan.levels_vpk), len(plan.frequencies_hz))
    place = np.argsort(rows)
    return expected(
        draws.mean[:, place].astype(np.complex64).reshape(shape),
        draws.variance[:, place].astype(np.float32).reshape(shape),
    )


def remembering(simulate: Callable[[Observation], Nominal]) -> Callable[[Observation], Nominal]:
    """The same, that simulates no sweep twice."""
    known: dict[tuple[SweepPlan, bytes], Nominal] = {}

    def found(observation: Observation) -> Nominal:
        ((plan, rows),) = observation.plans
        key = plan, rows.tobytes()
        if key not in known:
            known[key] = simulate(observation)
        return known[key]

    return found


def nominal_families(unit: Unit) -> tuple[tuple[Machine, ...], tuple[Machine, ...]]:
    """The machines that are simulated of a datasheet, in two halves for two cores."""
    machines = _machines(unit)
    return machines[: RUNS // 2], machines[RUNS // 2 :]


def _machines(unit: Unit) -> tuple[Machine, ...]:
    ratios = np.linspace(*_ENDS, RUNS) if unit.stages > 1 else np.ones(RUNS)
    return tuple(Machine(float(ratio), _SEED + k) for k, ratio in enumerate(ratios))


def expected(mean: NDArray[np.complex64], variance: NDArray[np.float32]) -> Nominal:
    """Regress runs (RUNS, L, F) over their ratios."""
    smoothing = _smoothing()
    log_gain, phasor = np.log(np.abs(mean)), mean / np.abs(mean)
    log_scatter = 0.5 * np.log(variance + 1e-12)
    flat = [one.reshape(RUNS, -1) for one in (log_gain, phasor, log_scatter)]
    at_runs, at_profile = smoothing
    means, stds = [], []
    for channel, values in enumerate(flat):
        found = at_profile @ values
        missed = values - at_runs @ values
        if channel == 1:
            missed = np.angle(values * np.conj(at_runs @ values))
            found = np.angle(found)
        weight = np.abs(at_profile)
        weight /= weight.sum(axis=1, keepdims=True)
        # Six or so runs leave two parameters: what is left is smaller by that.
        std = np.sqrt(1.4 * (weight @ missed**2)) + _LEAST_STD[channel]
        means.append(found)
        stds.append(std)
    shape = (PROFILE, 3, *mean.shape[1:])
    return Nominal(
        np.stack(means, axis=1).astype(np.float32).reshape(shape),
        np.stack(stds, axis=1).astype(np.float32).reshape(shape),
    )


def compare(
    swept: SweptLevels, nominal: Nominal
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Log-likelihood of each ratio (n, PROFILE), and departures (n, PROFILE, 3, L, F).

    Departures are in standard deviations, NaN where nothing was read.
    """
    size = np.maximum(np.abs(swept.gain), 1e-9)
    volts = size * swept.levels_vpk[:, None].astype(np.float32)
    noise2 = (swept.noise_v[:, None, None] / volts) ** 2
    scatter = swept.scatter / np.sqrt(np.float32(swept.integrate_cycles))
    # A scatter is never below that of the reading noise.
    quiet = 0.5 * np.log(np.exp(2.0 * nominal.mean[:, 2]) + 2.0 * noise2[:, None])
    off = np.empty((len(size), *nominal.mean.shape), dtype=np.float32)
    off[:, :, 0] = np.log(size)[:, None] - nominal.mean[:, 0]
    angle = np.where(swept.phase_known, np.angle(swept.gain), np.nan)
    off[:, :, 1] = angle[:, None] - nominal.mean[:, 1]
    off[:, :, 1] -= _TURN * np.round(off[:, :, 1] / _TURN)
    off[:, :, 2] = np.log(scatter)[:, None] - quiet
    variance = np.repeat(nominal.std[None] ** 2, len(size), axis=0)
    variance[:, :, :2] += noise2[:, None, None]
    z2 = off * off / variance
    # Student's t of four degrees: a motion may be in another state over a stretch of the sweep.
    cost = np.where(np.isfinite(z2), 5.0 * np.log1p(z2 / 4.0) + np.log(variance), 0.0)
    log_likelihood = -0.5 * cost.sum(axis=(2, 3, 4)) / _HEAT
    z = np.asarray(off / np.sqrt(variance), dtype=np.float32)
    return np.asarray(log_likelihood, dtype=np.float32), z


def relative(
    sweeps: Sequence[tuple[SweptLevels, Nominal]],
) -> tuple[list[NDArray[np.float32]], NDArray[np.float32]]:
    """Departures (n, 4, L, F) of each sweep at the likeliest ratio of all sweeps together.

    And what is believed (n, `FACTS`): the probability of each ratio, the likeliest, and how far
    off it the readings typically are.
    """
    found = [compare(swept, nominal) for swept, nominal in sweeps]
    log_likelihood = np.sum([one for one, _ in found], axis=0)
    best = np.argmax(log_likelihood, axis=1)
    rows = np.arange(len(best))
    belief = np.exp(log_likelihood - log_likelihood[rows, best][:, None])
    belief /= belief.sum(axis=1, keepdims=True)
    chosen = [z[rows, best] for _, z in found]
    departures = [
        np.concatenate([z, np.log(nominal.std[best, 0])[:, None]], axis=1)
        for z, (_, nominal) in zip(chosen, sweeps, strict=True)
    ]
    both = np.concatenate([z[:, :2].reshape(len(best), -1) for z in chosen], axis=1)
    typical = np.sqrt(np.nanmedian(both**2, axis=1))
    facts = np.stack([best / (PROFILE - 1.0), np.log(typical + 0.1)], axis=1)
    return departures, np.concatenate([4.0 * belief, facts], axis=1).astype(np.float32)


def _smoothing() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Matrices (RUNS, RUNS) and (PROFILE, RUNS) of local linear regression over the ratio."""
    ratios = np.linspace(*_ENDS, RUNS)
    found = []
    for places in (ratios, np.linspace(*_ENDS, PROFILE)):
        offset = ratios - places[:, None]
        weight = np.maximum(1.0 - (offset / (_REACH * 1.5)) ** 2, 0.0) ** 2
        s0, s1, s2 = (np.sum(weight * offset**p, axis=1, keepdims=True) for p in range(3))
        found.append(weight * (s2 - s1 * offset) / (s0 * s2 - s1 * s1))
    return found[0], found[1]
