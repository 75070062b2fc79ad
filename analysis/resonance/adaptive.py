"""Where anti-resonance and resonance lie in the points so far, for a sweep that refines itself.

Owns the translation between the extractor and `daq.adaptive`. It chooses no
frequency and reads nothing out of a response itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from analysis.resonance.extract import extract
from analysis.resonance.records import Feature
from daq.analyser import SweepPoint
from daq.errors import AnalysisError, InputError
from daq.frf import FrequencyResponse

__all__ = ["judge_features"]

_NOT_FOUND = (math.nan, math.nan, math.nan)
_WIDTHS = 2.0
"""Half widths (damping ratio times frequency) around a feature that are of interest."""


def judge_features(points: Sequence[SweepPoint]) -> list[tuple[float, float, float]]:
    """Find both features; see `daq.adaptive.Judge`.

    Parameters
    ----------
    points
        Of one source level, ascending in frequency; of points at the same
        frequency the last one counts.

    Returns
    -------
    list of tuple
        Frequency, standard error and width in Hz of ARF and RF; NaN where one
        is not found.
    """
    latest = {point.frequency_hz: point for point in points}
    if not latest:
        return [_NOT_FOUND, _NOT_FOUND]
    response = FrequencyResponse.from_arrays(
        list(latest),
        1.0,
        [point.gain for point in latest.values()],
        unit="",
        gain_std_db=[_or_nan(point.gain_std_db) for point in latest.values()],
        phase_std_deg=[_or_nan(point.phase_std_deg) for point in latest.values()],
        flags=[int(point.flags) for point in latest.values()],
    )
    try:
        (level,) = extract(response)
    except (AnalysisError, InputError):
        return [_NOT_FOUND, _NOT_FOUND]
    return [_placed(level.arf), _placed(level.rf)]


def _placed(feature: Feature | None) -> tuple[float, float, float]:
    if feature is None:
        return _NOT_FOUND
    damping = feature.damping_ratio
    width_hz = math.nan if damping is None else _WIDTHS * damping * feature.frequency_hz
    return feature.frequency_hz, feature.std_hz, width_hz


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
