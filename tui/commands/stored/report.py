"""``lashbench report``: one measurement as an HTML page that needs nothing else.

Owns the options of the verb, and which estimate and diagnosis go into the
page. What stands on it is the analysis's.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from daq.errors import InputError, LashbenchError
from daq.servers.place import HistoryPlace, files_of
from tui.certificate_options import NO_CERTIFICATE, CertificateOptions, is_pdf
from tui.judging import features_for, judgement_lines, limits_to_judge_by
from tui.options import HistoryOption, JudgeBy, Tolerance, UnitName
from tui.places import cache_folder, history_path, measurement_number
from tui.reading_options import NO_OPTIONS, ReadingOptions, read_file
from tui.text.output import Console, Injected, readers_may_leave
from tui.text.shell_quote import proposing
from tui.unit_under_test import read_unit

if TYPE_CHECKING:
    from analysis.diagnosis import Diagnosis
    from analysis.report import Diagnosed
    from analysis.report.document import Origin
    from daq.frf import FrequencyResponse
    from daq.store_records import Measurement
    from sim.unit import Unit
    from tui.measurements.stored_answers import StoredDiagnosis

__all__ = ["report"]

_WAY_ON = "--as-is takes it as it stands"


def report(
    source: Annotated[str, Parameter(name="FILE_OR_ID")],
    /,
    *,
    unit: UnitName,
    out: Path,
    db: HistoryOption = None,
    tolerance: Tolerance = None,
    diagnose: Annotated[bool | None, Parameter(negative="--no-diagnose")] = None,
    as_is: bool = False,
    judge: JudgeBy = None,
    certificate: CertificateOptions = NO_CERTIFICATE,
    given: ReadingOptions = NO_OPTIONS,
    console: Injected,
) -> int:
    """Write a report on one measurement as a single HTML file that prints on A4, or as PDF.

    It holds the response, the backlash of each stage and what to do about it,
    the diagnosis, where everything came from, and a copy for programs.

    Parameters
    ----------
    source
        Response as csv, h5, uff, mat or the analyser's own sdf, or the
        identifier of a measurement as `history` lists it.
    out
        HTML file to write, or a PDF, which Chromium or WeasyPrint prints.
    db
        The bench's history, a file or postgresql://USER@HOST/DATABASE; yours, if left out.
    diagnose
        Diagnose too, which takes a minute or two, even where the history holds a diagnosis of
        these points; --no-diagnose makes none, and shows the one of the history if there is one.
    as_is
        Estimate and diagnose a response as it stands, also if it looks like a mistake.
    """
    from analysis.observation.excitation import excitation_doubt
    from analysis.observation.input_check import check_inputs
    from analysis.observation.joint import unit_doubts
    from daq.formats.atomic import checked_target

    if out.suffix.lower() not in (".html", ".htm", ".pdf"):
        raise InputError(f"{out}: a report is HTML or PDF; give a name that ends in .html or .pdf")
    checked_target(out, source, unit, *files_of(history_path(db)), *([judge] if judge else []))
    if is_pdf(out):
        from analysis.report.pdf import find_printer

        find_printer()
    limits = limits_to_judge_by(judge)
    subject = read_unit(unit, console, tolerance)
    remarks: dict[str, str] = {}
    kept: _Kept | None = None
    number = measurement_number(source, db)
    if number is None:
        from analysis.report import file_origin

        response, origin = read_file(source, given, console), file_origin(Path(source))
    elif given != NO_OPTIONS:
        raise InputError(
            f"measurement {source} is in a history, which says everything; leave out the options "
            "that complete a file"
        )
    else:
        kept = _stored(history_path(db), number, subject)
        response, origin = kept.response, kept.origin
    issued = certificate.certificate(response.provenance.get("configurations") or {})
    for doubt in unit_doubts([response], subject):
        console.note(f"warning: {doubt}")
    said = check_inputs([response], subject, as_is=True)
    if said:
        remarks["input"] = "; ".join(said)
        console.note(f"warning: {remarks['input']}")
    is_final = bool(excitation_doubt(response))
    refused = bool(said) and (is_final or not as_is)
    why = remarks.get("input", "") + ("" if is_final else f"; {_WAY_ON}")
    estimate = None if kept is None else kept.estimate
    if estimate is None and refused:
        remarks["estimate"] = f"No estimate was made: {why}."
    elif estimate is None:
        estimate = _estimate(response, subject, remarks, kept, console)
    diagnosis: Diagnosed | None = None
    if kept is not None and kept.diagnosis is not None and not diagnose:
        diagnosis = kept.diagnosis
        remarks["diagnosis"] = f"The diagnosis is {kept.diagnosis.origin}."
        console.note(f"the diagnosis is {kept.diagnosis.origin}; --diagnose makes it anew")
    elif diagnose is False:
        remarks["diagnosis"] = "No diagnosis was made: it was left out on request."
    elif refused:
        remarks["diagnosis"] = f"No diagnosis was made: {why}."
    else:
        diagnosis = _diagnose(response, subject, unit, remarks, kept, console)
    from analysis.report import write_report

    judgement = None
    if limits is not None:
        from analysis.acceptance import judge as judged_by

        judgement = judged_by(
            limits,
            features=features_for(limits, [response]),
            estimate=estimate,
            diagnosis=None if diagnosis is None else diagnosis.to_json(),
            doubt=_doubt(remarks, response),
        )
    with _page_for(out) as page:
        write_report(
            page, response, subject, origin, estimate=estimate, diagnosis=diagnosis,
            remarks=remarks, judgement=judgement, certificate=issued,
        )  # fmt: skip
    console.note(f"wrote {out}")
    if judgement is None:
        return 0
    with readers_may_leave():
        console.data("\n".join(judgement_lines(judgement)))
    return judgement.exit_code


@contextmanager
def _page_for(out: Path) -> Iterator[Path]:
    """Where the page is written: the file itself, or one that is printed as PDF then."""
    if not is_pdf(out):
        yield out
        return
    from analysis.report.pdf import print_pdf

    with TemporaryDirectory() as folder:
        page = Path(folder) / "report.html"
        yield page
        print_pdf(page, out)


def _doubt(remarks: Mapping[str, str], response: FrequencyResponse) -> str:
    """Why the response is not to be judged; empty if nothing is known."""
    from analysis.observation.incomplete import state_doubt

    doubts = [remarks["input"]] if "input" in remarks else []
    return "; ".join([*doubts, *filter(None, [state_doubt(response.provenance.get("state"))])])


@dataclass(frozen=True, slots=True)
class _Kept:
    """A measurement as its history holds it, with the answers of today's inference."""

    db: HistoryPlace
    measured: Measurement
    response: FrequencyResponse
    origin: Origin
    estimate: Mapping[str, Any] | None
    diagnosis: StoredDiagnosis | None


