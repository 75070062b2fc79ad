"""The report on one measurement: one HTML file that needs nothing else and prints on paper.

Owns what goes into a report and the file itself. Estimate and diagnosis are
made elsewhere and handed in; the page shows no number that its
machine-readable copy does not hold.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

from analysis import report_sections as sections
from analysis.advice import limit_lines, stage_actions, stage_to_adjust
from analysis.diagnosis import Diagnosis
from analysis.markup import Markup, data_block, element, joined
from analysis.report_data import Origin, report_data
from analysis.report_figures import bode_svg, diagnosis_svgs, estimate_svg
from analysis.report_style import STYLE
from analysis.resonance import extract
from daq.errors import AnalysisError, ConfigurationError
from daq.formats.atomic import write_text
from daq.frf import FrequencyResponse
from daq.store import Store
from sim.unit import Unit, unit_from_mapping

__all__ = ["Diagnosed", "file_origin", "stored_origin", "write_report"]

_POLICY = "default-src 'none'; style-src 'unsafe-inline'"
"""Held by every browser: the page can fetch nothing and run nothing."""


class Diagnosed(Protocol):
    """A diagnosis as far as a report needs it."""

    def to_json(self) -> dict[str, Any]:
        """The document of ``diagnose --json``."""
        ...


def write_report(
    path: Path,
    response: FrequencyResponse,
    unit: Unit,
    origin: Origin,
    *,
    estimate: Mapping[str, Any] | None = None,
    diagnosis: Diagnosed | None = None,
    remarks: Mapping[str, str] | None = None,
    made: datetime | None = None,
) -> Path:
    """Write a report.

    Parameters
    ----------
    path
        HTML file; it appears whole or not at all.
    response
        What was measured; unit, operator, instrument and configurations are
        taken from its provenance as far as that holds them.
    unit
        The unit that estimate and diagnosis took it for.
    origin
        `file_origin` or `stored_origin`.
    estimate
        Document of ``estimate --json``; None leaves the section empty.
    diagnosis
        An `analysis.diagnosis.Diagnosis` or anything with its document; pictures
        are drawn of the former only. None leaves the section empty.
    remarks
        Why there is no ``"estimate"`` or ``"diagnosis"``; further keys are free.
    made
        Moment of the report; now, if left out.

    Raises
    ------
    InputError
        If no file can be made at `path`.
    AnalysisError
        If the response holds no reading.
    """
    if len(response) == 0:
        raise AnalysisError("there is nothing to report on: the response holds no reading")
    features = extract(response)
    data = report_data(
        response,
        unit,
        origin,
        features,
        estimate,
        None if diagnosis is None else diagnosis.to_json(),
        remarks or {},
        made or datetime.now(UTC),
    )
    pictures = diagnosis_svgs(diagnosis) if isinstance(diagnosis, Diagnosis) else ()
    limits = [] if estimate is None else limit_lines(estimate, unit)
    body = joined(
        sections.summary_section(data, _actions(data, unit)),
        sections.facts_section(data),
        sections.features_section(data, bode_svg(response, features)),
        sections.estimate_section(
            data, limits, None if estimate is None else estimate_svg(estimate)
        ),
        sections.diagnosis_section(data, pictures),
        sections.provenance_section(data),
        data_block(data, "lashbench-report"),
    )
    write_text(path, _page(f"Backlash report: {unit.name}", body))
    return path


def file_origin(path: Path) -> Origin:
    """The origin of a response that was read from a file."""
    return Origin(path.name, hashlib.sha256(path.read_bytes()).hexdigest())


def stored_origin(store: Store, measurement: int) -> Origin:
    """The origin of a stored measurement, with how it ended.

    Raises
    ------
    InputError
        If there is none with that identifier.
    """
    found = store.measurement(measurement)
    return Origin(
        f"measurement {measurement} of {store.path.name}",
        facts={
            "measurement": measurement,
            "ended": found.ended,
            "source_state": found.source_state.value,
            "flagged": found.flagged,
            "planned_points": found.header.plan.points,
        },
    )


def _actions(data: Mapping[str, Any], unit: Unit) -> list[str]:
    """What to do, most important first."""
    estimate, diagnosis = data["estimate"], data["diagnosis"]
    lines: list[str] = []
    if estimate is not None:
        lines = [stage_to_adjust(estimate), *stage_actions(estimate, unit)]
    if diagnosis is not None:
        lines += _diagnosed_actions(diagnosis)
    lines += _doubts(data, unit)
    return lines or ["No estimate was made; see below for what was measured."]


def _diagnosed_actions(diagnosis: Mapping[str, Any]) -> list[str]:
    word, causes = diagnosis["verdict"], diagnosis["causes"]
    names = " and ".join(cause["effect"] for cause in causes)
    if word == "consistent":
        return ["The unit's model explains the response; nothing else needs to be looked for."]
    if word == "unexplained":
        return ["Something is missing that no known cause explains: trust r with care."]
    ratio = diagnosis["contribution_ratio"]["extended"]
    said = f"{names} explains the response"
    if word == "ambiguous":
        said = f"{names} may explain the response, and others are not ruled out"
    if ratio["value"] is not None:
        said += f"; with it r is {ratio['value']:.2f} ± {ratio['std'] or 0.0:.2f}"
    if any(cause.get("site") == "chain" for cause in causes):
        right = (
            "see whether the measuring chain is"
            if word == "ambiguous"
            else "put the measuring chain"
        )
        said += f"; {right} right before touching a gear"
    return [f"{said}."]


def _doubts(data: Mapping[str, Any], unit: Unit) -> list[str]:
    """Reasons to think that the response and the unit do not belong together."""
    named = data["procedure"]["unit"]
    lines = []
    if named.lower() != unit.name.lower():
        lines.append(f"The response names unit {named}; it was taken for {unit.name}.")
    measured_as = data["provenance"]["configurations"].get("unit")
    if measured_as is not None and _other_unit(measured_as["text"], unit):
        lines.append("The unit file has changed since this was measured.")
    state = data["measurement"].get("state")
    if state in ("interrupted", "aborted"):
        lines.append(f"The measurement is not complete: {state}.")
    return lines


def _other_unit(text: str, unit: Unit) -> bool:
    try:
        return unit_from_mapping(tomllib.loads(text), source="unit as measured") != unit
    except (ConfigurationError, tomllib.TOMLDecodeError):
        # What cannot be read any more is another file at any rate.
        return True


def _page(title: str, body: Markup) -> str:
    head: Sequence[Markup] = (
        element("meta", charset="utf-8"),
        element("meta", http_equiv="Content-Security-Policy", content=_POLICY),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("title", title),
        element("style", Markup(STYLE)),
    )
    page = element("html", element("head", head), element("body", element("main", body)), lang="en")
    return f"<!DOCTYPE html>\n{page}\n"
