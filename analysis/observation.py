"""What a measured response says, in the form in which simulations are compared with it.

Owns the channels of comparison: log gain, phase, and the logarithm of the
cycle-to-cycle scatter. The scatter is data too: undamped meshes chatter, and a
little damping silences them. It simulates nothing.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import AnalysisError
from daq.frf import DB_PER_NEPER, GAIN_STD_COMPONENTS, FrequencyResponse, PointFlag
from daq.plan import SweepPlan

__all__ = [
    "CHANNELS",
    "USUAL_NOISE_V",
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

_QUIET_SHARE = 0.02

USUAL_NOISE_V = 5e-4
"""What a bench adds to each component of a reading, where nothing else is known, V."""

LEAST_NOISE = 3e-5
"""What any analyser adds, as a share of the largest voltage that it reads: 90 dB below its range.
Digits beyond, which a simulated file has, tell no machines apart that a bench could."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """A response as channels, rows ordered by level, then ascending frequency.

    `values` (3, rows): the channels; NaN where the response does not hold one.
    `source_vpk`, `frequency_hz` (rows,). `noise_v`: the reading's own noise
    per component at the input of the analyser, V. `noise` (rows,): the same
    relative to the response. `loudest_v`: what the quietest points show, V; it
    can be no more. `plans`: the sweep that a simulation must take, one for each
    set of levels that share their frequencies, with their rows. `blocks`: the
    rows of each level.
    """

    values: NDArray[np.float64]
    source_vpk: NDArray[np.float64]
    frequency_hz: NDArray[np.float64]
    noise_v: float
    noise: NDArray[np.float64]
    loudest_v: float
    plans: tuple[tuple[SweepPlan, NDArray[np.int64]], ...]

    @property
    def blocks(self) -> tuple[slice, ...]:
        """Rows of each level as slices, in order."""
        starts = np.flatnonzero(np.diff(self.source_vpk, prepend=np.nan) != 0)
        ends = [*starts[1:], len(self)]
        return tuple(slice(int(a), int(b)) for a, b in zip(starts, ends, strict=True))

    def sweeps(self) -> list[tuple[dict[str, Any], list[int]]]:
        """Plans and their rows as JSON, by which a sweep is known again.

        Frequencies to six digits: files round them, and a millionth changes no motion.
        """
        known = []
        for plan, rows in self.plans:
            grid = tuple(float(f"{hz:.6g}") for hz in plan.frequencies_hz)
            known.append((asdict(replace(plan, frequencies_hz=grid)), rows.tolist()))
        return known

    def thinned(self, stride: int) -> Observation:
        """Every `stride`-th frequency of each level only."""
        kept = np.concatenate([np.arange(b.start, b.stop)[::stride] for b in self.blocks])
        return self._taking(kept)

    def with_noise(self, noise_v: float) -> Observation:
        """The same reading with another noise of its own, V."""
        return replace(self, noise_v=noise_v, noise=self.noise * (noise_v / self.noise_v))

    def _taking(self, kept: NDArray[np.int64]) -> Observation:
        plans = []
        for plan, rows in self.plans:
            left = np.flatnonzero(np.isin(kept, rows))
            grid = tuple(np.unique(self.frequency_hz[kept[left]]).tolist())
            plans.append((replace(plan, frequencies_hz=grid), left))
        return replace(
            self,
            values=self.values[:, kept],
            source_vpk=self.source_vpk[kept],
            frequency_hz=self.frequency_hz[kept],
            noise=self.noise[kept],
            plans=tuple(plans),
        )

    def __len__(self) -> int:
        return len(self.frequency_hz)


def observe(response: FrequencyResponse) -> Observation:
    """Bring a response into the form in which it is compared.

    Raises
    ------
    AnalysisError
        If no usable point is left, or a source level is not known.
    """
    if np.any(np.isnan(response.source_vpk)):
        raise AnalysisError(
            "the response does not say at which source level it was swept, and a servo with play "
            "answers differently at each; write the level into it (docs/how-to/foreign-files.md)"
        )
    usable = ((response.flags & (PointFlag.SPOILT | PointFlag.OVERLOAD)) == 0) & (
        np.abs(response.gain) > 0
    )
    if not np.any(usable):
        raise AnalysisError("the response holds no usable point; measure it again")
    kept = response.take(usable)
    parts = [kept.at_level(level) for level in kept.levels_vpk]
    gain = np.concatenate([part.gain for part in parts])
    known = np.concatenate([part.phase_known for part in parts])
    level = np.concatenate([part.source_vpk for part in parts])
    frequency = np.concatenate([part.frequency_hz for part in parts])
    scatter = np.concatenate([part.gain_std_db for part in parts]) / DB_PER_NEPER
    scatter = scatter * np.sqrt(2.0 / _components(response))
    volts = np.abs(gain) * level
    least = np.sqrt(2.0) * LEAST_NOISE * np.max(volts) / volts
    scatter = np.where(scatter > 0, np.maximum(scatter, least), scatter)
    noise_v = _reading_noise(scatter * volts)
    log_gain = np.log(gain)
    with np.errstate(divide="ignore"):
        log_scatter = np.where(scatter > 0, np.log(scatter), np.nan)
    return Observation(
        values=np.stack([log_gain.real, np.where(known, log_gain.imag, np.nan), log_scatter]),
        source_vpk=level,
        frequency_hz=frequency,
        noise_v=noise_v,
        noise=noise_v / volts,
        loudest_v=noise_v,
        plans=_plans(response, level, frequency),
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
        plans=((replace(plan, levels_vpk=tuple(sorted(plan.levels_vpk))), rows),),
    )


def _components(response: FrequencyResponse) -> int:
    """Over how many components of the reading its stated error counts the scatter.

    Responses made here say so; others are taken to count both.
    """
    return 1 if response.provenance.get(GAIN_STD_COMPONENTS) == 1 else 2


def _reading_noise(volts: NDArray[np.float64]) -> float:
    """Noise per component: what the quietest points show, as there the motion repeats.

    Where it repeats nowhere that is too much (see `analysis.reading_noise`). `volts`
    counts both components, as the scatter of a reading does.
    """
    known = volts[np.isfinite(volts) & (volts > 0)]
    if known.size == 0:
        return USUAL_NOISE_V
    return float(np.quantile(known, _QUIET_SHARE) / np.sqrt(2.0))


def _plans(
    response: FrequencyResponse, level: NDArray[np.float64], frequency: NDArray[np.float64]
) -> tuple[tuple[SweepPlan, NDArray[np.int64]], ...]:
    grids: dict[tuple[float, ...], list[float]] = {}
    for v in np.unique(level):
        grids.setdefault(tuple(frequency[level == v].tolist()), []).append(float(v))
    settle = response.settle_cycles
    integrate = response.integrate_cycles
    return tuple(
        (
            SweepPlan(
                grid,
                tuple(levels),
                direction=response.direction or "up",
                settle_cycles=SETTLE_CYCLES if settle is None else settle,
                integrate_cycles=INTEGRATE_CYCLES if integrate is None else integrate,
                from_rest=bool(response.from_rest),
            ),
            np.flatnonzero(np.isin(level, levels)),
        )
        for grid, levels in grids.items()
    )


def readings_of_cycles(
    coefficients: NDArray[np.complex128],
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Mean (..., rows) of V_o/V_i over the cycles (..., rows, cycles), and its relative variance.

    The variance is of the mean, over both components, and free of reading noise.
    """
    cycles = coefficients.shape[-1]
    mean = coefficients.mean(axis=-1)
    mean = np.where(np.abs(mean) > 1e-30, mean, 1e-30)
    spread = np.abs(coefficients - mean[..., None]) ** 2
    return mean, spread.sum(axis=-1) / max(cycles - 1, 1) / cycles / np.abs(mean) ** 2


def channels_of_readings(
    mean: NDArray[np.complex128], variance: NDArray[np.float64], noise: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Channels (..., 3, rows) of readings (..., rows) with reading noise (..., rows)."""
    scatter = 0.5 * np.log(variance + 2.0 * noise**2)
    log_gain = np.log(mean)
    return np.stack([log_gain.real, log_gain.imag, scatter], axis=-2)
