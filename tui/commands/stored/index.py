"""``lashbench index``: a history as one HTML page that links its reports.

Owns the options of the verb and which reports belong to which measurement. The page is the
analysis's. Nothing is measured, estimated or changed.
"""

from __future__ import annotations

from pathlib import Path

from daq.errors import InputError
from daq.servers.place import files_of
from tui.judging import limits_to_judge_by
from tui.options import HistoryOption, JudgeBy, Whole
from tui.places import history_path
from tui.text.output import Injected

__all__ = ["index"]

_SHOWN = 1000


def index(
    *,
    out: Path,
    db: HistoryOption = None,
    reports: Path | None = None,
    last: Whole = _SHOWN,
    judge: JudgeBy = None,
    console: Injected,
) -> None:
    """Write a read-only HTML page that lists a history and links its reports.

    Parameters
    ----------
    out
        HTML file to write.
    db
        The bench's history, a file or postgresql://USER@HOST/DATABASE; yours, if left out.
    reports
        Folder with reports on its measurements, that of the page if left out.
    last
        How many measurements to list, the newest.
    """
    from analysis.report.history_index import reports_in, write_index
    from daq.formats.atomic import checked_target
    from daq.store import Store
    from tui.measurements.history_rows import measurement_row
    from tui.measurements.judging import judge_line

    if out.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{out}: the page is HTML; give a name that ends in .html")
    if last < 1:
        raise InputError(f"--last {last}: give 1 or more")
    history = history_path(db)
    target = checked_target(out, *files_of(history), *([judge] if judge else []))
    folder = target.parent if reports is None else reports
    if not folder.is_dir():
        raise InputError(f"--reports {folder}: there is no such directory")
    limits = limits_to_judge_by(judge)
    with Store(history, read_only=True) as store:
        rows = []
        for line in store.lines(last=last):
            row = measurement_row(line)
            if limits is not None:
                row["judgement"] = judge_line(store, line, limits).to_json()
            rows.append(row)
        whole, name = store.count(), store.name
    begun = {row["id"]: row["started"] for row in rows}
    links = reports_in(folder, name, begun, target.parent)
    write_index(out, name, rows, links, whole)
    console.note(f"wrote {out}: {len(rows)} measurements, {len(links)} with a report")
