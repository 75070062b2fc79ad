"""ARF and RF as the paper reads them, over many runs, beside what the paper printed.

Owns the reading off the grid (minimum, then the maximum above it), the spread
of single runs and the judgement whether a published number is one of them. It
is for the reproduction alone: data are read by the extractor in
`analysis.resonance`, which knows of noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.paper.published import PublishedRow

__all__ = ["Compared", "GridFeatures", "ReproducedRow", "compare", "read_grid"]

GRID_STD_HZ = math.sqrt(1.0 / 12.0 + 1.0 / 12.0)
"""Both the computed and the printed frequency are known to a 1 Hz grid."""
PRINTED_STD_DB = 0.03
"""Gains are printed to a tenth of a decibel."""
DIFFERS_SIGMA = 2.6
"""A printed number further off than 99 % of single runs would be is said to differ."""
PLATEAU_SPREAD = 0.024
"""Single runs that scatter by more than this share of RF find no peak but a plateau.

Over 64 runs a row the paper's scheme scatters by 1.5 to 1.8 % where there is a
peak, by 3.6 % and more on the plateaus of EDSS.
"""


@dataclass(frozen=True, slots=True)
class GridFeatures:
    """ARF and RF of each run, shape (runs,), in Hz and dB."""

    arf_hz: NDArray[np.float64]
    arf_db: NDArray[np.float64]
    rf_hz: NDArray[np.float64]
    rf_db: NDArray[np.float64]


def read_grid(frequency_hz: NDArray[np.float64], gain_db: NDArray[np.float64]) -> GridFeatures:
    """Read ARF, the least gain, and RF, the greatest above it, off each run.

    Parameters
    ----------
    frequency_hz
        Ascending, shape (points,), Hz.
    gain_db
        Shape (runs, points), dB.
    """
    runs = np.arange(len(gain_db))
    at_arf = np.argmin(gain_db, axis=1)
    above = np.where(np.arange(len(frequency_hz)) >= at_arf[:, None], gain_db, -np.inf)
    at_rf = np.argmax(above, axis=1)
    return GridFeatures(
        arf_hz=frequency_hz[at_arf],
        arf_db=gain_db[runs, at_arf],
        rf_hz=frequency_hz[at_rf],
        rf_db=gain_db[runs, at_rf],
    )


@dataclass(frozen=True, slots=True)
class Compared:
    """One feature of one row: printed, by the paper's scheme, by the exact engine.

    Parameters
    ----------
    published_hz, published_db
        As printed; the gain is NaN where the print is illegible.
    value_hz, value_db
        Median over single runs of the paper's scheme.
    std_hz, std_db
        Spread of those runs, one standard deviation.
    low_hz, high_hz
        Least and greatest of those runs.
    percentile
        Share of those runs below the printed frequency, ties counted half, %.
    exact_hz, exact_db, exact_std_hz
        The same procedure on the exact engine: medians and spread of single runs.
    shift_std_hz
        Standard error of `shift_hz`: of the difference of both medians.
    """

    published_hz: float
    published_db: float
    value_hz: float
    value_db: float
    std_hz: float
    std_db: float
    low_hz: float
    high_hz: float
    percentile: float
    exact_hz: float
    exact_db: float
    exact_std_hz: float
    shift_std_hz: float

    @property
    def shift_hz(self) -> float:
        """What the paper's integrator did to this feature, Hz."""
        return self.value_hz - self.exact_hz

    @property
    def differs_hz(self) -> bool:
        """Whether the printed frequency is further off than the spread explains."""
        error = math.hypot(self.std_hz, GRID_STD_HZ)
        return abs(self.published_hz - self.value_hz) > DIFFERS_SIGMA * error

    @property
    def differs_db(self) -> bool:
        """Whether the printed gain is further off than the spread explains; no, where illegible."""
        error = math.hypot(self.std_db, PRINTED_STD_DB)
        return abs(self.published_db - self.value_db) > DIFFERS_SIGMA * error

    def to_json(self) -> dict[str, float]:
        """All fields and the shift, by name."""
        fields = {name: float(getattr(self, name)) for name in self.__dataclass_fields__}
        return fields | {"shift_hz": self.shift_hz}


@dataclass(frozen=True, slots=True)
class ReproducedRow:
    """One row of Table 2, computed.

    Parameters
    ----------
    published
        The row as printed.
    frequency_hz
        The grid, shape (points,), Hz.
    gain_db, exact_db
        Every run, shape (runs, points), dB: by the paper's scheme and by the exact engine.
    arf, rf
        Both features, printed and computed.
    """

    published: PublishedRow
    frequency_hz: NDArray[np.float64]
    gain_db: NDArray[np.float64]
    exact_db: NDArray[np.float64]
    arf: Compared
    rf: Compared

    @property
    def plateau(self) -> bool:
        """Whether RF is the accidental maximum of a plateau."""
        return self.rf.std_hz > PLATEAU_SPREAD * self.rf.value_hz

    @property
    def flags(self) -> list[str]:
        """What is to be known about the row."""
        flags = ["rf-plateau"] if self.plateau else []
        if self.published.rf_db is None:
            flags.append("rf-gain-illegible")
        for name, feature in (("arf", self.arf), ("rf", self.rf)):
            if feature.differs_hz:
                flags.append(f"{name}-differs")
            if feature.differs_db:
                flags.append(f"{name}-gain-differs")
        return flags


def compare(
    published_hz: float,
    published_db: float | None,
    runs_hz: NDArray[np.float64],
    runs_db: NDArray[np.float64],
    exact_hz: NDArray[np.float64],
    exact_db: NDArray[np.float64],
) -> Compared:
    """Sum up the runs of both engines for one feature; arrays have shape (runs,)."""
    below = np.count_nonzero(runs_hz < published_hz)
    ties = np.count_nonzero(runs_hz == published_hz)
    return Compared(
        published_hz=published_hz,
        published_db=math.nan if published_db is None else published_db,
        value_hz=float(np.median(runs_hz)),
        value_db=float(np.median(runs_db)),
        std_hz=_spread(runs_hz),
        std_db=_spread(runs_db),
        low_hz=float(runs_hz.min()),
        high_hz=float(runs_hz.max()),
        percentile=100.0 * (below + 0.5 * ties) / runs_hz.size,
        exact_hz=float(np.median(exact_hz)),
        exact_db=float(np.median(exact_db)),
        exact_std_hz=_spread(exact_hz),
        shift_std_hz=math.hypot(_median_error(runs_hz), _median_error(exact_hz)),
    )


def _median_error(runs: NDArray[np.float64]) -> float:
    # The median of normal draws is sqrt(pi/2) times as uncertain as their mean.
    return math.sqrt(0.5 * math.pi / runs.size) * _spread(runs)


def _spread(runs: NDArray[np.float64]) -> float:
    return float(np.std(runs, ddof=1)) if runs.size > 1 else math.nan
