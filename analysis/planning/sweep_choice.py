"""The sweep that tells most of the backlash of the stages in so many minutes.

Owns one ensemble of drives as the datasheet allows, taken through a wide and dense sweep, and the
comparison of shorter sweeps as parts of it: expected error of the contribution ratio, or of the
total backlash of a drive with one stage (Chaloner and Verdinelli 1995). It measures nothing and
knows no bench.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
import tomlkit
from numpy.typing import NDArray

from analysis.commissioning.coordinates import BACKLASH, RATIO, Coordinates
from analysis.commissioning.identification import simulate_drives
from analysis.commissioning.regression import Gaussian, expected_std
from analysis.execution.blas import on_one_core
from analysis.execution.executor import Executor
from analysis.execution.progress import Progress, part_of
from analysis.inference.plans import landmarks
from analysis.observation.observation import Observation, unread
from analysis.observation.reading_noise import USUAL_NOISE_V
from daq.errors import InputError
from daq.plan import SweepPlan, spaced_frequencies
from daq.recipe import Recipe
from daq.untrusted.bounded_text import parse_toml
from sim.effect import shaft_at_load
from sim.unit import Unit

__all__ = ["Planned", "plan_sweep"]

_LOOKS = ((61, 20, 30), (41, 10, 15), (31, 6, 10), (21, 3, 6))
"""Frequencies of the ensemble's sweep, of which a shorter one takes some, and cycles that settle
and are averaged at each: the first that drives the ensemble no longer than `_LONGEST_S`, or the
last. A slow drive takes few cycles of seconds in place of many."""

_LONGEST_S = 150.0

_BAND = (0.6, 1.6)
"""Its ends, as multiples of the lowest anti-resonance and of the usual resonance."""

_AROUND = (0.2, 5.0)
"""Band in which the features are looked for, as multiples of the load's frequency on shaft 1."""

_LEVELS = (0.15, 0.3, 0.5, 0.8)
"""Source levels, as shares of the highest that the unit may be given."""

_BANDS = ((0.0, 1.0), (0.1, 0.7), (0.2, 0.8), (0.3, 1.0))
"""Bands of shorter sweeps, as shares of the ensemble's."""

_PER_COORDINATE, _LEAST_FAMILIES = 3, 24
"""Families of the ensemble for every coordinate, and at least."""

_FEWEST = 11
"""Points that a sweep has at least."""

_STILL = 0.5
"""Gain at a level, over that at the highest, below which friction holds the drive still."""

_NOTHING = 0.9
"""Expected error over that of the datasheet above which a sweep tells nothing."""

_ENOUGH = 1.05
"""Of sweeps that are as good as the best but for this factor the shortest is taken."""


@dataclass(frozen=True, slots=True)
class Planned:
    """A sweep, and what is expected of it.

    `arf_hz`, `rf_hz`: 5 %, 50 % and 95 % quantiles over drives as the datasheet allows, at the
    middle level; None where most show none. `expected_std`: expected error of the `quantity`,
    ``contribution_ratio`` or ``b_t_deg``, by a linear estimate, and `usual_std` that of the best
    sweep of one level in the same time; `prior_std` is that of the datasheet. `still_vpk`: levels
    that friction holds. `limits`: what the unit's limits cut off.
    """

    unit: str
    plan: SweepPlan
    minutes: float
    arf_hz: tuple[float, float, float] | None
    rf_hz: tuple[float, float, float] | None
    quantity: str
    expected_std: float
    usual_std: float
    prior_std: float
    still_vpk: tuple[float, ...]
    limits: tuple[str, ...]

    @property
    def _sweep(self) -> dict[str, Any]:
        """The sweep, as the document and the recipe name it."""
        f = self.plan.frequencies_hz
        return {
            "levels_vpk": list(self.plan.levels_vpk),
            "start_hz": f[0],
            "stop_hz": f[-1],
            "points": len(f),
            "spacing": "log",
            "settle_cycles": self.plan.settle_cycles,
            "integrate_cycles": self.plan.integrate_cycles,
        }

    @property
    def _symbol(self) -> str:
        return " deg" if self.quantity == BACKLASH else ""

    @property
    def _expected(self) -> str:
        """The quantity and its expected error, in words."""
        name = "total backlash" if self.quantity == BACKLASH else "contribution ratio"
        return f"{name} {self.expected_std:.2g}{self._symbol}"

    def to_json(self) -> dict[str, Any]:
        """The document of ``plan --json``."""
        return {
            "unit": self.unit,
            "plan": self._sweep,
            "minutes": self.minutes,
            "arf_hz": _quantiles(self.arf_hz),
            "rf_hz": _quantiles(self.rf_hz),
            self.quantity: {"expected_std": self.expected_std, "one_level": self.usual_std},
            "held_by_friction_vpk": list(self.still_vpk),
            "limits": list(self.limits),
        }

    def summary(self) -> list[str]:
        """Lines of text for a person."""
        f = self.plan.frequencies_hz
        levels = ", ".join(f"{level:g}" for level in self.plan.levels_vpk)
        lines = [f"{self.unit}:"]
        for name, found in (("ARF", self.arf_hz), ("RF", self.rf_hz)):
            lines.append(
                f"  {name} expected at {found[1]:.4g} Hz, within {found[0]:.4g} to {found[2]:.4g} "
                "Hz for 90 % of such drives" if found is not None
                else f"  {name}: most such drives show none in this band"
            )  # fmt: skip
        lines += [
            f"  sweep {len(f)} points, log spaced, from {f[0]:.4g} to {f[-1]:.4g} Hz at {levels} V",
            f"  driving time {self.minutes:.2g} min",
            f"  expected error of the {self._expected} "
            f"({self.usual_std:.2g}{self._symbol} with one level in the same time)",
        ]
        if self.expected_std > _NOTHING * self.prior_std:
            lines.append(
                f"  no sweep of this time tells it: the datasheet leaves {self.prior_std:.2g}"
                f"{self._symbol}"
            )
        if self.still_vpk:
            still = ", ".join(f"{level:g}" for level in self.still_vpk)
            lines.append(f"  friction holds the drive at {still} V: little motion there")
        return lines + [f"  {text}" for text in self.limits]

    def recipe(self) -> str:
        """The text of a recipe file (TOML) of this plan."""
        document = tomlkit.document()
        document.add(tomlkit.comment(f"expected error of this sweep: {self._expected}"))
        document.add("schema", tomlkit.item(1))
        document.add("name", tomlkit.item(self.unit))
        sweep = tomlkit.table()
        sweep.update(self._sweep)
        document.add("sweep", sweep)
        text = tomlkit.dumps(document)
        Recipe.model_validate(parse_toml(text))
        return text


