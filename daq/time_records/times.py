"""Columns of times that nobody named, beside a sampling rate that somebody gave.

Owns how such a column is recognised and compared with the rate. What is no column of times is
passed over.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import InputError

__all__ = ["refuse_other_times"]

_NAME = re.compile(r"(t|time|times|timestamp|zeit|temps|seconds|secs?)([\s_(\[]|$)", re.IGNORECASE)
_UNNAMED = re.compile(r"column \d+")
_UNITS = (1.0, 1e3, 1e6, 1e9)
"""Of a second that a column may count in: s, ms, us, ns."""
_ALIKE = 0.01


def refuse_other_times(
    columns: Mapping[str, NDArray[Any]], rate_hz: float, source: str, path: Path
) -> None:
    """Refuse a rate that a column of times contradicts, in whatever unit it counts.

    Parameters
    ----------
    columns
        Those that are neither input nor output, by name.
    rate_hz, source
        The rate, Hz, and what says so.

    Raises
    ------
    InputError
        If one has another rate; names both.
    """
    for name, values in columns.items():
        step = _step(np.asarray(values))
        # Without a name a column that counts 1, 2, 3 numbers the samples.
        is_numbering = _UNNAMED.fullmatch(name) is not None and step == 1.0
        if step is None or is_numbering or not (_NAME.match(name) or _UNNAMED.fullmatch(name)):
            continue
        if not any(abs(unit / step - rate_hz) <= _ALIKE * rate_hz for unit in _UNITS):
            raise InputError(
                f"{path}: {source} says {rate_hz:g} Hz, the times in column {name!r} "
                f"{1.0 / step:g} Hz; give the rate of the record, or --time {name!r} without one"
            )


def _step(values: NDArray[Any]) -> float | None:
    """Mean step of a column that ascends evenly; None of any other."""
    if values.ndim != 1 or values.size < 3 or values.dtype.kind not in "fiu":
        return None
    steps = np.diff(values.astype(float))
    if not (np.isfinite(steps).all() and (steps > 0.0).all()):
        return None
    mean = float(np.mean(steps))
    # A few late samples are no reason to take another rate.
    return mean if float(np.median(np.abs(steps - mean))) < 0.5 * mean else None
