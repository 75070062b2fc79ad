"""The report on one measurement: one HTML file that needs nothing else and prints on paper.

Owns what goes into a report and the file itself. Estimate and diagnosis are
made elsewhere and handed in; the page shows no number that its
machine-readable copy does not hold.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

from analysis.acceptance import Judgement
from analysis.advice import Advice, advise
from analysis.answer import Answer, accept_model
from analysis.diagnosis import Diagnosis
from analysis.observation.incomplete import state_doubt
from analysis.report import sections
from analysis.report.certificate import (
    Certificate,
    approval_section,
    conformity_section,
    logo_picture,
    page_style,
)
from analysis.report.document import Origin, report_data
from analysis.report.html import data_block, document, joined
from analysis.report.style import STYLE
from analysis.report.svg_figures import backlash_svg, bode_svg, diagnosis_svgs
from analysis.resonance import extract
from analysis.selection.wording import verdict_words
from daq.errors import AnalysisError, ConfigurationError
from daq.formats.atomic import write_text
from daq.frf import FrequencyResponse
from daq.store import Store
from sim.unit import Unit, unit_from_mapping

__all__ = ["Diagnosed", "file_origin", "stored_origin", "write_report"]


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
    judgement: Judgement | None = None,
    certificate: Certificate | None = None,
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
        Why there is no ``"estimate"`` or ``"diagnosis"``; ``"input"``, what the response looks
        like, is the first line of the page; further keys are free.
    judgement
        What limits say of the unit; None leaves the section out.
    certificate
        Number, calibration, environment, approver and logo.
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
        judgement,
        certificate,
    )
    pictures = diagnosis_svgs(diagnosis) if isinstance(diagnosis, Diagnosis) else ()
    answer = accept_model(data["estimate"], data["diagnosis"])
    advice = advise(answer, unit, judgement=judgement, doubt=_doubt(data))
    logo = "" if certificate is None else certificate.logo
    body = joined(
        logo_picture(logo),
        sections.summary_section(data, _actions(data, unit, answer, advice, judgement)),
        conformity_section(judgement),
        sections.facts_section(data),
        sections.features_section(data, bode_svg(response, features)),
        sections.backlash_section(
            data, answer, advice, backlash_svg(answer.contribution_ratio, data["estimate"])
        ),
        sections.diagnosis_section(data, pictures),
        sections.provenance_section(data),
        approval_section(data),
        data_block(data, "lashbench-report"),
    )
    title, style = f"Backlash report: {unit.name}", STYLE + page_style(data)
    write_text(path, document(title, body, style, pictures=bool(logo)))
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
        f"measurement {measurement} of {store.name}",
        facts={
            "measurement": measurement,
            "ended": found.ended,
            "source_state": found.source_state.value,
            "flagged": found.flagged,
            "planned_points": found.header.plan.points,
        },
    )


def _actions(
    data: Mapping[str, Any],
    unit: Unit,
    answer: Answer,
    advice: Advice,
    judgement: Judgement | None,
) -> list[str]:
    """What to do, most important first."""
    diagnosis = data["diagnosis"]
    doubt = data["remarks"].get("input")
    lines = [] if judgement is None else [judgement.headline]
    lines += [f"This response looks like a mistake: {doubt}."] if doubt else []
    lines += [advice.before] if advice.before else []
    lines += [] if answer.state == "none" else [advice.headline]
    if answer.models:
        lines += [stage.line for stage in advice.stages if stage.verdict is not None]
        without = all(stage.verdict is None for stage in advice.stages)
        if without and judgement is None:
            lines.append(
                "No limits are set; b1_deg and b2_deg under [limits] of the unit file would say "
                "whether a stage passes."
            )
    if diagnosis is not None:
        lines += verdict_words(diagnosis)
    lines += _doubts(data, unit)
    return lines or ["No estimate was made; see below for what was measured."]


def _doubt(data: Mapping[str, Any]) -> str:
    """Why no limit is passed or failed by this response; empty if nothing is known."""
    incomplete = state_doubt(data["measurement"].get("state"))
    return "; ".join(filter(None, (data["remarks"].get("input"), incomplete)))


def _doubts(data: Mapping[str, Any], unit: Unit) -> list[str]:
    """Reasons to think that the response and the unit do not belong together."""
    named = data["procedure"]["unit"]
    lines = []
    if named.lower() != unit.name.lower():
        lines.append(f"The response names unit {named}; it was taken for {unit.name}.")
    measured_as = data["provenance"]["configurations"].get("unit")
    if measured_as is not None and _other_unit(measured_as["text"], unit):
        lines.append("The unit file has changed since this was measured.")
    if incomplete := state_doubt(data["measurement"].get("state")):
        lines.append(f"{incomplete[0].upper()}{incomplete[1:]}.")
    return lines


def _other_unit(text: str, unit: Unit) -> bool:
    try:
        measured = unit_from_mapping(tomllib.loads(text), source="unit as measured")
        # What the files say: not what an option overrides.
        return measured.model_dump() != unit.model_dump()
    except (ConfigurationError, tomllib.TOMLDecodeError):
        # What cannot be read any more is another file at any rate.
        return True
