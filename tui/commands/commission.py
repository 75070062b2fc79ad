"""``lashbench commission``: identify a drive's parameters while it is known to be good.

Owns the options of the verb and that no file is overwritten. The identification and the text of
the unit file are the analysis's.
"""

from __future__ import annotations

from pathlib import Path

from tui.executors import executor_at
from tui.options import Cluster, Json, Tolerance, UnitName
from tui.reading_options import NO_OPTIONS, ReadingOptions, read_files
from tui.text.output import Injected
from tui.unit_under_test import read_unit, unit_title

__all__ = ["commission"]


def commission(
    file: Path,
    /,
    *further: Path,
    unit: UnitName,
    out: Path,
    name: str | None = None,
    total_backlash_unknown: bool = False,
    as_is: bool = False,
    tolerance: Tolerance = None,
    cluster: Cluster = None,
    given: ReadingOptions = NO_OPTIONS,
    json: Json = False,
    console: Injected,
) -> None:
    """Learn this drive's parameters from sweeps of it in good order, and write its unit file.

    Later measurements are judged against that file: what has changed since.

    Parameters
    ----------
    file
        Response as csv, h5, uff, mat or the analyser's own sdf.
    further
        Other sweeps of the same drive.
    out
        Unit file to write; one that exists is left alone.
    name
        Name of the unit in that file; that of the file if left out.
    total_backlash_unknown
        Identify the total backlash too, instead of taking the unit's.
    as_is
        Take a response as it stands, also if it looks like a mistake.
    """
    from datetime import date

    from daq.formats.atomic import new_target, write_text

    new_target(out)
    title = unit_title(out, name)
    from analysis.commissioning import commission_drive, commissioned_unit_text
    from analysis.observation.input_check import check_inputs
    from daq.configs import config_path

    subject = read_unit(unit, console, tolerance)
    responses = read_files([file, *further], given, console)
    for text in check_inputs(responses, subject, as_is):
        console.note(f"warning: {text}")
    with executor_at(cluster, console.compute) as executor:
        found = commission_drive(
            responses, subject, total_backlash_unknown=total_backlash_unknown,
            executor=executor, progress=console.progress,
        )  # fmt: skip
    datasheet = config_path("units", unit).read_text(encoding="utf-8")
    write_text(out, commissioned_unit_text(datasheet, found, title, date.today()))
    for text in found.warnings:
        console.note(f"warning: {text}")
    if json:
        console.document(found.to_json())
    else:
        console.data("\n".join(found.summary()))
    console.note(f"wrote {out}")
