"""What a response shows at each source level: the records, as JSON and as text.

Owns the nouns ARF, RF and level, and how they are written. It reads nothing
out of a response (`analysis.resonance.extract` does) and prints nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

__all__ = ["Feature", "FeaturePair", "LevelFeatures", "Method", "summary", "to_json"]

Method = Literal["rational", "parabola", "grid"]


@dataclass(frozen=True, slots=True)
class Feature:
    """An anti-resonance or a resonance.

    Parameters
    ----------
    frequency_hz, std_hz
        Where the gain is least or greatest, and one standard error, Hz.
    gain_db, gain_std_db
        The gain there and one standard error, dB.
    damping_ratio, damping_std
        Damping ratio of the zero or pole pair, or, where no linear model fits,
        from half-power points, equation (22); None where neither can be had.
    method
        ``"rational"``: linear model; ``"parabola"``: local parabola in dB;
        ``"grid"``: extremum of the readings, smoothed as their noise asks for.
    """

    frequency_hz: float
    std_hz: float
    gain_db: float
    gain_std_db: float
    damping_ratio: float | None
    damping_std: float | None
    method: Method


@dataclass(frozen=True, slots=True)
class FeaturePair:
    """An anti-resonance and the resonance next above it; None for the one that lacks."""

    arf: Feature | None
    rf: Feature | None


@dataclass(frozen=True, slots=True)
class LevelFeatures:
    """What one source level shows.

    Parameters
    ----------
    source_vpk
        Source level, V peak; NaN where the response does not say.
    arf, rf
        The minimum, and the maximum above it; None where not there, and then
        `flags` says why.
    difference_hz, difference_std_hz
        RF less ARF and one standard error with their covariance, Hz; None
        unless both are there.
    flags
        What a reader should know; each starts with ``arf:``, ``rf:`` or ``level:``.
    pairs
        All that are in the band, ascending; `arf` and `rf` are of one of them.
    """

    source_vpk: float
    arf: Feature | None
    rf: Feature | None
    difference_hz: float | None
    difference_std_hz: float | None
    flags: tuple[str, ...]
    pairs: tuple[FeaturePair, ...] = ()


def to_json(features: Sequence[LevelFeatures]) -> dict[str, Any]:
    """The levels as one JSON document of plain dictionaries, lists, numbers and None.

    ``damping_ratio`` holds for ``arf`` and ``rf`` each ``{"value", "std"}`` or
    None; ``pairs`` lists all pairs, each feature with its damping ratio.
    Whatever is not known is None, never NaN.
    """
    return {"levels": [_level_json(level) for level in features]}


def _level_json(level: LevelFeatures) -> dict[str, Any]:
    difference = _pair(level.difference_hz, level.difference_std_hz)
    return {
        "source_vpk": _number(level.source_vpk),
        "arf": _feature_json(level.arf),
        "rf": _feature_json(level.rf),
        "difference_hz": difference,
        "damping_ratio": {
            name: None if f is None else _pair(f.damping_ratio, f.damping_std)
            for name, f in (("arf", level.arf), ("rf", level.rf))
        },
        "flags": list(level.flags),
        "pairs": [
            {"arf": _paired_json(pair.arf), "rf": _paired_json(pair.rf)} for pair in level.pairs
        ],
    }


def _paired_json(feature: Feature | None) -> dict[str, Any] | None:
    found = _feature_json(feature)
    if feature is not None and found is not None:
        found["damping_ratio"] = _pair(feature.damping_ratio, feature.damping_std)
    return found


def _feature_json(feature: Feature | None) -> dict[str, Any] | None:
    if feature is None:
        return None
    return {
        "frequency_hz": _number(feature.frequency_hz),
        "std_hz": _number(feature.std_hz),
        "gain_db": _number(feature.gain_db),
        "gain_std_db": _number(feature.gain_std_db),
        "method": feature.method,
    }


def _number(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def _pair(value: float | None, std: float | None) -> dict[str, float | None] | None:
    return None if _number(value) is None else {"value": _number(value), "std": _number(std)}


def summary(features: Sequence[LevelFeatures]) -> list[str]:
    """The levels as lines of an aligned table of 80 columns, each level's flags below it."""
    head = ("V pk", "", "Hz", "dB", "damping", "RF - ARF, Hz")
    rows = [head, *(row for level in features for row in _rows(level))]
    widths = [max(len(row[k]) for row in rows) for k in range(len(head))]
    lines = [
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    for level in features:
        lines += [f"{_level_name(level)} V  {flag}" for flag in level.flags]
    return lines


def _level_name(level: LevelFeatures) -> str:
    return f"{level.source_vpk:g}" if math.isfinite(level.source_vpk) else "?"


def _rows(level: LevelFeatures) -> Iterator[tuple[str, ...]]:
    apart = with_error(level.difference_hz, level.difference_std_hz)
    yield _level_name(level), "ARF", *_cells(level.arf), ""
    yield "", "RF", *_cells(level.rf), apart
    for number, pair in enumerate(level.pairs, start=1):
        if pair.arf is not None and pair.arf is not level.arf:
            yield "", f"ARF {number}", *_cells(pair.arf), ""
        if pair.rf is not None and pair.rf is not level.rf:
            yield "", f"RF {number}", *_cells(pair.rf), ""


def _cells(feature: Feature | None) -> tuple[str, str, str]:
    if feature is None:
        return "-", "-", "-"
    return (
        with_error(feature.frequency_hz, feature.std_hz),
        with_error(feature.gain_db, feature.gain_std_db),
        with_error(feature.damping_ratio, feature.damping_std),
    )


def with_error(value: float | None, std: float | None) -> str:
    """A value and its error, to two digits of the error; a dash where there is none.

    >>> with_error(39.9662, 0.00712)
    '39.9662 ± 0.0071'
    >>> with_error(130.6, 2.34)
    '130.6 ± 2.3'
    """
    value, std = _number(value), _number(std)
    if value is None:
        return "-"
    if std is None or std <= 0.0:
        return f"{value:.4g}"
    digits = min(6, max(0, 1 - math.floor(math.log10(std))))
    return f"{value:.{digits}f} ± {std:.{digits}f}"
