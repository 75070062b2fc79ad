"""Measurements of a history as rows, and the trend of what was estimated from them.

Owns these rows for the command and the screens alike. It makes no estimate and
prints nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from daq.store_records import Measurement

__all__ = ["QUANTITIES", "estimated_groups", "measurement_row", "trend_lines", "trend_rows"]

QUANTITIES = ("contribution_ratio", "b1_deg", "b2_deg")
"""What is followed over time, by its name in an estimate's document."""

_SECONDS_PER_DAY = 86400.0
_SCATTER = 4.0
"""Mean squared distance in standard errors from which values are said to differ."""


def measurement_row(measurement: Measurement, estimate: Mapping[str, Any]) -> dict[str, Any]:
    """A measurement and its estimate's document (empty for none) as one flat row."""
    header = measurement.header
    row: dict[str, Any] = {
        "id": measurement.id,
        "unit": header.unit,
        "serial": header.serial,
        "started": measurement.started,
        "state": measurement.state,
        "points": measurement.points,
    }
    row |= {name: estimate.get(name) for name in QUANTITIES}
    simulated = measurement.instrument is not None and measurement.instrument.simulated
    return row | {
        "flagged": measurement.flagged,
        "planned": header.plan.points,
        "levels_vpk": list(header.plan.levels_vpk),
        "source_state": measurement.source_state.value,
        "simulated": simulated,
        "operator": header.operator,
        "notes": header.notes,
    }


def estimated_groups(rows: Sequence[dict[str, Any]]) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """Estimated measurements by unit and serial number."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in rows:
        if row["contribution_ratio"] is not None:
            groups.setdefault((row["unit"], row["serial"]), []).append(row)
    return groups


def trend_rows(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The trend of each quantity of each unit and serial number that has an estimate."""
    from analysis.trend import fit_trend

    trends = []
    for (unit, serial), group in estimated_groups(rows).items():
        for name in QUANTITIES:
            sure = [row for row in group if row[name] and row[name]["std"]]
            trend = fit_trend(
                _moments_s(sure),
                [row[name]["value"] for row in sure],
                [row[name]["std"] for row in sure],
            )
            if trend is None:
                continue
            slope = {"value": trend.slope_per_day, "std": trend.slope_std}
            trends.append(
                {
                    "unit": unit,
                    "serial": serial,
                    "quantity": name,
                    "measurements": len(sure),
                    "mean": {"value": trend.mean, "std": trend.mean_std},
                    "per_day": None if trend.slope_per_day is None else slope,
                    "chi2": trend.chi2,
                    "degrees": trend.degrees,
                }
            )
    return trends


def _moments_s(rows: Sequence[dict[str, Any]]) -> list[float]:
    """When each was begun; measurements of one day count as made at the same moment.

    Minutes apart, a slope would say nothing but how wide the bars are.
    """
    from datetime import datetime

    moments_s = [datetime.fromisoformat(row["started"]).timestamp() for row in rows]
    apart_s = max(moments_s, default=0.0) - min(moments_s, default=0.0)
    return moments_s if apart_s >= _SECONDS_PER_DAY else [0.0] * len(rows)


def trend_lines(trends: Sequence[dict[str, Any]]) -> list[str]:
    """Trends of two measurements or more in words, an empty line first."""
    lines = []
    for trend in trends:
        if trend["measurements"] < 2:
            continue
        name = f"{trend['unit']} {trend['serial']}".strip()
        line = (
            f"{name}: {trend['quantity']} {trend['mean']['value']:.4g} "
            f"+- {trend['mean']['std']:.2g}"
        )
        slope = trend["per_day"]
        if slope is not None:
            line += f", {30 * slope['value']:+.3g} +- {30 * slope['std']:.2g} in 30 days"
        if trend["chi2"] > _SCATTER * max(trend["degrees"], 1):
            line += "; they differ by more than their errors"
        lines.append(line)
    return ["", *lines] if lines else []
