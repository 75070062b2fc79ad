"""Responses in text files of other programs: tables of any kind, by header, profile or option.

Owns the way from such a file to a response, and what is shown of it before it is believed. What
neither header, profile nor option says is not taken unless a person confirms the guess.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from daq.errors import FileFormatError
from daq.formats.foreign.columns import Columns
from daq.formats.foreign.decoding import text_in
from daq.formats.foreign.hp_ascii import is_hp_ascii, table_of_hp_ascii
from daq.formats.foreign.mapping import Assigned, assigned_columns
from daq.formats.foreign.profiles import Profile, load_profile, profiles_like
from daq.formats.foreign.quantities import response_of
from daq.formats.foreign.table import Table, table_in
from daq.formats.reading import NOTHING_TOLD, Reading, remarked
from daq.frf import FrequencyResponse

__all__ = ["Layout", "layout_of", "read", "response_in"]

_SHOWN_ROWS = 3


@dataclass(frozen=True, slots=True)
class Layout:
    """How a text is read: its table, what the columns hold, and by which profile."""

    path: Path
    encoding: str
    table: Table
    assigned: tuple[Assigned, ...]
    profile: Profile | None
    profile_name: str

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is guessed; empty where everything is said by somebody."""
        guesses = [
            f"{self._called(one.column)} as {one.quantity}"
            for one in self.assigned
            if one.how == "guessed"
        ]
        return (*guesses, *([self.table.doubt] if self.table.doubt else []))

    @property
    def as_options(self) -> str:
        """The options that say the same, to be pasted."""
        return " ".join(f"--column {one.quantity}={one.column + 1}" for one in self.assigned)

    def as_profile(self, title: str) -> Profile:
        """The same as a profile: columns by their names where these tell them apart."""
        names = self.table.names
        columns: dict[str, int | str | tuple[int | str, ...]] = {
            one.quantity: name
            if (name := names[one.column]) and names.count(name) == 1 and "*" not in name
            else one.column + 1
            for one in self.assigned
        }
        return Profile(
            title=title,
            separator=self.table.separator,
            decimal=self.table.decimal,
            columns=columns,
        )

    def in_words(self) -> str:
        """Which column is read as what, in one line."""
        told = ", ".join(f"{self._called(one.column)} as {one.quantity}" for one in self.assigned)
        used = {one.column for one in self.assigned}
        rest = [self._called(k) for k in range(len(self.table.columns)) if k not in used]
        way = f" by the profile {self.profile_name}" if self.profile_name else ""
        return f"read{way}: {told}" + (f"; not used: {', '.join(rest)}" if rest else "")

    def shown(self, response: FrequencyResponse) -> list[str]:
        """The preview: form, columns, and the first rows as they are understood."""
        table = self.table
        marks = f"separated by {table.separator}, decimal {table.decimal}, {self.encoding}"
        lines = [
            f"{self.path}: {len(table.lines)} rows from line {table.lines[0]} on, {marks}",
            *([f"profile {self.profile_name}: {self.profile.title}"] if self.profile else []),
        ]
        by_column = {one.column: one for one in self.assigned}
        for k, values in enumerate(table.columns):
            one = by_column.get(k)
            what = f"{one.quantity} ({one.how})" if one else "not used"
            real = np.abs(values) if values.dtype.kind == "c" else values
            span = "empty" if np.all(np.isnan(real)) else (
                f"{np.nanmin(real):.4g} to {np.nanmax(real):.4g}"
            )  # fmt: skip
            lines.append(f"  {k + 1:2d} {table.names[k][:26]:26s} {span:20s} {what}")
        lines.append("the first rows, as they are understood: Hz, V peak, dB, degrees")
        for row in range(min(_SHOWN_ROWS, len(response))):
            numbers = (
                response.frequency_hz[row], response.source_vpk[row],
                response.gain_db[row], response.phase_deg[row],
            )  # fmt: skip
            words = ("-" if np.isnan(value) else f"{value:.6g}" for value in numbers)
            lines.append("  " + "  ".join(f"{word:>12s}" for word in words))
        return lines

    def _called(self, column: int) -> str:
        name = self.table.names[column]
        return f"column {column + 1}" + (f" {name[:40]!r}" if name else "")


def layout_of(path: Path, reading: Reading = NOTHING_TOLD) -> Layout:
    """How a text is laid out, guesses included.

    Raises
    ------
    FileFormatError
        If it is no text, holds no whole table, or nothing tells its columns apart.
    """
    reading.refuse_unused(path, ("averages", "profile", "columns", "as_guessed"), "a table of text")
    text, encoding = text_in(path)
    name = reading.profile or ""
    profile = load_profile(name) if name else None
    if is_hp_ascii(path):
        table = table_of_hp_ascii(text, path)
    else:
        form = (profile.separator, profile.decimal) if profile is not None else (None, None)
        table = table_in(text, path, *form)
    if profile is not None and profile.decimal is not None:
        table = replace(table, doubt="")
    if profile is None and not reading.columns:
        name, profile = _profile_of(table, path)
    found = assigned_columns(table, reading.columns, profile, path)
    return Layout(path, encoding, table, tuple(found), profile, name)


def _profile_of(table: Table, path: Path) -> tuple[str, Profile | None]:
    """The one profile whose signs a table bears and whose columns it has."""
    fit = []
    for name in profiles_like(table):
        profile = load_profile(name)
        with suppress(FileFormatError):
            assigned_columns(table, (), profile, path)
            fit.append((name, profile))
    return fit[0] if len(fit) == 1 else ("", None)


def read(path: Path, reading: Reading = NOTHING_TOLD) -> FrequencyResponse:
    """Read a text file of another program.

    Raises
    ------
    FileFormatError
        If it holds no response, any part of it is wrong, or its layout could only be guessed
        and `reading` does not take the guess.
    """
    layout = layout_of(path, reading)
    if layout.doubts and not reading.as_guessed:
        raise FileFormatError(
            f"{path}: would be read by guess ({'; '.join(layout.doubts)}); if that is right, give "
            f"--as-guessed, else say what the columns hold, as in {layout.as_options}"
        )
    return response_in(layout, reading)


def response_in(layout: Layout, reading: Reading) -> FrequencyResponse:
    """The response that a layout says, whether or not it was guessed."""
    table, profile = layout.table, layout.profile
    held = {one.quantity: table.columns[one.column] for one in layout.assigned}
    columns = Columns(
        layout.path, held, lambda row: f"line {table.lines[row]}",
        {"preamble": _kept(table.preamble)} if table.preamble else {},
    )  # fmt: skip
    if profile is not None and "coherence" in held:
        reading = replace(reading, averages=reading.averages or profile.averages)
    response = response_of(columns, reading)
    if profile is not None and profile.level_vpk is not None and reading.level_vpk is None:
        told = replace(NOTHING_TOLD, level_vpk=float(profile.level_vpk))
        response = told.completed(response, layout.path)
    return remarked(response, layout.in_words())


def _kept(preamble: Sequence[str]) -> list[str]:
    """Lines above a table as they are kept with the response: some, and not longer than a page."""
    return [line.strip()[:200] for line in preamble if line.strip()][:40]
