"""``lashbench report``: one measurement as an HTML page that needs nothing else.

Owns the options of the verb, and which estimate and diagnosis go into the
page. What stands on it is the analysis's.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from daq.errors import InputError, LashbenchError
from tui.options import UnitName
from tui.output import Console, Injected
from tui.pasted import proposing
from tui.places import cache_folder, history_path

if TYPE_CHECKING:
    from analysis.diagnosis import Diagnosis
    from analysis.report_data import Origin
    from daq.frf import FrequencyResponse
    from sim.unit import Unit

__all__ = ["report"]

_MOST_DIGITS = 18
"""What an identifier in a history can have."""


def report(
    source: Annotated[str, Parameter(name="FILE_OR_ID")],
    /,
    *,
    unit: UnitName,
    out: Path,
    db: Path | None = None,
    diagnose: Annotated[bool, Parameter(negative="--no-diagnose")] = True,
    console: Injected,
) -> None:
    """Write a report on one measurement as a single HTML file that prints on A4.

    It holds the response, the backlash of each stage and what to do about it,
    the diagnosis, where everything came from, and a copy for programs.

    Parameters
    ----------
    source
        Response as csv, h5, uff, mat or the analyser's own sdf, or the
        identifier of a measurement as `history` lists it.
    out
        HTML file to write.
    db
        File of the bench's history that the identifier is looked up in; yours, if left out.
    diagnose
        Diagnose too, which takes a minute or two; --no-diagnose leaves it out.
    """
    from analysis.swept import unit_doubts
    from daq.formats.atomic import checked_target
    from sim.unit import load_unit

    if out.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{out}: a report is HTML; give a name that ends in .html")
    checked_target(out)
    subject = load_unit(unit)
    remarks: dict[str, str] = {}
    if not _is_identifier(source, db):
        from analysis.report import file_origin
        from daq.formats import read_response

        response, estimate = read_response(source), None
        origin = file_origin(Path(source))
    else:
        response, origin, estimate = _stored(history_path(db), source, subject)
    for doubt in unit_doubts([response], subject):
        console.note(f"warning: {doubt}")
    if estimate is None:
        estimate = _estimate(response, subject, remarks, console)
    diagnosis = _diagnose(response, subject, remarks, console) if diagnose else None
    if diagnosis is not None:
        diagnosis = proposing(diagnosis, unit, [response])
    if not diagnose:
        remarks["diagnosis"] = "No diagnosis was made: it was left out on request."
    from analysis.report import write_report

    write_report(
        out, response, subject, origin, estimate=estimate, diagnosis=diagnosis, remarks=remarks
    )
    console.note(f"wrote {out}")


def _is_identifier(source: str, db: Path | None) -> bool:
    """Digits are an identifier, unless no history is named and there is such a file."""
    if not (source.isascii() and source.isdecimal() and len(source) <= _MOST_DIGITS):
        return False
    return db is not None or not Path(source).is_file()


def _stored(
    db: Path, identifier: str, unit: Unit
) -> tuple[FrequencyResponse, Origin, Mapping[str, Any] | None]:
    """A measurement, its origin, and the estimate that the history holds of it."""
    from analysis.report import stored_origin
    from daq.store import Store
    from tui.reports import kept_estimate

    number = int(identifier)
    with Store(db, read_only=True) as store:
        return (
            store.response(number),
            stored_origin(store, number),
            kept_estimate(store, number, unit),
        )


def _estimate(
    response: FrequencyResponse, unit: Unit, remarks: dict[str, str], console: Console
) -> dict[str, Any] | None:
    from analysis.estimate import estimate_response

    console.note("estimating")
    try:
        return estimate_response(
            response, unit, cache=cache_folder(), progress=console.progress
        ).to_json()
    except LashbenchError as error:
        remarks["estimate"] = f"No estimate could be made: {error}."
        console.note(remarks["estimate"])
        return None


def _diagnose(
    response: FrequencyResponse, unit: Unit, remarks: dict[str, str], console: Console
) -> Diagnosis | None:
    from analysis.diagnosis import diagnose_response

    console.note("diagnosing")
    try:
        return diagnose_response(response, unit, cache=cache_folder(), progress=console.progress)
    except LashbenchError as error:
        remarks["diagnosis"] = f"No diagnosis could be made: {error}."
        console.note(remarks["diagnosis"])
        return None
