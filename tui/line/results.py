"""The results of a line: one line of JSON a unit, appended and flushed to the disk.

Owns the file, what a result holds and the same as CSV. It judges nothing. A line that is there
was judged; one that is not there will be.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from analysis.acceptance.decision import reasons
from daq.errors import FileFormatError
from daq.formats.atomic import append_line, checked_target, write_text
from daq.servers.place import HistoryPlace, whole_name

__all__ = ["Result", "Results", "Word"]

Word = Literal["PASS", "FAIL", "UNDECIDED", "MEASURED"]
_LONGEST_LINE = 1 << 20
_BEGIN = b'{"serial":'
"""What every line begins with."""
_COLUMNS = (
    "serial", "attempt", "verdict", "unit", "measurement", "started", "ended", "operator",
    "failed", "undecided", "reasons", "limits", "elapsed_s",
)  # fmt: skip


class Result(BaseModel):
    """One judged unit."""

    model_config = ConfigDict(extra="allow", frozen=True)

    serial: Annotated[str, Field(min_length=1, max_length=1000)]
    attempt: Annotated[int, Field(ge=1)]
    """1 for the first measurement of this serial number, 2 and more for a retest."""
    verdict: Word
    """MEASURED where no limits were given."""
    unit: str
    measurement: int
    history: str
    started: str
    ended: str | None
    operator: str = ""
    failed: list[str] = []
    undecided: list[str] = []
    reasons: list[str] = []
    limits: str | None = None
    elapsed_s: float = 0.0
    judgement: dict[str, Any] | None = None

    @property
    def label(self) -> str:
        """The line that is printed for the unit."""
        again = f"  retest {self.attempt - 1}" if self.attempt > 1 else ""
        why = reasons(self.failed, self.undecided) or next(iter(self.reasons), "")
        number = f"measurement {self.measurement}"
        label = f"{self.verdict:9}  {self.serial}  {self.unit}  {number}{again}"
        return f"{label}  {why}" if why else label


class Results:
    """The results in a file.

    Parameters
    ----------
    path
        JSON Lines; made with the first result.
    table
        CSV file with the same results, written anew by `write_table`; none if left out.
    reads
        What the line reads or writes otherwise, as files or names: neither file may be one of it.

    Raises
    ------
    FileFormatError
        If the file holds anything else.
    InputError
        If no file can be made there.
    """

    def __init__(
        self, path: Path, table: Path | None = None, reads: Sequence[str | Path] = ()
    ) -> None:
        self.path = path
        self._table = table
        checked_target(path, *reads)
        if table is not None:
            checked_target(table, path, *reads)
        self.all: list[Result] = list(_read(path)) if path.exists() else []

    def add(self, result: Result) -> None:
        """Append a result; it is on the disk when this returns."""
        append_line(self.path, result.model_dump_json())
        self.all.append(result)

    def write_table(self) -> None:
        """Write the table, if there is one.

        Raises
        ------
        LashbenchError
            If it cannot be written; the results are kept.
        """
        if self._table is not None:
            write_text(self._table, self.csv())

    def of(self, serial: str) -> list[Result]:
        """The results of one serial number, first to last."""
        return [one for one in self.all if one.serial == serial]

    def of_measurement(self, history: HistoryPlace, measurement: int) -> Result | None:
        """The result of a stored measurement."""
        name = whole_name(history)
        for one in reversed(self.all):
            if (one.history, one.measurement) == (name, measurement):
                return one
        return None

    def csv(self) -> str:
        """All results as CSV with a header."""
        stream = io.StringIO()
        writer = csv.writer(stream)
        writer.writerow(_COLUMNS)
        for one in self.all:
            values = one.model_dump()
            writer.writerow([_cell(values[name]) for name in _COLUMNS])
        return stream.getvalue()


def _cell(value: Any) -> str:
    text = "; ".join(map(str, value)) if isinstance(value, list) else str(value or "")
    # A spreadsheet would take it for a formula.
    return f"'{text}" if text.startswith(("=", "@", "+", "\t")) else text


def _read(path: Path) -> Iterator[Result]:
    """Every whole line; what a cut left of the last one is no result."""
    with path.open("rb") as file:
        number = 0
        while line := file.readline(_LONGEST_LINE + 1):
            number += 1
            if len(line) > _LONGEST_LINE:
                raise FileFormatError(f"{path}: line {number} is too long to be a result")
            if not line.endswith(b"\n"):
                if not (line.startswith(_BEGIN) or _BEGIN.startswith(line)):
                    raise _no_result(path, number, "it has no end of line")
                return
            try:
                document: Mapping[str, Any] = json.loads(line)
                yield Result.model_validate(document)
            except (ValueError, RecursionError) as error:
                raise _no_result(path, number, _first(error)) from error


def _first(error: Exception) -> str:
    if isinstance(error, ValidationError):
        fault = error.errors(include_url=False, include_input=False)[0]
        return f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}"
    return str(error)


def _no_result(path: Path, number: int, why: str) -> FileFormatError:
    return FileFormatError(
        f"{path}: line {number} is no result of a line ({why}); give another file with --out"
    )
