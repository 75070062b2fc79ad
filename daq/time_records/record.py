"""A record of what went into a servo and what came out, sampled at one rate.

Owns the noun and the checks that make two columns a record. It reads no file.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError, InputError

__all__ = ["TimeRecord", "rate_of_times", "record_of"]

_LEAST_SAMPLES = 64
_MOST_SAMPLES = 50_000_000
_JITTER = 0.01
"""Steps of a time column may differ from their median by this share."""


@dataclass(frozen=True, slots=True, eq=False)
class TimeRecord:
    """Input and output of a servo over time.

    Parameters
    ----------
    rate_hz
        Samples per second.
    input_v, output_v
        Shape (samples,), V.
    """

    rate_hz: float
    input_v: NDArray[np.float64]
    output_v: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.input_v)

    @property
    def duration_s(self) -> float:
        """Length, s."""
        return len(self) / self.rate_hz

    def scaled(self, input_scale: float, output_scale: float) -> TimeRecord:
        """The record in other units: V for each unit of either column."""
        return TimeRecord(self.rate_hz, self.input_v * input_scale, self.output_v * output_scale)


def record_of(
    input_v: NDArray[np.float64], output_v: NDArray[np.float64], rate_hz: float, path: Path
) -> TimeRecord:
    """A record of two columns.

    Raises
    ------
    FileFormatError
        If they are no record: of different lengths, too short, with gaps, constant, or
        monotonic.
    InputError
        If the rate is none.
    """
    if not (np.isfinite(rate_hz) and 0.0 < rate_hz < 1e9):
        raise InputError(f"--rate {rate_hz:g} Hz is no sampling rate; give samples per second")
    for name, values in (("input", input_v), ("output", output_v)):
        if values.ndim != 1 or values.shape != input_v.shape:
            raise FileFormatError(
                f"{path}: the {name} has shape {values.shape}, the input {input_v.shape}; "
                "give two columns of one length"
            )
        if np.iscomplexobj(values):
            raise FileFormatError(f"{path}: the {name} is complex; give samples over time")
        gaps = np.flatnonzero(~np.isfinite(values))
        if gaps.size:
            raise FileFormatError(
                f"{path}: the {name} lacks sample {gaps[0] + 1} and {gaps.size - 1} more; "
                "give a record without gaps"
            )
        if values.size and np.ptp(values) == 0.0:
            raise FileFormatError(f"{path}: the {name} is constant; give another column")
    if not _LEAST_SAMPLES <= input_v.size <= _MOST_SAMPLES:
        raise FileFormatError(
            f"{path}: holds {input_v.size} samples; give from {_LEAST_SAMPLES} to {_MOST_SAMPLES}"
        )
    for name, values in (("input", input_v), ("output", output_v)):
        steps = np.diff(values)
        if steps.size and (np.all(steps >= 0.0) or np.all(steps <= 0.0)):
            way = "rises" if values[-1] > values[0] else "falls"
            raise FileFormatError(
                f"{path}: the {name} {way} from the first sample to the last, as times do and no "
                f"signal does; give another column with --{name}"
            )
    if np.max(np.abs([input_v.min(), input_v.max(), output_v.min(), output_v.max()])) > 1e12:
        raise FileFormatError(f"{path}: holds values beyond 1e12, which are no volts")
    return TimeRecord(float(rate_hz), input_v.astype(float), output_v.astype(float))


def rate_of_times(times: NDArray[np.float64], path: Path) -> float:
    """The sampling rate behind a column of times in s.

    Raises
    ------
    FileFormatError
        If the steps are not equal and positive.
    """
    steps = np.diff(times)
    step = float(np.median(steps)) if steps.size else 0.0
    if not np.isfinite(times).all() or not step > 0.0:
        raise FileFormatError(f"{path}: the time column does not ascend; give --rate HZ")
    # A column written with few digits is uneven by its last digit, and on the mean even.
    mean = float((times[-1] - times[0]) / steps.size)
    resolution = float(np.ptp(np.abs(steps)))
    worst = int(np.argmax(np.abs(steps - step)))
    if abs(steps[worst] - step) > max(_JITTER * step, 2.0 * _last_digit(times)):
        raise FileFormatError(
            f"{path}: the step after time {times[worst]:.9g} s is {steps[worst]:.6g} s, the others "
            f"{step:.6g} s; give a record with equal steps"
        )
    return 1.0 / (mean if resolution > 0.0 else step)


def _last_digit(times: NDArray[np.float64]) -> float:
    """The least power of ten of which all times are multiples, s; 0 where there is none."""
    for power in range(12):
        scaled = times * 10.0**power
        if np.allclose(scaled, np.round(scaled), rtol=0.0, atol=1e-6 * max(1.0, power)):
            return 10.0**-power
    return 0.0
