"""A history as one HTML page: a row for each measurement, linked to its report.

Owns the page, and how a report is recognised by the copy for programs that it holds. It reads
no history.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import quote

from analysis.report.document import FORMAT
from analysis.report.html import Markup, document, element, joined
from analysis.report.style import STYLE
from analysis.resonance.records import with_error
from daq.formats.atomic import write_text

__all__ = ["reports_in", "write_index"]

_MOST_BYTES = 32 << 20
_MOST_FILES = 10_000
_BLOCK = re.compile(r'<script type="application/json" id="lashbench-report">(.*?)</script>', re.S)


def reports_in(
    folder: Path, history: str, begun: Mapping[int, str], origin: Path
) -> dict[int, str]:
    """Reports on measurements of a history, as links from a page in the folder `origin`.

    The newest report on a measurement counts. What is no report is passed over, and one on a
    measurement of another history with the same file name.

    Parameters
    ----------
    begun
        When each measurement was started, by its number.
    """
    found: dict[int, str] = {}
    pages = [path for path in folder.glob("*.htm*") if path.is_file()]
    for path in sorted(pages, key=_made)[-_MOST_FILES:]:
        number = _measurement_of(path, history, begun)
        if number is not None:
            relative = os.path.relpath(path.resolve(), origin.resolve())
            found[number] = quote(Path(relative).as_posix())
    return found


def _made(path: Path) -> float:
    with suppress(OSError):
        return path.stat().st_mtime
    return 0.0


def _measurement_of(path: Path, history: str, begun: Mapping[int, str]) -> int | None:
    """The measurement that a page reports on; None if it is no report, or of another history."""
    try:
        with path.open("rb") as file:
            text = file.read(_MOST_BYTES).decode("utf-8", "replace")
        block = _BLOCK.search(text)
        document = json.loads(block[1]) if block else None
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        return None
    origin, measured = document.get("origin"), document.get("measurement")
    if not isinstance(origin, dict) or not isinstance(measured, dict):
        return None
    number = origin.get("measurement")
    if not isinstance(number, int) or number not in begun:
        return None
    named = origin.get("name") == f"measurement {number} of {history}"
    return number if named and measured.get("started") == begun[number] else None


def write_index(
    path: Path,
    history: str,
    rows: Sequence[Mapping[str, Any]],
    links: Mapping[int, str],
    whole: int,
) -> None:
    """Write the page, newest measurement first.

    Parameters
    ----------
    rows
        As `tui.measurements.history_rows.measurement_row` gives them, oldest first, each with a
        ``judgement`` if it was judged.
    links
        Address of the report by measurement.
    whole
        How many measurements the history has.

    Raises
    ------
    InputError
        If no file can be made at `path`.
    """
    judged = any("judgement" in row for row in rows)
    names = ["id", "started (UTC)", "unit", "serial", "state", *(["verdict"] if judged else []),
             "r", "b1 / deg", "b2 / deg", "report"]  # fmt: skip
    head = element("tr", [element("th", name, scope="col") for name in names])
    lines = [_line(row, links.get(row["id"]), judged) for row in reversed(rows)]
    left = "" if whole == len(rows) else f" The last {len(rows)} of {whole}."
    body = joined(
        element("h1", f"History: {history}"),
        element("p", f"{len(rows)} measurements, newest first.{left}"),
        element("table", element("thead", head), element("tbody", lines)),
    )
    write_text(path, document(f"History: {history}", body, STYLE))


def _line(row: Mapping[str, Any], link: str | None, judged: bool) -> Markup:
    cells: list[str | Markup] = [
        str(row["id"]),
        row["started"][:16].replace("T", " "),
        row["unit"] + (" (SIMULATED)" if row["simulated"] else ""),
        row["serial"] or "-",
        f"{row['state']}, {row['points']}/{row['planned']}",
    ]
    if judged:
        word = (row.get("judgement") or {}).get("verdict", "-")
        cells.append(element("b", word, class_=f"verdict {word.lower()}"))
    for name in ("contribution_ratio", "b1_deg", "b2_deg"):
        number = row[name] or {}
        cells.append(with_error(number.get("value"), number.get("std")))
    cells.append(element("a", "report", href=link) if link else "-")
    return element("tr", [element("td", cell) for cell in cells])
