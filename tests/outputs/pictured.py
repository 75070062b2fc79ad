"""What a picture of a screen says, read from its SVG, and the history that the pictures show."""

from __future__ import annotations

import html
import re
import sqlite3
from collections import defaultdict
from contextlib import closing
from pathlib import Path

from analysis.edition import EDITION
from daq.store import Store

PICTURED = Path(__file__).parents[1] / "data" / "pictured.sql"

_TEXT = re.compile(r'<text class="[^"]*-r\d+" x="([\d.]+)" y="([\d.]+)"[^>]*>(.*?)</text>')
_COLUMN = 12.2
"""Width of a character."""


def said_by(svg: str) -> list[str]:
    """Rows of text, from the top, without what is empty on their right."""
    rows: dict[float, dict[int, str]] = defaultdict(dict)
    for x, y, text in _TEXT.findall(svg):
        first = round(float(x) / _COLUMN)
        rows[float(y)] |= dict(enumerate(html.unescape(text).replace("\xa0", " "), first))
    said = []
    for y in sorted(rows):
        row = rows[y]
        said.append("".join(row.get(i, " ") for i in range(max(row) + 1)).rstrip())
    return said


def words_of(rows: list[str]) -> list[str]:
    """Rows that hold words, each number as 0, without what is drawn of characters."""
    plain = (re.sub(r"[^ -~]", " ", row) for row in rows)
    numbered = (" ".join(re.sub(r"[-+]?\d+(\.\d+)?", "0", row).split()) for row in plain)
    return [row for row in numbered if re.search("[A-Za-z]{2}", row)]


def make_history(path: Path) -> None:
    """Make the history that the pictures show, its answers as of today's edition."""
    Store(path, create=True).close()
    with closing(sqlite3.connect(path)) as history:
        history.executescript(PICTURED.read_text(encoding="utf-8"))
        for table in ("estimates", "diagnoses"):
            history.execute(f"UPDATE {table} SET edition = ?", [EDITION])
        history.commit()


def keep_history(path: Path) -> None:
    """Keep what a history holds as that which the pictures show; its layout is the store's."""
    with closing(sqlite3.connect(path)) as history:
        rows = [line for line in history.iterdump() if line.startswith("INSERT")]
    rows = [row for row in rows if '"sqlite_sequence"' not in row]
    text = "\n".join(["PRAGMA foreign_keys = OFF;", "BEGIN;", *rows, "COMMIT;", ""])
    PICTURED.write_text(text, encoding="utf-8")
