"""What the plain and the named model predict of each reading, as part of a diagnosis' document.

Owns that table. Each source level is predicted by a fit that has not seen it; nothing is computed
here but differences.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.observation.observation import Observation
from analysis.selection.verdict import Judged
from daq.frf import DB_PER_NEPER

__all__ = ["prediction_document"]

_DIGITS = 5


def prediction_document(
    observation: Observation, baseline: Judged, extended: Judged | None
) -> dict[str, Any]:
    """The field ``prediction``: readings in rows, and what models say of each.

    Parameters
    ----------
    baseline, extended
        The plain model, and the set that is named; None where none is.

    Returns
    -------
    dict
        ``source_vpk``, ``frequency_hz``, ``sweep`` (from 0), ``gain_db`` and ``phase_deg`` as
        read, and for ``baseline`` and ``extended`` the same two as predicted with ``gain_std_db``
        and ``phase_std_deg``, one standard deviation of a reading. Lists of one length; None where
        nothing was read, or a reading drowned in noise.
    """
    gain, phase = _read(observation)
    sweep = np.zeros(len(observation), dtype=int)
    for number, (_, rows) in enumerate(observation.plans):
        sweep[rows] = number
    return {
        "source_vpk": _plain(observation.source_vpk),
        "frequency_hz": [float(hertz) for hertz in observation.frequency_hz],
        "sweep": sweep.tolist(),
        "gain_db": _plain(DB_PER_NEPER * gain),
        "phase_deg": _plain(np.degrees(phase)),
        "baseline": _predicted(observation, baseline),
        "extended": None if extended is None else _predicted(observation, extended),
    }


def _read(observation: Observation) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gain in nepers and phase in radians; NaN of what drowned, which is no plain reading."""
    drowned = observation.floor > 0.0
    gain, phase = (np.where(drowned, np.nan, observation.values[n]) for n in (0, 1))
    return gain, phase


def _predicted(observation: Observation, one: Judged) -> dict[str, list[float | None]]:
    gain, phase = _read(observation)
    residual, std = one.held_out.residual, one.held_out.std
    return {
        "gain_db": _plain(DB_PER_NEPER * (gain - residual[0])),
        "gain_std_db": _plain(DB_PER_NEPER * np.where(np.isnan(gain), np.nan, std[0])),
        "phase_deg": _plain(np.degrees(phase - residual[1])),
        "phase_std_deg": _plain(np.degrees(np.where(np.isnan(phase), np.nan, std[1]))),
    }


def _plain(values: NDArray[np.float64]) -> list[float | None]:
    rounded: Sequence[float] = [float(f"{value:.{_DIGITS}g}") for value in values]
    return [value if np.isfinite(value) else None for value in rounded]
