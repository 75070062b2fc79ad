"""One source level made ready for reading: usable rows, ascending, each with its noise.

Owns which rows count and how uncertain each is believed to be, in nepers and
radians of the logarithm of the response. It looks for no feature, smooths
nothing and invents no row.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from analysis.resonance.neighbour_noise import Vector, evened, neighbour_noise
from daq.errors import AnalysisError, InputError
from daq.frf import DB_PER_NEPER, FrequencyResponse, PointFlag

__all__ = ["MOST_LEVELS", "MOST_POINTS", "Samples", "level_samples", "refuse_levels"]

MOST_LEVELS = 1000
"""Source levels of a response; a file with more holds no levels that anybody set."""

MOST_POINTS = 2048
"""Points of a level that are read one by one: an analyser has 801."""

FLOOR_NEPER = 1e-3 / DB_PER_NEPER
"""Least standard error that is believed: files carry gains to about this."""
CEILING_NEPER = 30.0 / DB_PER_NEPER
"""Greatest one; beyond it a reading says nothing more about the gain anyway."""
UNKNOWN_NEPER = 1.0 / DB_PER_NEPER
"""Taken where errors are not given and the points are too few to show them."""
LEAST_REPEATS = 4
"""Repeats beyond the first from which on their scatter says what the noise is."""


def refuse_levels(response: FrequencyResponse) -> None:
    """Refuse a response with more source levels than anybody sets.

    Raises
    ------
    InputError
        If it has.
    """
    if len(np.unique(response.source_vpk)) > MOST_LEVELS:
        raise InputError(
            f"the response holds more than {MOST_LEVELS} source levels in {len(response)} rows; "
            "see whether source_vpk is the level that was set, and not one that was measured"
        )


@dataclass(frozen=True, slots=True)
class Samples:
    """Readings of one level as logarithms, ascending, one per frequency; shapes (points,).

    Parameters
    ----------
    frequency_hz
        Hz, strictly ascending and positive.
    log_gain, phase
        ln |V_o/V_i| in nepers and its angle in rad.
    std, phase_std
        One standard error of each, nepers and rad; the latter is infinite where
        the phase is unknown.
    noise_known
        False if the errors are an estimate from the readings' own scatter, so
        that only their relative size is to be trusted.
    grouped
        How many neighbouring frequencies one sample is the mean of.
    """

    frequency_hz: Vector
    log_gain: Vector
    phase: Vector
    std: Vector
    phase_std: Vector
    noise_known: bool
    grouped: int = 1

    def __len__(self) -> int:
        return len(self.frequency_hz)

    @property
    def gain_db(self) -> Vector:
        """Gain in dB."""
        return self.log_gain * DB_PER_NEPER

    def between(self, low_hz: float, high_hz: float) -> Samples:
        """The samples in a closed band."""
        low = int(np.searchsorted(self.frequency_hz, low_hz, "left"))
        high = int(np.searchsorted(self.frequency_hz, high_hz, "right"))
        return Samples(
            self.frequency_hz[low:high],
            self.log_gain[low:high],
            self.phase[low:high],
            self.std[low:high],
            self.phase_std[low:high],
            self.noise_known,
            self.grouped,
        )


def level_samples(level: FrequencyResponse, most: int = MOST_POINTS) -> Samples:
    """Usable samples of a response at one source level.

    Rows flagged as spoilt are left out, as are rows without a finite frequency
    above 0 Hz or a finite gain above 0. Repeats at one frequency are averaged in
    the logarithm, and more than `most` frequencies are averaged in groups of neighbours, which
    keeps what they say together. A standard error that is not given is estimated: from the
    repeats if there are enough, else from how far each reading lies from the
    cubic through its four neighbours. Errors across the gain that are not given
    equal those along it: an averaged phasor has circular noise.

    Raises
    ------
    AnalysisError
        If no row is usable.
    """
    log_gain = np.log(np.abs(level.gain))
    usable = (
        np.isfinite(log_gain)
        & np.isfinite(level.frequency_hz)
        & (level.frequency_hz > 0.0)
        & (level.flags & int(PointFlag.SPOILT) == 0)
    )
    if not usable.any():
        raise AnalysisError("no row has a finite gain that is not spoilt; measure the level again")
    level, log_gain = level.take(usable), log_gain[usable]
    rows = Samples(
        frequency_hz=level.frequency_hz,
        log_gain=log_gain,
        phase=np.where(level.phase_known, np.angle(level.gain), 0.0),
        std=_believed(level.gain_std_db / DB_PER_NEPER),
        phase_std=np.where(level.phase_known, _believed(np.radians(level.phase_std_deg)), np.inf),
        noise_known=False,
    )
    return _with_noise(_grouped(_merged(rows), most))


def _believed(std: Vector) -> Vector:
    """Standard errors within what can be meant; NaN where none is given."""
    given = np.isfinite(std) & (std > 0.0)
    return np.where(given, np.clip(std, FLOOR_NEPER, CEILING_NEPER), np.nan)


def _merged(rows: Samples) -> Samples:
    """One sample per frequency, ascending; repeats averaged, their scatter put to use."""
    frequency, group = np.unique(rows.frequency_hz, return_inverse=True)
    count = np.bincount(group)
    mean = np.bincount(group, rows.log_gain) / count
    turned = np.bincount(group, np.cos(rows.phase)) + 1j * np.bincount(group, np.sin(rows.phase))
    std = np.sqrt(np.bincount(group, rows.std**2)) / count
    repeats = len(rows) - frequency.size
    if repeats >= LEAST_REPEATS:
        off = rows.log_gain - mean[group]
        pooled = _believed(np.sqrt(np.sum(off**2, keepdims=True) / repeats)) / np.sqrt(count)
        known = np.isfinite(std)
        # Repeats that scatter more than stated say that the stated errors are too small.
        excess = np.sqrt(np.nansum((off / rows.std) ** 2) / repeats)
        std = np.where(known, std * max(1.0, float(excess)), pooled)
    return Samples(
        frequency_hz=frequency,
        log_gain=mean,
        phase=np.angle(turned),
        std=std,
        phase_std=np.sqrt(np.bincount(group, rows.phase_std**2)) / count,
        noise_known=False,
    )


def _grouped(samples: Samples, most: int) -> Samples:
    """Means of so many neighbours that no more than `most` samples are left."""
    size = -(-len(samples) // most)
    if size == 1:
        return samples
    starts = np.arange(0, len(samples), size)
    count = np.diff(np.append(starts, len(samples)))

    def mean(values: Vector) -> Vector:
        return np.asarray(np.add.reduceat(values, starts) / count)

    return Samples(
        frequency_hz=mean(samples.frequency_hz),
        log_gain=mean(samples.log_gain),
        phase=np.arctan2(mean(np.sin(samples.phase)), mean(np.cos(samples.phase))),
        std=np.sqrt(mean(samples.std**2) / count),
        phase_std=np.sqrt(mean(samples.phase_std**2) / count),
        noise_known=samples.noise_known,
        grouped=size,
    )


def _with_noise(samples: Samples) -> Samples:
    """Errors filled in where they are not given, and evened out between neighbours."""
    known = np.isfinite(samples.std)
    std = samples.std
    if not known.all():
        std = np.where(known, std, _estimated(samples))
    std = np.clip(evened(samples.log_gain, std), FLOOR_NEPER, CEILING_NEPER)
    across = samples.phase_std
    with_phase = ~np.isinf(across)
    across = np.where(np.isnan(across), std, across)
    evened_across = evened(samples.log_gain, np.where(with_phase, across, std))
    return replace(
        samples,
        std=std,
        phase_std=np.where(with_phase, np.clip(evened_across, FLOOR_NEPER, None), np.inf),
        noise_known=2 * int(np.count_nonzero(known)) > known.size,
    )


def _estimated(samples: Samples) -> Vector:
    if len(samples) < 6:
        return np.full(len(samples), UNKNOWN_NEPER)
    channels = [samples.log_gain]
    if not np.isinf(samples.phase_std).any():
        channels.append(np.unwrap(samples.phase))
    noise = neighbour_noise(samples.frequency_hz, np.array(channels))
    return np.clip(noise, FLOOR_NEPER, CEILING_NEPER)
