"""``lashbench convert``: a response from one file format to another.

Owns the options of the verb only; the formats are `daq.formats`.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from daq.errors import InputError
from tui.output import Injected
from tui.reading_options import NO_OPTIONS, ReadingOptions, read_file

__all__ = ["convert"]


def convert(
    source: Annotated[Path, Parameter(name="IN")],
    out: Annotated[Path, Parameter(name="OUT")],
    /,
    *,
    given: ReadingOptions = NO_OPTIONS,
    console: Injected,
) -> None:
    """Write a response to a file of another format, with everything that is known of it.

    Parameters
    ----------
    source
        Response in any format that can be read, also of other programs.
    out
        File to write: csv, h5, uff or mat by its suffix.
    """
    from daq.formats import check_writable, write_response

    check_writable(out)
    if os.path.exists(out) and os.path.exists(source) and os.path.samefile(source, out):
        raise InputError(f"{out}: is the file that is read; give another name")
    response = read_file(source, given, console)
    write_response(response, out)
    console.note(f"wrote {len(response)} points of {source} to {out}")
