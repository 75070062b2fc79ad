"""Which measurement would tell two causes apart.

Owns a grid of sweeps that the unit's limits allow and the choice among them:
for each the two candidates are simulated over all places at which they agree
with what was measured, and the sweep that parts them furthest, in standard
deviations of reading and motion together, is proposed. A cheaper one that
does nearly as well is preferred.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.candidate import Candidate
from analysis.executor import Executor
from analysis.likelihood import HEAT
from analysis.observation import Observation, channels_of_readings, noise_and_floor, unread
from analysis.placement import groups_along
from analysis.population import Group, Population, simulate_groups
from daq.configs import config_names
from daq.plan import SweepPlan, spaced_frequencies
from sim.unit import Unit

__all__ = ["NextMeasurement", "propose_measurement"]

_POINTS = 31
_COARSE = 16
"""Frequencies of a proposed sweep, and how many of them are simulated to judge it."""

_GROUPS = 4
_ENOUGH = 0.9
"""A plan that parts the rivals this share as well as the best but takes less time is taken."""

_FLOOR = 0.01
"""Difference in log gain or phase, rad, that deviations of a datasheet could make anyway."""


@dataclass(frozen=True, slots=True)
class NextMeasurement:
    """A sweep, the two sets of causes it parts, and by how many standard deviations.

    `unit` is the unit's name, or the path of its file.
    """

    unit: str
    plan: SweepPlan
    separates: tuple[str, str]
    expected_sigma: float

    @property
    def command(self) -> str:
        """The options with which ``lashbench measure`` takes this sweep."""
        f, unit = self.plan.frequencies_hz, self.unit
        if unit.lower() in config_names("units"):
            unit = unit.lower()
        parts = [f"lashbench measure --unit {shlex.quote(unit)} --instrument URL"]
        parts += [f"--level {level:g}" for level in self.plan.levels_vpk]
        parts += [f"--start {f[0]:g} --stop {f[-1]:g} --points {len(f)}"]
        if self.plan.direction != "up":
            parts.append(f"--direction {self.plan.direction}")
        parts.append(f"--settle-cycles {self.plan.settle_cycles}")
        parts.append(f"--integrate-cycles {self.plan.integrate_cycles}")
        if self.plan.dc_offset_v:
            parts.append(f"--offset {self.plan.dc_offset_v:g}")
        return " ".join(parts)

    def to_json(self) -> dict[str, Any]:
        """The entry ``next_measurement``."""
        f = self.plan.frequencies_hz
        return {
            "plan": {
                "levels_vpk": list(self.plan.levels_vpk),
                "start_hz": f[0],
                "stop_hz": f[-1],
                "points": len(f),
                "spacing": "lin",
                "direction": self.plan.direction,
                "settle_cycles": self.plan.settle_cycles,
                "integrate_cycles": self.plan.integrate_cycles,
                "dc_offset_v": self.plan.dc_offset_v,
                "minutes": self.plan.duration_s / 60.0,
                "command": self.command,
            },
            "separates": list(self.separates),
            "expected_sigma": self.expected_sigma,
        }


def propose_measurement(
    unit: Unit,
    first: Candidate,
    second: Candidate,
    observation: Observation,
    *,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
) -> NextMeasurement | None:
    """The plan that best separates two candidates, or None where the limits allow none."""
    rng = np.random.default_rng(seed)
    plans = list(_feasible_plans(unit, observation))
    groups = [tuple(groups_along(c, _GROUPS, rng)) for c in (first, second)]
    judged = []
    for number, plan in enumerate(plans):
        # The same machines in every plan, off their datasheets alike: plans differ by themselves.
        alike = np.random.default_rng(seed)
        judged.append(_separation(unit, groups, plan, observation.noise_v, alike, executor))
        if progress is not None:
            progress((number + 1) / len(plans))
    if not judged:
        return None
    most = max(judged)
    good = [p for p, sigma in zip(plans, judged, strict=True) if sigma >= _ENOUGH * most]
    plan = min(good, key=lambda p: p.duration_s)
    return NextMeasurement(
        unit.name, plan, (_name(first), _name(second)), float(judged[plans.index(plan)])
    )


def _name(candidate: Candidate) -> str:
    return "+".join(candidate.hypothesis.effects) or "none"


def _feasible_plans(unit: Unit, observation: Observation) -> Iterator[SweepPlan]:
    """Sweeps of one level: those of the measurement and around them, each within the limits."""
    limits = unit.limits
    least, most = float(observation.source_vpk.min()), float(observation.source_vpk.max())
    base = observation.plans[0][0]
    grids = [spaced_frequencies(*band, _POINTS) for band in _feasible_bands(unit, observation)]
    if not grids:
        return
    # Measured beyond the limits, another unit's file say, it is asked for at the limit.
    wanted = (0.5 * least, least, most, 1.25 * most)
    levels = [v for v in wanted if v <= limits.source_vpk] or [limits.source_vpk]
    levels = sorted({round(v, 3) for v in levels})
    for level in levels:
        for grid in grids:
            yield replace(base, frequencies_hz=grid, levels_vpk=(level,), dc_offset_v=0.0)
    middle = levels[len(levels) // 2]
    one = replace(base, frequencies_hz=grids[0], levels_vpk=(middle,), dc_offset_v=0.0)
    yield replace(one, direction="down" if base.direction == "up" else "up")
    offset = min(limits.source_offset_v, limits.source_vpk - middle)
    if offset > 0.0:
        yield replace(one, dc_offset_v=round(offset, 3))


def _feasible_bands(unit: Unit, observation: Observation) -> Iterator[tuple[float, float]]:
    """The band that was measured and a wider one, as far as the limits allow."""
    low, high = float(observation.frequency_hz.min()), float(observation.frequency_hz.max())
    for bottom, top in ((low, high), (0.6 * low, 1.5 * high)):
        allowed = max(bottom, unit.limits.start_hz), min(top, unit.limits.stop_hz)
        if allowed[0] < allowed[1]:
            yield allowed


def _separation(
    unit: Unit,
    groups: Sequence[Sequence[Group]],
    plan: SweepPlan,
    noise_v: float,
    rng: np.random.Generator,
    executor: Executor | None = None,
) -> float:
    """How far two hypotheses' groups of runs are apart, in standard deviations of both."""
    grid = plan.frequencies_hz
    thinned = replace(plan, frequencies_hz=grid[:: max(len(grid) // _COARSE, 1)])
    asked = [group for of_one in groups for group in of_one]
    made = simulate_groups(unit, asked, unread(thinned, noise_v), rng, executor)
    (mean_1, var_1), (mean_2, var_2) = (
        _moments(made[of_one[0].hypothesis.effects], plan.levels_vpk[0], noise_v)
        for of_one in groups
    )
    apart = mean_1 - mean_2
    apart[1] = np.angle(np.exp(1j * apart[1]))
    floor = np.array([_FLOOR, _FLOOR, 0.3])[:, None]
    squares = apart**2 / (var_1 + var_2 + floor**2)
    share = len(grid) / len(thinned.frequencies_hz)
    return float(np.sqrt(share * squares.sum() / HEAT))


def _moments(
    population: Population, level_vpk: float, noise_v: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    gain = np.median(np.abs(population.mean), axis=0)
    noise, floor = noise_and_floor(gain, level_vpk, noise_v)
    channels = channels_of_readings(population.mean, population.variance, noise, floor)
    turn = np.angle(np.mean(np.exp(1j * channels[:, 1]), axis=0))
    channels[:, 1] = turn + np.angle(np.exp(1j * (channels[:, 1] - turn)))
    variance = channels.var(axis=0)
    variance[:2] += noise**2
    # Of a point that drowned in noise the gain alone says something: that it did.
    variance[1:, floor > 0.0] = np.inf
    return channels.mean(axis=0), variance
