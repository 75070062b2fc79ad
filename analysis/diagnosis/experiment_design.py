"""Which measurement would tell a set of causes from its rivals.

Owns a grid of sweeps that the unit's limits allow and the choice among them:
for each all of them are simulated over all places at which they agree with
what was measured, and the sweep that parts the first furthest from the rival it is
hardest to tell from, in standard deviations of reading and motion together, is
proposed; a rival that no sweep can tell it from counts for nothing. A cheaper one that
does nearly as well is preferred.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.likelihood import TEMPERATURE
from analysis.ensemble.datasheet_spread import spread_of
from analysis.ensemble.runs import Group, Population, simulate_groups
from analysis.execution.executor import Executor
from analysis.inference.run_design import runs_along_ridge
from analysis.observation.observation import Observation, channels_of_readings, unread
from analysis.observation.reading_noise import noise_and_floor
from daq.configs import config_names
from daq.plan import SweepPlan, spaced_frequencies
from sim.unit import Unit

__all__ = ["CLEAR_SIGMA", "NextMeasurement", "Separate", "propose_measurement", "separations"]

CLEAR_SIGMA = 2.0
"""What a further sweep has to part two sets by, to be worth its while."""

_POINTS = 31
_COARSE = 16
"""Frequencies of a proposed sweep, and how many of them are simulated to judge it."""

_GROUPS = 4
_ENOUGH = 0.9
"""A plan that parts the rivals this share as well as the best but takes less time is taken."""

_FLOOR, _OF_GAIN = 0.01, 2.0
"""Difference in log gain or phase, rad, that deviations of a datasheet could make anyway, and as a
multiple of what the tachometer's gain may be off by."""

_Moments = tuple[NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True, slots=True)
class NextMeasurement:
    """A sweep, the two sets of causes it parts, and by how many standard deviations.

    `unit` is the unit's name, or the path of its file; `address` is where the instrument is, and
    `serial` whose number the specimen has, as far as anybody said. `others`: further rivals of the
    first set, and by how many it is parted from each.
    """

    unit: str
    plan: SweepPlan
    separates: tuple[str, str]
    expected_sigma: float
    others: tuple[tuple[str, float], ...] = ()
    address: str = ""
    serial: str = ""

    @property
    def command(self) -> str:
        """What takes this sweep; ``URL`` stands for an instrument that nobody said where it is."""
        f, unit = self.plan.frequencies_hz, self.unit
        if unit.lower() in config_names("units"):
            unit = unit.lower()
        parts = [f"lashbench measure --unit {shlex.quote(unit)}"]
        parts.append(f"--instrument {shlex.quote(self.address or 'URL')}")
        if self.serial:
            parts.append(f"--serial {shlex.quote(self.serial)}")
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
            "others": [
                {"separates": [self.separates[0], name], "expected_sigma": sigma}
                for name, sigma in self.others
            ],
        }


class Separate(Protocol):
    """Says how far groups of runs are from the first one's in a plan, in standard deviations."""

    def __call__(
        self,
        unit: Unit,
        groups: Sequence[Sequence[Group]],
        plan: SweepPlan,
        noise_v: float,
        rng: np.random.Generator,
        executor: Executor | None,
        /,
    ) -> list[float]:
        """One number for each group but the first."""
        ...


def separations(
    unit: Unit,
    groups: Sequence[Sequence[Group]],
    plan: SweepPlan,
    noise_v: float,
    rng: np.random.Generator,
    executor: Executor | None = None,
) -> list[float]:
    """How far groups of runs are from the first hypothesis', in standard deviations of both."""
    grid = plan.frequencies_hz
    thinned = replace(plan, frequencies_hz=grid[:: max(len(grid) // _COARSE, 1)])
    asked = [group for of_one in groups for group in of_one]
    made = simulate_groups(unit, asked, unread(thinned, noise_v), rng, executor)
    first, *rivals = (
        _moments(made[of_one[0].hypothesis.effects], plan.levels_vpk[0], noise_v)
        for of_one in groups
    )
    share = len(grid) / len(thinned.frequencies_hz)
    least = max(_FLOOR, _OF_GAIN * spread_of(unit).gain)
    return [float(np.sqrt(share * _squares(first, rival, least) / TEMPERATURE)) for rival in rivals]


def propose_measurement(
    unit: Unit,
    first: FittedModel,
    rivals: Sequence[FittedModel],
    observation: Observation,
    *,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
    separate: Separate = separations,
) -> NextMeasurement | None:
    """The plan that best separates a candidate from its rivals, or None if the limits allow none.

    Parameters
    ----------
    separate
        How plans are judged; by simulation, if left out.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    rng = np.random.default_rng(seed)
    plans = list(_feasible_plans(unit, observation))
    groups = [tuple(runs_along_ridge(c, _GROUPS, rng)) for c in (first, *rivals)]
    apart = np.empty((len(plans), len(rivals)))
    for tried, plan in enumerate(plans):
        # The same machines in every plan, off their datasheets alike: plans differ by themselves.
        alike = np.random.default_rng(seed)
        apart[tried] = separate(unit, groups, plan, observation.noise_v, alike, executor)
        if progress is not None:
            progress((tried + 1) / len(plans))
    if not len(plans):
        return None
    # What no sweep tells from the first must not decide which sweep tells the others from it.
    told = np.flatnonzero(apart.max(axis=0) >= CLEAR_SIGMA)
    judged = apart[:, told].min(axis=1) if len(told) else apart.max(axis=1)
    good = np.flatnonzero(judged >= _ENOUGH * judged.max())
    number = min(good.tolist(), key=lambda one: plans[one].duration_s)
    named = int(np.flatnonzero(apart[number] == judged[number])[0])
    names = [_name(rival) for rival in rivals]
    others = [(name, float(s)) for name, s in zip(names, apart[number], strict=True)]
    del others[named]
    return NextMeasurement(
        unit.name,
        plans[number],
        (_name(first), names[named]),
        float(judged[number]),
        tuple(others),
    )


def _name(candidate: FittedModel) -> str:
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


def _squares(one: _Moments, other: _Moments, least: float) -> float:
    """Sum of the squares by which two hypotheses are apart, in units of their variances."""
    apart = one[0] - other[0]
    apart[1] = np.angle(np.exp(1j * apart[1]))
    floor = np.array([least, least, 0.3])[:, None]
    return float(np.sum(apart**2 / (one[1] + other[1] + floor**2)))


def _moments(population: Population, level_vpk: float, noise_v: float) -> _Moments:
    """Mean and variance (3, rows) of what runs read."""
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
