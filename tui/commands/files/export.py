"""``lashbench export``: a stored measurement as a file.

Owns the options of the verb only; the formats are `daq.formats`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from daq.servers.place import files_of
from tui.options import HistoryOption, Whole
from tui.places import history_path
from tui.text.output import Injected

__all__ = ["export"]


def export(
    measurement: Annotated[Whole, Parameter(help="Identifier, as `history` lists it.")],
    /,
    *,
    db: HistoryOption = None,
    out: Path,
    console: Injected,
) -> None:
    """Write a stored measurement to a file, with everything that is known of it.

    Points that were measured again appear as they are now.

    Parameters
    ----------
    db
        The bench's history, a file or postgresql://USER@HOST/DATABASE; yours, if left out.
    out
        File to write: csv, h5, uff or mat by its suffix.
    """
    from daq.formats import check_writable, write_response
    from daq.store import Store

    check_writable(out, *files_of(history_path(db)))
    with Store(history_path(db), read_only=True) as store:
        response = store.response(measurement)
    write_response(response, out)
    console.note(f"wrote {len(response)} points of measurement {measurement} to {out}")
