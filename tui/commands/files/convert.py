"""``lashbench convert``: a response from one file format to another, and a look at foreign files.

Owns the options of the verb, what is shown of a file, and the question whether a guess is right.
The formats are `daq.formats`'.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter

from daq.errors import InputError
from tui.places import profiles_folder
from tui.reading_options import NO_OPTIONS, ReadingOptions, tell_remarks
from tui.text.output import Console, Injected
from tui.text.shell_quote import pasted

if TYPE_CHECKING:
    from daq.formats import Reading
    from daq.frf import FrequencyResponse

__all__ = ["convert"]


def convert(
    source: Annotated[Path, Parameter(name="IN")],
    out: Annotated[Path | None, Parameter(name="OUT")] = None,
    /,
    *,
    save_profile: str | None = None,
    given: ReadingOptions = NO_OPTIONS,
    console: Injected,
) -> None:
    """Write a response to a file of another format, or show how a file is read.

    A table of another program is read by its header, by a profile, or as --column says. What
    could only be guessed is shown, and written once you confirm it.

    Parameters
    ----------
    source
        Response in any format that can be read, also of other programs.
    out
        File to write: csv, h5, uff or mat by its suffix. If left out, only what is read is shown.
    save_profile
        Keep the layout of the table as a profile of this name.
    """
    from daq.formats import check_writable, foreign_layout, read_response, write_response
    from daq.formats.foreign.profiles import profile_path
    from daq.formats.foreign.profiles import save_profile as keep

    if save_profile is not None:
        profile_path(save_profile, profiles_folder())
    if out is not None:
        check_writable(out, source)
    reading = given.reading()
    layout = foreign_layout(source, reading)
    if layout is None:
        if save_profile is not None:
            raise InputError(f"{source}: is no table of text, which --save-profile is for")
        response = read_response(source, reading)
    else:
        reading = _confirmed(source, reading, out is None, console)
        response = read_response(source, reading)
    tell_remarks(source, response, console)
    if layout is not None and save_profile is not None:
        kept = keep(layout.as_profile(f"as {source.name}"), save_profile, profiles_folder())
        console.note(f"kept as profile {save_profile}: {kept}")
    if out is None:
        console.data("\n".join(_told(response)))
        return
    write_response(response, out)
    console.note(f"wrote {len(response)} points of {source} to {out}")


def _confirmed(source: Path, reading: Reading, look: bool, console: Console) -> Reading:
    """What is told once a person has seen how a table is read, and confirmed what is guessed."""
    from daq.formats import foreign_layout
    from daq.formats.foreign.text import response_in

    layout = foreign_layout(source, reading)
    assert layout is not None
    doubts = layout.doubts if not reading.as_guessed else ()
    if not doubts and not look:
        return reading
    for line in layout.shown(reading.completed(response_in(layout, reading), source)):
        (console.data if look else console.note)(line)
    if not doubts:
        return reading
    words = ["lashbench", "convert", str(source), "OUT", *layout.as_options.split()]
    if look:
        console.note(f"guessed: {'; '.join(doubts)}; if that is right: {pasted(words)}")
        return replace(reading, as_guessed=True)
    answer = console.ask(f"guessed: {'; '.join(doubts)}. Is that right? [y/N] ")
    if answer is not None and answer.lower() in ("y", "yes"):
        return replace(reading, as_guessed=True)
    return reading


def _told(response: FrequencyResponse) -> list[str]:
    """A response in a few lines."""
    f, levels = response.frequency_hz, response.levels_vpk
    known = [f"{level:g} V peak" for level in levels if np.isfinite(level)]
    phases, errors = response.phase_known, np.isfinite(response.gain_std_db)
    return [
        f"unit {response.unit}, {len(response)} points from {f.min():g} to {f.max():g} Hz",
        f"source level {', '.join(known) if known else 'not known: give --level'}",
        f"phase at {np.count_nonzero(phases)} points, errors at {np.count_nonzero(errors)}",
    ]
