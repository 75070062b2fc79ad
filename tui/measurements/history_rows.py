"""Measurements of a history as rows, and the trend of what is accepted of them.

Owns these rows for the command and the screens alike. Which model is accepted is
`analysis.answer`'s part. It makes no estimate and prints nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from daq.errors import FileFormatError

if TYPE_CHECKING:
    from analysis.acceptance import LimitSet
    from analysis.trend import Trend
    from daq.store_records import Answer, Correction, HistoryLine

__all__ = [
    "QUANTITIES",
    "Trends",
    "answer_words",
    "correction_words",
    "measurement_row",
    "told_groups",
    "trend_lines",
]

QUANTITIES = ("contribution_ratio", "b1_deg", "b2_deg")
"""What is followed over time, by its name in an estimate's document."""

_LIMITED: dict[str, str] = dict(zip(QUANTITIES, ("r", "b1_deg", "b2_deg"), strict=True))
"""What a table of limits calls them."""

_HORIZON_S = 365 * 86400.0
"""So long after the last measurement a limit must be reached for an alarm."""

_SECONDS_PER_DAY = 86400.0
_SCATTER = 4.0
"""Mean squared distance in standard errors from which values are said to differ."""


def measurement_row(line: HistoryLine) -> dict[str, Any]:
    """A measurement as one flat row, with the numbers of the model that is accepted.

    Raises
    ------
    FileFormatError
        If what the history holds of an analysis is none.
    """
    from analysis.answer import accept_model
    from analysis.edition import EDITION

    estimate = _summary(line, "estimate", line.estimate)
    diagnosis = _summary(line, "diagnosis", line.diagnosis)
    answer = accept_model(estimate, diagnosis)
    row: dict[str, Any] = {
        "id": line.id,
        "unit": line.unit,
        "serial": line.serial,
        "started": line.started,
        "state": line.state,
        "points": line.points,
    }
    row |= {name: answer.numbers.get(name) for name in QUANTITIES}
    warnings = [
        *((estimate or {}).get("warnings") or ()),
        *((diagnosis or {}).get("warnings") or ()),
    ]
    for kind, kept in (("estimate", line.estimate), ("diagnosis", line.diagnosis)):
        if kept is not None and kept.edition != EDITION:
            words = f"the {kind} is of an earlier edition of the inference ({kept.software})"
            again = "--estimate all makes it anew" if kind == "estimate" else "diagnose once more"
            warnings.append(f"{words}; {again}")
    over = {name: answer.over_models(name) for name in QUANTITIES}
    if answer.state == "accepted" and (ratio := over["contribution_ratio"]) is not None:
        low, high = ratio["interval95"]
        warnings.append(
            f"still open: {len(answer.models)} models are left, and over all of them the "
            f"contribution ratio is {low:.2f} to {high:.2f}",
        )
    return row | {
        "answer": {"state": answer.state, "source": answer.source, "over_models": over},
        "warnings": list(dict.fromkeys(warnings)),
        "estimate": line.estimate and _origin(line.estimate) | _plain_numbers(estimate or {}),
        "diagnosis": line.diagnosis and _origin(line.diagnosis) | _verdict(diagnosis or {}),
        "corrections": line.corrections,
        "flagged": line.flagged,
        "planned": line.planned,
        "levels_vpk": list(line.levels_vpk),
        "source_state": line.source_state.value,
        "simulated": line.simulated,
        "operator": line.operator,
        "notes": line.notes,
    }


def _summary(line: HistoryLine, kind: str, kept: Answer | None) -> Mapping[str, Any] | None:
    from tui.measurements.stored_shapes import fault_of

    if kept is None:
        return None
    fault = fault_of(f"{kind} line", kept.summary)
    if fault:
        raise FileFormatError(
            f"the {kind} of measurement {line.id} cannot be read ({fault}); restore a copy of "
            "the history"
        )
    return kept.summary


def _origin(kept: Answer) -> dict[str, Any]:
    return {"made": kept.made, "software": kept.software, "edition": kept.edition}


def _plain_numbers(estimate: Mapping[str, Any]) -> dict[str, Any]:
    """What the plain model says, accepted or not."""
    return {name: estimate.get(name) for name in (*QUANTITIES, "failed")}


def _verdict(diagnosis: Mapping[str, Any]) -> dict[str, Any]:
    causes = [
        {"effect": cause["effect"], "probability": cause["probability"]}
        for cause in diagnosis["causes"]
    ]
    return {"verdict": diagnosis["verdict"], "causes": causes}


