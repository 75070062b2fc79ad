"""What units of a datasheet read in the sweep of a response, as a band; nothing is fitted.

Owns the machines that are drawn (datasheet values by their tolerances, free numbers by what is
known of them) and the band about their readings. It judges no response and draws no picture.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.answer import accept_model
from analysis.ensemble.batch import Family, read_families
from analysis.ensemble.datasheet_spread import spread_of
from analysis.ensemble.machine import Machine
from analysis.estimate.design import Axis
from analysis.estimate.estimate import free_axes
from analysis.execution.executor import Executor
from analysis.observation.observation import Observation, observe
from analysis.observation.rounding import settled
from analysis.observation.thinning import thin
from daq.frf import DB_PER_NEPER, FrequencyResponse
from sim.effects import EffectSetting
from sim.unit import Unit

__all__ = ["DatasheetBand", "Known", "LevelBand", "datasheet_band", "known_of_estimate"]

MACHINES = 32
"""Simulated units: the edges of the band are then known to an eighth of its width."""
_MOST_ROWS = 600
_EDGES = (0.16, 0.5, 0.84)
"""Shares of the units that read less: the band holds the middle 68 %, as one standard deviation."""


@dataclass(frozen=True, slots=True)
class Known:
    """What is known of the free numbers; None: nothing but the range of an estimate.

    Parameters
    ----------
    ratio, b_t_deg
        Value and one standard deviation, which may be 0.
    effects
        Extensions of the model that all machines have.
    words
        Where that is from.
    """

    ratio: tuple[float, float] | None = None
    b_t_deg: tuple[float, float] | None = None
    effects: tuple[EffectSetting, ...] = ()
    words: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class LevelBand:
    """One source level of one sweep; rows are low edge, median and high edge: (3, points).

    `frequency_hz` (points,) ascends. `gain_db` in dB re 1 V/V; `phase_deg` without jumps between
    neighbours.
    """

    source_vpk: float
    frequency_hz: NDArray[np.float64]
    gain_db: NDArray[np.float64]
    phase_deg: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class DatasheetBand:
    """Bands of all levels, and what they are, in words."""

    levels: tuple[LevelBand, ...]
    name: str
    """Short, for a legend."""
    words: str
    """A sentence."""


def known_of_estimate(estimate: Mapping[str, Any] | None) -> Known:
    """What the document of an estimate knows, whose model explains the response; else nothing."""
    answer = accept_model(estimate, None)
    ratio = answer.contribution_ratio
    if ratio is None or estimate is None:
        return Known()
    total = _pair(estimate.get("b_t_deg"))
    # Without an error of its own it is the unit's, which all machines have anyhow.
    return Known(_pair(ratio), total if total and total[1] else None, words="by the estimate")


def datasheet_band(
    response: FrequencyResponse,
    unit: Unit,
    known: Known | None = None,
    *,
    machines: int = MACHINES,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
) -> DatasheetBand:
    """Simulate units of a datasheet in the sweep of a response, and take the band they read in.

    Parameters
    ----------
    response
        What was swept; readings that are spoilt or overloaded are left out, a large response is
        thinned.
    known
        What is known of ratio and backlash. What is not is drawn evenly from the range of an
        estimate.
    machines
        How many units are drawn.
    executor
        Where they are simulated; this machine's cores if not given.
    progress
        Told the share done; what it raises ends the work.

    Raises
    ------
    AnalysisError
        If the response has no usable point or no source level, or a motion grew without bound.
    InputError
        If the sweep cannot be simulated.
    """
    known = known or Known()
    observation = observe(thin(settled(response), _MOST_ROWS))
    rng = np.random.default_rng([seed, machines])
    spread = spread_of(unit)
    drawn = [
        replace(machine, deviations=spread.draw(rng), effects=known.effects)
        for machine in _free(unit, known, machines, rng)
    ]
    families = [Family(unit, (machine,), observation.plans) for machine in drawn]
    read = read_families(families, executor, progress)
    mean = np.concatenate([one for one, _ in read])
    scale = np.exp(spread.gain * rng.standard_normal((machines, 1)))
    noise = rng.standard_normal((2, *mean.shape)) * observation.noise
    mean = mean * scale * (1.0 + noise[0] + 1j * noise[1])
    return DatasheetBand(
        tuple(_bands(observation, mean)), _name(unit, known), _sentence(unit, known, machines)
    )


def _free(unit: Unit, known: Known, count: int, rng: np.random.Generator) -> Sequence[Machine]:
    """Machines with their free numbers: evenly over a range, or about what is known."""
    machines = [Machine(1.0, int(seed)) for seed in rng.integers(2**30, size=count)]
    axes = {axis.name: axis for axis in free_axes(unit)}
    if known.b_t_deg is not None:
        axes |= {axis.name: axis for axis in free_axes(unit, True)}
    for name, axis in axes.items():
        told = known.ratio if name == "ratio" else known.b_t_deg
        values = _values(axis, told, count, rng)
        machines = [axis.machine(one, float(v)) for one, v in zip(machines, values, strict=True)]
    return machines


def _values(
    axis: Axis, told: tuple[float, float] | None, count: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    if told is not None:
        return np.clip(told[0] + told[1] * rng.standard_normal(count), axis.low, axis.high)
    shares = (rng.permutation(count) + rng.random(count)) / count
    return axis.low + (axis.high - axis.low) * shares


def _bands(observation: Observation, mean: NDArray[np.complex128]) -> Sequence[LevelBand]:
    """The band of each level of each sweep, of readings (machines, rows)."""
    found = []
    for _, rows in observation.plans:
        for level in np.unique(observation.source_vpk[rows]):
            at = rows[observation.source_vpk[rows] == level]
            at = at[np.argsort(observation.frequency_hz[at], kind="stable")]
            gain = DB_PER_NEPER * np.log(np.abs(mean[:, at]))
            # Angles about their mean direction: a band across 180 degrees is no full turn.
            middle = np.angle(np.mean(mean[:, at] / np.abs(mean[:, at]), axis=0))
            off = np.angle(mean[:, at] * np.exp(-1j * middle))
            phase = np.unwrap(middle) + np.quantile(off, _EDGES, axis=0)
            found.append(
                LevelBand(
                    float(level),
                    observation.frequency_hz[at],
                    np.quantile(gain, _EDGES, axis=0),
                    np.degrees(phase),
                )
            )
    return found


def _pair(told: Mapping[str, Any] | None) -> tuple[float, float] | None:
    if told is None or told.get("value") is None:
        return None
    return float(told["value"]), float(told.get("std") or 0.0)


def _name(unit: Unit, known: Known) -> str:
    extended = "".join(f" + {effect.id}" for effect in known.effects)
    if unit.stages == 1:
        return f"datasheet{extended}"
    if known.ratio is None:
        return f"datasheet{extended}, any r"
    value, std = known.ratio
    return f"datasheet{extended}, r {value:.2f}" + (f" +- {std:.2f}" if std else "")


def _sentence(unit: Unit, known: Known, machines: int) -> str:
    """What the band is."""
    free = []
    if unit.stages > 1:
        free.append("r anywhere from 0 to 1" if known.ratio is None else _told("r", known.ratio))
    if known.b_t_deg is not None:
        free.append(_told("b_t", known.b_t_deg, " deg"))
    elif unit.stages == 1:
        (total,) = free_axes(unit)
        free.append(f"b_t anywhere from {total.low:.3g} to {total.high:.3g} deg")
    shares = [share for share in unit.tolerances.values() if share > 0.0]
    ends = dict.fromkeys(
        f"{100 * share:.2g}" for share in sorted(shares)[:: max(len(shares) - 1, 1)]
    )
    about = f"tolerances of {' to '.join(ends)} %" if shares else ""
    of = ", ".join(filter(None, [about, *free]))
    source = f" {known.words}" if known.words else ""
    return f"band: the middle 68 % of {machines} simulated units of the datasheet ({of}{source})"


def _told(name: str, value: tuple[float, float], unit: str = "") -> str:
    digits = 3 if not value[1] else max(2, 1 - math.floor(math.log10(value[1])))
    error = f" +- {value[1]:.{digits}f}" if value[1] else ""
    return f"{name} = {value[0]:.{digits}f}{error}{unit}"