def _stored(db: HistoryPlace, number: int, unit: Unit) -> _Kept:
    from analysis.report import stored_origin
    from daq.store import Store
    from tui.measurements.stored_answers import kept_diagnosis, kept_estimate

    with Store(db, read_only=True) as store:
        return _Kept(
            db,
            store.measurement(number),
            store.response(number),
            stored_origin(store, number),
            kept_estimate(store, number, unit),
            kept_diagnosis(store, number, unit),
        )


def _estimate(
    response: FrequencyResponse,
    unit: Unit,
    remarks: dict[str, str],
    kept: _Kept | None,
    console: Console,
) -> dict[str, Any] | None:
    from analysis.observation.input_check import doubted
    from tui.measurements.stored_answers import keep_estimate

    console.note("estimating")
    began_s = time.monotonic()
    try:
        found = console.compute.estimate_response(
            response, unit, cache=cache_folder(), progress=console.progress
        )
        made = doubted(found.to_json(), [remarks["input"]] if "input" in remarks else [])
    except LashbenchError as error:
        remarks["estimate"] = f"No estimate could be made: {error}."
        console.note(remarks["estimate"])
        return None
    if kept is not None:
        with _in_spite_of_faults("estimate", console):
            elapsed_s = time.monotonic() - began_s
            keep_estimate(kept.db, kept.measured, made, unit=unit, elapsed_s=elapsed_s)
    return made


def _diagnose(
    response: FrequencyResponse,
    unit: Unit,
    named: str,
    remarks: dict[str, str],
    kept: _Kept | None,
    console: Console,
) -> Diagnosis | None:
    from tui.measurements.stored_answers import keep_diagnosis

    console.note("diagnosing")
    try:
        made = console.compute.diagnose_response(
            response, unit, cache=cache_folder(), progress=console.progress
        )
    except LashbenchError as error:
        remarks["diagnosis"] = f"No diagnosis could be made: {error}."
        console.note(remarks["diagnosis"])
        return None
    if "input" in remarks:
        made = replace(made, warnings=(remarks["input"], *made.warnings))
    made = proposing(made, named, [response])
    if kept is not None and "input" not in remarks:
        # Of a response that looks like a mistake the history shows no numbers as the unit's.
        with _in_spite_of_faults("diagnosis", console):
            keep_diagnosis(kept.db, kept.measured.id, [response], unit, made.to_json())
    return made


@contextmanager
def _in_spite_of_faults(kind: str, console: Console) -> Iterator[None]:
    """A history that cannot be written keeps nobody from a report."""
    try:
        yield
    except LashbenchError as error:
        console.note(f"the {kind} is reported but not kept: {error}")
