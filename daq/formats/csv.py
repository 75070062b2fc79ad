"""Frequency responses as CSV: comment lines in TOML, one header, one row per reading.

Owns the reading and writing of that text and nothing else. A file with any
fault is refused whole, with the line of the fault; no row is dropped, sorted,
repaired or filled in.

::

    # unit = "ADSS"
    # sweep = "up"
    # settle_cycles = 20
    # integrate_cycles = 30
    frequency_hz,source_vpk,gain_db,phase_deg,gain_std_db
    100.0,1.5,-13.935,-144.412,0.3279

`phase_deg` and `gain_std_db` may be empty. Comment keys other than those in
`_PROCEDURE` are provenance and come back as they were. Readings that a session
marked as spoilt are not written as rows but listed under `spoilt_points`. A
frequency that comes twice in a level is a slip, unless `repeated_points` is
true: an analyser sets frequencies in steps, and two that were asked for may
fall on one.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from daq.errors import InputError
from daq.formats.atomic import write_text
from daq.formats.csv_checks import check_order, check_values, procedure_of
from daq.formats.csv_columns import EXTRA_KEYS, extra_columns, extra_comments
from daq.formats.csv_text import COLUMNS, Table, parsed, text_of
from daq.formats.reading import NOTHING_TOLD, Reading, without_dc
from daq.formats.toml import toml_key, toml_value
from daq.frf import GAIN_STD_COMPONENTS, GAIN_STD_IS, FrequencyResponse, PointFlag

__all__ = ["COLUMNS", "read", "write"]

_PROCEDURE = (
    "unit",
    "sweep",
    "settle_cycles",
    "integrate_cycles",
    "from_rest",
    "point_flags",
    "repeated_points",
    "spoilt_points",
    *EXTRA_KEYS,
)


def read(path: Path, reading: Reading = NOTHING_TOLD) -> FrequencyResponse:
    """Read a CSV file.

    Returns
    -------
    FrequencyResponse
        Rows in the order of the file, but for those at 0 Hz, which are left out and
        remarked. Its provenance holds the file's own
        comment keys, and ``kind = "measured"`` where the file names no kind.

    Raises
    ------
    FileFormatError
        If the file cannot be read or anything in it is wrong; names file, line
        and value.
    InputError
        If `reading` says something that this format has no use for.
    """
    reading.refuse_unused(path, (), "a CSV of lashbench's own form")
    table = parsed(text_of(path), path)
    procedure = procedure_of(table, reading.unit_name)
    check_values(table)
    check_order(table, procedure["direction"])
    phase = table["phase_deg"]
    known = np.isfinite(phase)
    magnitude = 10.0 ** (table["gain_db"] / 20.0)
    angle = np.radians(np.where(known, phase, 0.0))
    provenance = {k: v for k, v in table.comments.items() if k not in _PROCEDURE}
    if "spoilt_points" in table.comments:
        provenance["spoilt_points"] = table.comments["spoilt_points"]
    if _is_plain(table):
        provenance[GAIN_STD_COMPONENTS] = 2
    response = FrequencyResponse.from_arrays(
        table["frequency_hz"],
        table["source_vpk"],
        magnitude * np.exp(1j * angle),
        phase_known=known,
        gain_std_db=table["gain_std_db"],
        **extra_columns(table.comments, len(table.lines), path),
        provenance={"kind": "measured"} | provenance,
        **procedure,
    )
    return without_dc(response, path)


def write(response: FrequencyResponse, path: Path) -> None:
    """Write a CSV file, whole or not at all, with every digit of frequency, gain and phase.

    Raises
    ------
    InputError
        If a reading that is not marked as spoilt has no value, the rows are in
        an order that `read` refuses, the provenance holds something that TOML
        cannot say, or no file can be made at `path`.
    """
    spoilt = (response.flags & PointFlag.SPOILT) != 0
    kept = response.take(~spoilt)
    if len(kept) == 0:
        raise InputError(f"{path}: there is no usable reading to write; measure first")
    columns = np.column_stack(
        [kept.frequency_hz, kept.source_vpk, kept.gain_db, kept.phase_deg, kept.gain_std_db]
    )
    if np.any(np.isnan(kept.source_vpk)):
        raise InputError(
            f"{path}: the source level is not known, and a CSV must say it; give --level V, or "
            "write .h5, .uff or .mat"
        )
    if np.any(kept.frequency_hz == 0.0):
        raise InputError(f"{path}: a reading at 0 Hz is none of a sweep; take it out")
    for row in np.flatnonzero(~np.all(np.isfinite(columns[:, :3]), axis=1)):
        why = "is zero: nothing moved" if kept.gain[row] == 0 else "is no finite number"
        raise InputError(
            f"{path}: the gain at {kept.frequency_hz[row]:g} Hz and {kept.source_vpk[row]:g} V "
            f"{why}; drive it harder or mark the reading as spoilt"
        )
    comments = _comments(kept, response.take(spoilt))
    try:
        lines = [f"# {toml_key(key)} = {toml_value(value)}" for key, value in comments.items()]
    except TypeError as error:
        raise InputError(f"{path}: the provenance cannot be written ({error})") from error
    lines.append(",".join(COLUMNS))
    table = Table(path, comments, len(lines) + 1 + np.arange(len(kept)), columns)
    # What would be refused when it is read is not written.
    check_values(table)
    check_order(table, kept.direction)
    extra_columns(comments, len(kept), path)
    lines += [",".join(_cell(value) for value in row) for row in columns.tolist()]
    write_text(path, "\n".join(lines) + "\n")


def _is_plain(table: Table) -> bool:
    """Whether a file has the keys of this format alone, its cycles, and errors.

    By the format its errors are those of the mean over these cycles. A file that names a `kind`
    came through a program, and one that knows no cycles cannot have counted any.
    """
    stated = {"settle_cycles", "integrate_cycles"} <= table.comments.keys()
    words = {"kind", GAIN_STD_COMPONENTS, GAIN_STD_IS} & table.comments.keys()
    return stated and not words and bool(np.any(table["gain_std_db"] > 0.0))


def _cell(value: float) -> str:
    return repr(value) if np.isfinite(value) else ""


def _comments(kept: FrequencyResponse, spoilt: FrequencyResponse) -> dict[str, Any]:
    """Comment keys in the order in which they are written."""
    comments: dict[str, Any] = {
        "unit": kept.unit,
        "sweep": kept.direction,
        "settle_cycles": kept.settle_cycles,
        "integrate_cycles": kept.integrate_cycles,
        "from_rest": kept.from_rest,
    }
    if np.any(kept.flags):
        comments["point_flags"] = kept.flags
    if len(set(zip(kept.source_vpk, kept.frequency_hz, strict=True))) < len(kept):
        comments["repeated_points"] = True
    comments |= extra_comments(kept)
    comments |= {k: v for k, v in kept.provenance.items() if k not in _PROCEDURE}
    listed = list(kept.provenance.get("spoilt_points", []))
    listed += np.column_stack([spoilt.frequency_hz, spoilt.source_vpk]).tolist()
    if listed:
        comments["spoilt_points"] = listed
    return {key: value for key, value in comments.items() if value is not None}
