"""Error bars of a foreign file: stated in a column, or made of a coherence and its averages.

Owns that choice and the formula. An error of this kind is never scatter of a motion.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError, InputError
from daq.formats.foreign.columns import Columns
from daq.formats.reading import Reading
from daq.frf import DB_PER_NEPER

__all__ = ["coherence_errors", "column_errors"]

_PHASE_STD = {"phase_std_deg": 1.0, "phase_std_rad": 180.0 / math.pi}
_LEAST_COHERENCE = 1e-6
"""Below it a reading says nothing in any case; its error would be without bound."""


def column_errors(
    columns: Columns, magnitude: NDArray[np.float64], reading: Reading
) -> tuple[Any, Any, list[str], str]:
    """Errors of gain (dB) and phase (degrees), what to remark, and what they are in words."""
    held = columns.held
    std_db, phase_std_deg = None, columns.one_of(_PHASE_STD)
    if "gain_std_db" in held and "gain_std" in held:
        raise FileFormatError(f"{columns.path}: gain_std_db and gain_std say the same; give one")
    if "gain_std_db" in held:
        std_db = columns.real("gain_std_db")
    elif "gain_std" in held:
        with np.errstate(divide="ignore", invalid="ignore"):
            std_db = DB_PER_NEPER * columns.real("gain_std") / magnitude
    for name, errors in (("gain_std_db", std_db), ("point_phase_std_deg", phase_std_deg)):
        if errors is not None:
            columns.believe(name, errors)
    if std_db is not None:
        return std_db, phase_std_deg, [], ""
    if "coherence" not in held:
        if reading.averages:
            raise InputError(f"{columns.path}: has no coherence; leave --averages out")
        return None, phase_std_deg, [], ""
    coherence = columns.real("coherence")
    for row in np.flatnonzero((coherence < 0.0) | (coherence > 1.0 + 1e-6)):
        columns.refuse(row, f"coherence {coherence[row]:g} is not between 0 and 1")
    if not reading.averages:
        return (
            None,
            phase_std_deg,
            ["the coherence is not used; --averages N makes error bars of it"],
            "",
        )
    std_db, across = coherence_errors(coherence, reading.averages)
    words = f"error bar from coherence and {reading.averages} averages"
    return std_db, across if phase_std_deg is None else phase_std_deg, [], words


def coherence_errors(
    coherence: NDArray[np.float64], averages: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Standard errors of gain (dB) and phase (degrees) that a coherence and its averages mean.

    Parameters
    ----------
    coherence
        Ordinary coherence, gamma squared, shape (rows,). Where it is 1 no error is known (NaN):
        it was rounded.
    averages
        Independent averages behind it.

    Notes
    -----
    Bendat and Piersol, *Random Data*, 4th ed., table 9.6: the normalised random error of
    |H1| is sqrt(1 - g^2) / (|g| sqrt(2 n)), and the phase has the same in radians.
    """
    known = np.clip(coherence, _LEAST_COHERENCE, 1.0)
    share = np.sqrt((1.0 - known) / (2.0 * averages * known))
    share = np.where(known >= 1.0, np.nan, share)
    return DB_PER_NEPER * share, np.degrees(share)
