"""What a measured response says, in the form in which simulations are compared with it.

Owns the channels of comparison: log gain, phase, and the logarithm of the
cycle-to-cycle scatter. The scatter is data too: undamped meshes chatter, and a
little damping silences them. Of a point that drowns in noise, where friction
holds the servo, it keeps that there is next to nothing. It simulates nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.observation.excitation import excitation_doubt, signal_of
from analysis.observation.reading_noise import (
    estimate_noise,
    noise_and_floor,
    scatter_sampling,
    shown_noise,
)
from analysis.observation.rounding import settled
from analysis.observation.stated_error import stated_error
from daq.errors import AnalysisError, InputError
from daq.excitation.plan import ExcitedPlan
from daq.frf import DB_PER_NEPER, FrequencyResponse, PointFlag
from daq.plan import SweepPlan

__all__ = [
    "CHANNELS",
    "Observation",
    "channels_of_readings",
    "observe",
    "readings_of_cycles",
    "unread",
]

CHANNELS = ("gain", "phase", "scatter")
"""Real and imaginary part of log(V_o/V_i), and log of the relative scatter of the reading."""

SETTLE_CYCLES, INTEGRATE_CYCLES = 20, 30
"""Assumed where a file does not say."""

LEAST_NOISE = 3e-5
"""What any analyser adds, as a share of the largest voltage that it reads: 90 dB below its range.
Digits beyond, which a simulated file has, tell no machines apart that a bench could."""

_LONGEST_S = 14_400.0
"""Longest sweep of a response; a bench drives none for longer if not told otherwise."""

_HIGHEST_V = 1000.0
"""Highest voltage of a response at either channel: an analyser takes tens, with a divider more."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """A response, or several of one unit, as channels.

    Rows are ordered by level, then sweep, then ascending frequency.

    `values` (3, rows): the channels; NaN where the response does not hold one.
    `source_vpk`, `frequency_hz` (rows,). `noise_v`: the reading's own noise
    per component at the input of the analyser, V. `noise` (rows,): the same
    relative to the response. `loudest_v`: what the quietest points show, V; it
    can be no more. `floor` (rows,): gain below which a point that drowned says nothing, 0
    elsewhere. `plans`: the sweep that a simulation must take, one for each
    set of levels that share their frequencies, with their rows. `quietest`: what the quietest
    points show, as a share of the noise. `components`: 1 where all scatter was stated along the
    gain alone; the channel counts both either way.
    """

    values: NDArray[np.float64]
    source_vpk: NDArray[np.float64]
    frequency_hz: NDArray[np.float64]
    noise_v: float
    noise: NDArray[np.float64]
    loudest_v: float
    floor: NDArray[np.float64]
    plans: tuple[tuple[SweepPlan, NDArray[np.int64]], ...]
    quietest: float = 1.0
    components: int = 2

    @property
    def blocks(self) -> tuple[slice, ...]:
        """Rows of each level of each sweep as slices, the lowest level first."""
        sweep = np.empty(len(self))
        for number, (_, rows) in enumerate(self.plans):
            sweep[rows] = number
        return _stretches(self.source_vpk, sweep)

    @property
    def levels(self) -> tuple[slice, ...]:
        """Rows of each level, in whatever sweeps, as slices, the lowest first."""
        return _stretches(self.source_vpk)

    def by_plan(self) -> Iterator[tuple[Observation, NDArray[np.int64]]]:
        """What each plan swept, as if it were all, and the rows that it is here."""
        for _, rows in self.plans:
            yield self.at_rows(rows), rows

    def sweeps(self) -> list[tuple[dict[str, Any], list[int]]]:
        """Plans and their rows as JSON, by which a sweep is known again.

        Frequencies to six digits: files round them, and a millionth changes no motion.
        """
        known = []
        for plan, rows in self.plans:
            grid = tuple(float(f"{hz:.6g}") for hz in plan.frequencies_hz)
            known.append((asdict(replace(plan, frequencies_hz=grid)), rows.tolist()))
        return known

    @property
    def scatter_sampling(self) -> float:
        """Relative standard deviation of a standard error along one component, by its cycles."""
        return _sampling(self.plans)

    def with_noise(self, noise_v: float) -> Observation:
        """The same reading with another noise of its own, V."""
        return replace(self, noise_v=noise_v, noise=self.noise * (noise_v / self.noise_v))

    def thinned(self, stride: int) -> Observation:
        """Every `stride`-th frequency of each level only."""
        kept = np.concatenate([np.arange(b.start, b.stop)[::stride] for b in self.blocks])
        return self.at_rows(kept)

    def at_rows(self, kept: NDArray[np.int64]) -> Observation:
        """Some rows (ascending indices) only."""
        plans = []
        for plan, rows in self.plans:
            left = np.flatnonzero(np.isin(kept, rows))
            if not len(left):
                continue
            grid = tuple(np.unique(self.frequency_hz[kept[left]]).tolist())
            plans.append((replace(plan, frequencies_hz=grid), left))
        return replace(
            self,
            values=self.values[:, kept],
            source_vpk=self.source_vpk[kept],
            frequency_hz=self.frequency_hz[kept],
            noise=self.noise[kept],
            floor=self.floor[kept],
            plans=tuple(plans),
        )

    def __len__(self) -> int:
        return len(self.frequency_hz)


def observe(*responses: FrequencyResponse) -> Observation:
    """Bring a response, or several of one unit, into the form in which they are compared.

    Raises
    ------
    AnalysisError
        If one holds no usable point, or does not know a source level.
    InputError
        If one states a DC offset that is no voltage, a sweep that lasts too long, or voltages that
        no bench has, or holds a frequency twice at one level; if one was not measured with a
        stepped sine.
    """
    for one in responses:
        if doubt := excitation_doubt(one):
            raise InputError(doubt)
    swept = [level for number, one in enumerate(responses) for level in _levels(number, one)]
    # Levels that are alike keep their order: sweeps stay as they were given.
    swept.sort(key=lambda one: one.source_vpk)
    gain = np.concatenate([one.readings.gain for one in swept])
    known = np.concatenate([one.readings.phase_known for one in swept])
    level = np.concatenate([one.readings.source_vpk for one in swept])
    scatter = np.concatenate([one.scatter for one in swept])
    volts = np.abs(gain) * level
    _refuse_unbelievable(level, volts)
    plans = _plans(swept)
    noise_v = estimate_noise(scatter * volts, _sampling(plans))
    noise, floor = noise_and_floor(np.abs(gain), level, noise_v)
    drowned = floor > 0.0
    log_gain = np.log(gain)
    with np.errstate(divide="ignore"):
        log_scatter = np.where(scatter > 0, np.log(scatter), np.nan)
    values = np.stack([np.real(log_gain), np.where(known, np.imag(log_gain), np.nan), log_scatter])
    values[0, drowned] = _log_above(np.abs(gain), floor)[drowned]
    values[1:, drowned] = np.nan
    return Observation(
        values=values,
        source_vpk=level,
        frequency_hz=np.concatenate([one.readings.frequency_hz for one in swept]),
        noise_v=noise_v,
        noise=noise,
        loudest_v=noise_v,
        floor=floor,
        plans=plans,
        quietest=shown_noise(scatter * volts) / noise_v,
        components=max(one.components for one in swept),
    )


def unread(plan: SweepPlan, noise_v: float) -> Observation:
    """The observation that a sweep will be: its rows, nothing read yet.

    `noise` is that of a response of gain one.
    """
    count = len(plan.frequencies_hz)
    level = np.repeat(np.sort(plan.levels_vpk), count)
    rows = np.arange(len(level))
    return Observation(
        values=np.full((3, len(level)), np.nan),
        source_vpk=level,
        frequency_hz=np.tile(np.sort(plan.frequencies_hz), len(plan.levels_vpk)),
        noise_v=noise_v,
        noise=noise_v / level,
        loudest_v=noise_v,
        floor=np.zeros(len(level)),
        plans=((replace(plan, levels_vpk=tuple(sorted(plan.levels_vpk))), rows),),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Level:
    """One level of the response of a number: its readings, and their relative scatter."""

    number: int
    source_vpk: float
    readings: FrequencyResponse
    scatter: NDArray[np.float64]
    components: int


def _levels(number: int, response: FrequencyResponse) -> Iterator[_Level]:
    if np.any(np.isnan(response.source_vpk)):
        raise AnalysisError(
            "the response does not say at which source level it was swept, and a servo with play "
            "answers differently at each; give --level V (docs/how-to/foreign-files.md)"
        )
    response = settled(response)
    usable = ((response.flags & (PointFlag.SPOILT | PointFlag.OVERLOAD)) == 0) & (
        np.abs(response.gain) > 0
    )
    if not np.any(usable):
        raise AnalysisError("the response holds no usable point; measure it again")
    kept = response.take(usable)
    stated = stated_error(kept)
    if kept.integrate_cycles is None and stated.cycles is not None:
        kept = replace(kept, integrate_cycles=stated.cycles)
    least_v = np.sqrt(2.0) * LEAST_NOISE * np.max(np.abs(kept.gain) * kept.source_vpk)
    for source_vpk in kept.levels_vpk:
        readings = kept.at_level(source_vpk)
        _refuse_repeated(readings.frequency_hz, source_vpk)
        if stated.components is None:
            scatter = np.full(len(readings), np.nan)
        else:
            scatter = readings.gain_std_db / DB_PER_NEPER * np.sqrt(2.0 / stated.components)
        least = least_v / (np.abs(readings.gain) * readings.source_vpk)
        scatter = np.where(scatter > 0, np.maximum(scatter, least), scatter)
        counted = stated.components or 1
        yield _Level(number, float(source_vpk), readings, scatter, counted)


def _refuse_repeated(frequency_hz: NDArray[np.float64], source_vpk: float) -> None:
    """A file may keep two readings of one frequency; simulations go there once a sweep."""
    twice = np.unique(frequency_hz[1:][np.diff(frequency_hz) == 0.0])
    if twice.size:
        such = f", one of {twice.size} such frequencies" if twice.size > 1 else ""
        raise InputError(
            f"the response holds {twice[0]:.9g} Hz more than once at source level {source_vpk:g} V"
            f"{such}, and a sweep is simulated with each once; leave one row of it in a CSV "
            "(lashbench export writes a stored measurement as one)"
        )


def _sampling(plans: Sequence[tuple[SweepPlan, NDArray[np.int64]]]) -> float:
    return scatter_sampling(min(plan.integrate_cycles for plan, _ in plans))


def _plans(swept: Sequence[_Level]) -> tuple[tuple[SweepPlan, NDArray[np.int64]], ...]:
    """What was swept at the same frequencies in one response, with its rows."""
    alike: dict[tuple[int, tuple[float, ...]], list[int]] = {}
    for place, one in enumerate(swept):
        grid = tuple(one.readings.frequency_hz.tolist())
        alike.setdefault((one.number, grid), []).append(place)
    first = np.cumsum([0, *(len(one.readings) for one in swept)])
    plans = []
    # In the order in which the responses were given, by which a person knows them.
    for (_, grid), places in sorted(alike.items(), key=lambda one: one[0][0]):
        response = swept[places[0]].readings
        settle, integrate = response.settle_cycles, response.integrate_cycles
        levels = tuple(swept[place].source_vpk for place in places)
        signal = signal_of(response)
        plan = SweepPlan(
            grid,
            levels,
            direction=response.direction or "up",
            settle_cycles=SETTLE_CYCLES if settle is None else settle,
            integrate_cycles=INTEGRATE_CYCLES if integrate is None else integrate,
            from_rest=bool(response.from_rest),
            dc_offset_v=response.dc_offset_v,
        )
        if signal is not None:
            plan = ExcitedPlan(
                grid, levels, settle_cycles=plan.settle_cycles,
                integrate_cycles=plan.integrate_cycles, dc_offset_v=plan.dc_offset_v,
                excitation=signal,
            )  # fmt: skip
        _refuse_endless(plan)
        rows = [np.arange(first[place], first[place + 1]) for place in places]
        plans.append((plan, np.concatenate(rows)))
    return tuple(plans)


def _refuse_endless(plan: SweepPlan) -> None:
    """Hundreds of machines are taken through every sweep: one that lasts for days is a slip."""
    if plan.duration_s > _LONGEST_S:
        low, high = plan.frequencies_hz[0], plan.frequencies_hz[-1]
        raise InputError(
            f"the response says that {plan.settle_cycles} and {plan.integrate_cycles} cycles were "
            f"waited for and averaged at each of {plan.points} points from {low:g} to {high:g} Hz, "
            f"which takes {plan.duration_s:.3g} s; up to {_LONGEST_S:g} s can be simulated: "
            "see whether frequencies are in Hz, and cycles right"
        )


def _refuse_unbelievable(source_vpk: NDArray[np.float64], volts: NDArray[np.float64]) -> None:
    """A level or a gain with some noughts too many would be searched for all the same."""
    for channel, values in (("the source drove", source_vpk), ("the response is", volts)):
        if values.max() > _HIGHEST_V:
            raise InputError(
                f"{channel} {values.max():.3g} V at one point; up to {_HIGHEST_V:g} V can be "
                "believed: see whether levels are in V, and gains in dB"
            )


def _stretches(*columns: NDArray[np.float64]) -> tuple[slice, ...]:
    """Slices over which no column (rows,) changes."""
    changes = np.any([np.diff(column, prepend=np.nan) != 0 for column in columns], axis=0)
    starts = np.flatnonzero(changes)
    ends = [*starts[1:], len(changes)]
    return tuple(slice(int(a), int(b)) for a, b in zip(starts, ends, strict=True))


def readings_of_cycles(
    coefficients: NDArray[np.complex128], components: int = 2
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Mean (..., rows) of V_o/V_i over the cycles (..., rows, cycles), and its relative variance.

    The variance is of the mean, over both components, and free of reading noise. With one of the
    `components`, both are taken for as large as that along the gain.
    """
    cycles = coefficients.shape[-1]
    mean = coefficients.mean(axis=-1)
    mean = np.where(np.abs(mean) > 1e-30, mean, 1e-30)
    apart = coefficients - mean[..., None]
    if components == 1:
        along = np.real(apart * np.conj(mean / np.abs(mean))[..., None])
        spread = 2.0 * along**2
    else:
        spread = np.abs(apart) ** 2
    return mean, spread.sum(axis=-1) / max(cycles - 1, 1) / cycles / np.abs(mean) ** 2


def channels_of_readings(
    mean: NDArray[np.complex128],
    variance: NDArray[np.float64],
    noise: NDArray[np.float64],
    floor: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Channels (..., 3, rows) of readings (..., rows) with reading noise (..., rows).

    `floor` (rows,) is that of the observation that they are compared with.
    """
    scatter = 0.5 * np.log(variance + 2.0 * noise**2)
    log_gain = np.log(mean)
    above = np.where(floor > 0.0, _log_above(np.abs(mean), floor), np.real(log_gain))
    return np.stack([above, np.imag(log_gain), scatter], axis=-2)


def _log_above(gain: NDArray[np.float64], floor: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log of a gain, levelling out at that of the floor."""
    return np.asarray(0.5 * np.log(gain**2 + floor**2))