def answer_words(row: Mapping[str, Any]) -> list[str]:
    """What was diagnosed of a measurement, why no number is shown, and every warning."""
    lines = []
    if row["diagnosis"] is not None:
        diagnosis = row["diagnosis"]
        causes = [f"{c['effect']} ({c['probability']:.2f})" for c in diagnosis["causes"]]
        names = f": {', '.join(causes)}" if causes else ""
        lines.append(f"diagnosed {diagnosis['verdict']}{names}")
    if row["answer"]["state"] in ("refuted", "open"):
        call = "" if row["diagnosis"] else "; diagnose it first"
        source = row["answer"]["source"].removesuffix(": none")
        lines.append(f"no model is accepted: {source}{call}")
    failed = (row["estimate"] or {}).get("failed")
    if failed:
        lines.append(f"no estimate: {failed}")
    return lines + [f"warning: {text}" for text in row["warnings"]]


def correction_words(correction: Correction) -> str:
    """A line of the audit trail."""
    moment = correction.time[:16].replace("T", " ")
    return (
        f"{correction.field} {correction.old!r} corrected to {correction.new!r} "
        f"by {correction.person}, {moment} UTC"
    )


def told_groups(rows: Iterable[dict[str, Any]]) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """Measurements that were estimated or diagnosed, by unit and serial number."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in rows:
        if row["estimate"] is not None or row["diagnosis"] is not None:
            groups.setdefault((row["unit"], row["serial"]), []).append(row)
    return groups


@dataclass(frozen=True, slots=True)
class _Series:
    """Moments, values and errors of one quantity of one unit and serial number."""

    moments: list[str] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    stds: list[float] = field(default_factory=list)


class Trends:
    """The trend of each quantity of each unit and serial number, from rows one after the other.

    Only what is accepted counts, and only with an error.
    """

    def __init__(
        self, rows: Iterable[Mapping[str, Any]] = (), limits: LimitSet | None = None
    ) -> None:
        self._limits = limits
        self._series: dict[tuple[str, str, str], _Series] = {}
        for row in rows:
            self.add(row)

    def add(self, row: Mapping[str, Any]) -> None:
        """Take a measurement in."""
        for name in QUANTITIES:
            # A number of one model of several is known no better than all of them together.
            number = row[name] and (row["answer"]["over_models"][name] or row[name])
            if number and number.get("std"):
                key = (row["unit"], row["serial"], name)
                series = self._series.setdefault(key, _Series())
                series.moments.append(row["started"])
                series.values.append(number["value"])
                series.stds.append(number["std"])

    def rows(self) -> list[dict[str, Any]]:
        """A row for each trend."""
        from analysis.trend import fit_trend

        trends = []
        for (unit, serial, name), series in self._series.items():
            moments_s = _moments_s(series.moments)
            trend = fit_trend(moments_s, series.values, series.stds)
            if trend is None:
                continue
            slope = {"value": trend.slope_per_day, "std": trend.slope_std}
            trends.append(
                {
                    "unit": unit,
                    "serial": serial,
                    "quantity": name,
                    "measurements": len(series.values),
                    "mean": {"value": trend.mean, "std": trend.mean_std},
                    "per_day": None if trend.slope_per_day is None else slope,
                    "chi2": trend.chi2,
                    "degrees": trend.degrees,
                    "alarm": self._alarm(name, trend, max(moments_s)),
                }
            )
        return trends

    def _alarm(self, quantity: str, trend: Trend, last_s: float) -> dict[str, Any] | None:
        """The limit that a quantity moves towards, and when it is there, if within a year."""
        from datetime import UTC, datetime

        if self._limits is None:
            return None
        found = [
            trend.reaches(bound.lower, bound.upper)
            for name, bound in self._limits.acceptance.bounds()
            if name == _LIMITED[quantity]
        ]
        near = [one for one in found if one is not None and one[1] <= last_s + _HORIZON_S]
        if not near:
            return None
        limit, moment_s = min(near, key=lambda one: one[1])
        reached = moment_s <= last_s
        day = datetime.fromtimestamp(moment_s, UTC).date().isoformat()
        return {"limit": limit, "date": day, "reached": reached}


def _moments_s(moments: Sequence[str]) -> list[float]:
    """When each was begun; measurements of one day count as made at the same moment.

    Minutes apart, a slope would say nothing but how wide the bars are.
    """
    from datetime import datetime

    moments_s = [datetime.fromisoformat(moment).timestamp() for moment in moments]
    apart_s = max(moments_s, default=0.0) - min(moments_s, default=0.0)
    return moments_s if apart_s >= _SECONDS_PER_DAY else [0.0] * len(moments_s)


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
        if trend["alarm"] is not None:
            line += f"; ALARM: {_alarm_words(trend['alarm'])}"
        if trend["chi2"] > _SCATTER * max(trend["degrees"], 1):
            line += "; they differ by more than their errors"
        lines.append(line)
    return ["", *lines] if lines else []


def _alarm_words(alarm: Mapping[str, Any]) -> str:
    if alarm["reached"]:
        return f"the line passed the limit {alarm['limit']:g} on {alarm['date']}"
    return f"at this rate it reaches the limit {alarm['limit']:g} on {alarm['date']}"