@on_one_core()
def plan_sweep(
    unit: Unit,
    minutes: float,
    *,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Planned:
    """The sweep of a unit that tells most of its contribution ratio in a time, minutes.

    Of a drive with one stage it tells most of the total backlash.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    InputError
        If the time is too short for any sweep, or a total backlash of zero is to be planned for.
    """
    coordinates = Coordinates.of(unit, total_backlash_unknown=unit.stages == 1)
    quantity, scale = (RATIO, 1.0) if unit.stages > 1 else (BACKLASH, unit.backlash.b_t_deg)
    wide, cut = _wide_plan(unit)
    observation = unread(wide, USUAL_NOISE_V)
    parts = list(_parts(wide, observation, 60.0 * minutes))
    if not parts:
        few = wide.frequencies_hz[:: (len(wide.frequencies_hz) - 1) // (_FEWEST - 1)]
        shortest = replace(wide, frequencies_hz=few, levels_vpk=wide.levels_vpk[-1:])
        raise InputError(
            f"{minutes:g} min: the shortest useful sweep of {unit.name} takes "
            f"{shortest.duration_s / 60.0:.2g} min; give more"
        )
    prior = Gaussian(coordinates.nominal(), np.eye(len(coordinates)))
    report = part_of(progress, 0.0, 1.0, "simulating drives as the datasheet allows")
    families = max(_PER_COORDINATE * len(coordinates), _LEAST_FAMILIES)
    drawn = simulate_drives(
        coordinates, observation, prior, families, np.random.default_rng(seed), executor, report
    )
    found = []
    values = scale * coordinates.factors(drawn.z)[:, coordinates.symbols.index(quantity)]
    for rows, frequencies, levels in parts:
        columns = np.tile(rows, drawn.y.shape[1] // len(observation))
        std = expected_std(drawn, prior, columns, values)
        plan = replace(wide, frequencies_hz=frequencies, levels_vpk=levels)
        found.append((std, plan.duration_s, plan))
    least = min(std for std, _, _ in found)
    std, _, plan = min((one for one in found if one[0] <= _ENOUGH * least), key=lambda one: one[1])
    single = [std for std, _, one in found if len(one.levels_vpk) == 1]
    log_gain = drawn.y.reshape(len(drawn.z), 3, len(wide.levels_vpk), -1)[:, 0]
    if unit.sensor is not None and unit.sensor.kind == "current":
        # What is a maximum of the speed is a minimum of the current.
        log_gain = -log_gain
    middle = log_gain[:, len(wide.levels_vpk) // 2]
    grid = np.array(wide.frequencies_hz)
    arf, rf = _features(grid, middle) if _shows_arf(unit) else (None, _highest(grid, middle))
    return Planned(
        unit.name, plan, plan.duration_s / 60.0, arf, rf, quantity, std, min(single, default=std),
        float(np.std(values)), _still(wide, log_gain), cut,
    )  # fmt: skip


def _wide_plan(unit: Unit) -> tuple[SweepPlan, tuple[str, ...]]:
    """The ensemble's sweep within the unit's limits, and what these cut off."""
    limits = unit.limits
    load_hz = math.sqrt(shaft_at_load(unit) / unit.load.J_L) / (2.0 * math.pi)
    # Where features lie does not depend on where the unit may be driven.
    around = {"start_hz": _AROUND[0] * load_hz, "stop_hz": _AROUND[1] * load_hz}
    marks = landmarks(unit.model_copy(update={"limits": limits.model_copy(update=around)}))
    low, high = _BAND[0] * marks.arf_hz, _BAND[1] * marks.rf_hz
    start, stop = max(low, limits.start_hz), min(high, limits.stop_hz)
    if start > marks.arf_hz or stop < marks.rf_hz:
        raise InputError(
            f"unit {unit.name}: its limits, and the bench's, allow {limits.start_hz:g} to "
            f"{limits.stop_hz:g} Hz, and its features lie near {marks.arf_hz:.4g} and "
            f"{marks.rf_hz:.4g} Hz; see [limits]"
        )
    cut = []
    if start > low:
        cut.append(f"limits.start_hz = {limits.start_hz:g} cuts off what lies below")
    if stop < high:
        cut.append(f"limits.stop_hz = {limits.stop_hz:g} cuts off what lies above")
    levels = tuple(float(f"{share * limits.source_vpk:.2g}") for share in _LEVELS)
    looks = [
        SweepPlan(spaced_frequencies(start, stop, n, "log"), levels, "up", settle, integrate)
        for n, settle, integrate in _LOOKS
    ]
    return next((one for one in looks if one.duration_s <= _LONGEST_S), looks[-1]), tuple(cut)


def _parts(
    wide: SweepPlan, observation: Observation, longest_s: float
) -> Iterator[tuple[NDArray[np.bool_], tuple[float, ...], tuple[float, ...]]]:
    """Rows (rows,) of shorter sweeps that fit into a time, their frequencies and levels."""
    grid = np.array(wide.frequencies_hz)
    for first, last in _BANDS:
        band = np.arange(round(first * (len(grid) - 1)), round(last * (len(grid) - 1)) + 1)
        for count in (1, 2, 3):
            for levels in combinations(wide.levels_vpk, count):
                kept = _densest(wide, band, levels, longest_s)
                if kept is not None:
                    rows = np.isin(observation.frequency_hz, grid[kept])
                    rows &= np.isin(observation.source_vpk, levels)
                    yield rows, tuple(grid[kept].tolist()), levels


def _densest(
    wide: SweepPlan,
    band: NDArray[np.int64],
    levels: tuple[float, ...],
    longest_s: float,
) -> NDArray[np.int64] | None:
    """As many points (n,) of a band, evenly spread, as fit into a time; None where too few do."""
    for stride in range(1, (len(band) - 1) // (_FEWEST - 1) + 1):
        kept = band[: (len(band) - 1) // stride * stride + 1 : stride]
        frequencies = tuple(wide.frequencies_hz[i] for i in kept)
        part = replace(wide, frequencies_hz=frequencies, levels_vpk=levels)
        if part.duration_s <= longest_s:
            return np.asarray(kept)
    return None


def _features(
    frequency_hz: NDArray[np.float64], log_gain: NDArray[np.float64]
) -> tuple[tuple[float, float, float] | None, tuple[float, float, float] | None]:
    """Quantiles of the lowest point of the gain (drives, points) and of the highest above it."""
    arf, rf = [], []
    last = len(frequency_hz) - 1
    for gain in log_gain:
        # An anti-resonance has higher ground on both sides, and the resonance lies above it.
        depth = np.minimum(np.maximum.accumulate(gain), np.maximum.accumulate(gain[::-1])[::-1])
        low = int(np.argmax(depth - gain))
        high = low + int(np.argmax(gain[low:]))
        if 0 < low < last and depth[low] > gain[low]:
            arf.append(frequency_hz[low])
            if high < last:
                rf.append(frequency_hz[high])
    return _spread(arf, len(log_gain)), _spread(rf, len(log_gain))


def _shows_arf(unit: Unit) -> bool:
    """Whether its gain has a minimum at ARF: neither a load's has nor that of a current."""
    return unit.sensor is None or not (unit.sensor.at == "load" or unit.sensor.kind == "current")


def _highest(
    frequency_hz: NDArray[np.float64], log_gain: NDArray[np.float64]
) -> tuple[float, float, float] | None:
    """Quantiles of the highest point of the gain."""
    high = np.argmax(log_gain, axis=1)
    inside = high[(high > 0) & (high < len(frequency_hz) - 1)]
    return _spread(frequency_hz[inside].tolist(), len(log_gain))


def _spread(found: list[float], drives: int) -> tuple[float, float, float] | None:
    if len(found) < 0.5 * drives:
        return None
    low, middle, high = np.quantile(found, [0.05, 0.5, 0.95])
    return float(low), float(middle), float(high)


def _still(wide: SweepPlan, log_gain: NDArray[np.float64]) -> tuple[float, ...]:
    """Levels at which the gain (drives, levels, points) is far below that at the highest."""
    typical = np.median(log_gain, axis=(0, 2))
    held = typical < typical[-1] + np.log(_STILL)
    return tuple(level for level, one in zip(wide.levels_vpk, held, strict=True) if one)


def _quantiles(found: tuple[float, float, float] | None) -> dict[str, float] | None:
    return None if found is None else dict(zip(("low", "median", "high"), found, strict=True))
