"""Options by which a person says what a response file does not say, wherever one is read.

Owns their names and help, and that what a reader remarked is told. What they mean for a file is
`daq.formats`'.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter

from daq.errors import InputError
from tui.options import Whole, real_number
from tui.text.output import Console

if TYPE_CHECKING:
    from daq.formats.reading import Reading
    from daq.frf import FrequencyResponse

__all__ = [
    "NO_LAYOUT",
    "NO_OPTIONS",
    "LayoutOptions",
    "ReadingOptions",
    "read_file",
    "read_files",
    "tell_remarks",
]

_GROUP = Group("What a file does not say")
_PEAK = {"": 1.0, "vpk": 1.0, "vp": 1.0, "vrms": math.sqrt(2.0), "vpp": 0.5}
_LEVEL = re.compile(r"\s*([^a-zA-Z]+(?:[eE][+-]?[0-9]+)?)\s*([a-zA-Z]*)\s*\Z")


@Parameter(name="*", group=_GROUP, negative=())
@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutOptions:
    """Which part of a file of others holds the response; for a verb with sweep options."""

    function: Annotated[
        str | None,
        Parameter(help="Which function of a universal file: number, name or DOF, as 2:+Z/1:+X."),
    ] = None
    profile: Annotated[
        str | None, Parameter(help="Layout of another program's file: a name or a TOML file.")
    ] = None
    column: Annotated[
        list[str] | None,
        Parameter(help="QUANTITY=COLUMN of another program's file; repeat it for several."),
    ] = None
    as_guessed: Annotated[
        bool, Parameter(help="Take the layout of another program's file as it is guessed.")
    ] = False


@Parameter(name="*", group=_GROUP, negative=())
@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingOptions(LayoutOptions):
    """The options; each is None or empty where it was not given."""

    level: Annotated[
        str | None,
        Parameter(help="Source level in V peak, of a file without; or with unit: 1Vrms, 3Vpp."),
    ] = None
    unit_name: Annotated[
        str | None, Parameter(help="Name of the unit under test, of a file without.")
    ] = None
    sweep: Annotated[
        Literal["up", "down"] | None, Parameter(help="Order of the sweep, of a file without.")
    ] = None
    settle_cycles: Annotated[
        Whole | None, Parameter(help="Drive cycles waited at each point, of a file without.")
    ] = None
    integrate_cycles: Annotated[
        Whole | None, Parameter(help="Drive cycles averaged at each point, of a file without.")
    ] = None
    averages: Annotated[
        Whole | None, Parameter(help="Averages behind a coherence, which become error bars.")
    ] = None

    def reading(self) -> Reading:
        """What a reader is told.

        Raises
        ------
        InputError
            If a value is none that it can have.
        """
        from daq.formats.reading import Reading

        for name, value, least in (
            ("--settle-cycles", self.settle_cycles, 0),
            ("--integrate-cycles", self.integrate_cycles, 1),
            ("--averages", self.averages, 1),
        ):
            if value is not None and value < least:
                raise InputError(f"{name} {value} is not a whole number of {least} or more")
        for name, text in (
            ("--function", self.function),
            ("--profile", self.profile),
            ("--unit-name", self.unit_name),
        ):
            if text is not None and not text.strip():
                raise InputError(f"{name} is empty; give a name, or leave it out")
        return Reading(
            unit_name=self.unit_name,
            level_vpk=None if self.level is None else level_vpk(self.level),
            direction=self.sweep,
            settle_cycles=self.settle_cycles,
            integrate_cycles=self.integrate_cycles,
            averages=self.averages,
            function=self.function,
            profile=own_profile(self.profile),
            columns=named_columns(self.column or ()),
            as_guessed=self.as_guessed,
        )


NO_LAYOUT = LayoutOptions()
NO_OPTIONS = ReadingOptions()
"""A file speaks for itself."""


def level_vpk(text: str) -> float:
    """A source level in V peak, from a number with or without a unit.

    Raises
    ------
    InputError
        If it is no such number, or not above 0.
    """
    found = _LEVEL.match(text)
    factor = _PEAK.get(found[2].lower()) if found else None
    try:
        value = real_number(found[1].strip()) * factor if found and factor else math.nan
    except ValueError:
        value = math.nan
    if not value > 0.0:
        raise InputError(
            f"--level {text!r} is no source level; give volts peak above 0, or as 1Vrms or 3Vpp"
        )
    return value


def named_columns(settings: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Read ``QUANTITY=COLUMN`` settings.

    Raises
    ------
    InputError
        If one has another form, or a quantity comes twice.
    """
    pairs: list[tuple[str, str]] = []
    for setting in settings:
        name, equals, where = (part.strip() for part in setting.partition("="))
        if not name or not equals or not where:
            raise InputError(
                f"--column {setting!r} is not QUANTITY=COLUMN; give for instance gain_db=3 or "
                "'gain_db=Magnitude (dB)'"
            )
        if name in (known for known, _ in pairs):
            raise InputError(f"--column {name} is given twice; give it once")
        pairs.append((name, where))
    return tuple(pairs)


def read_file(path: str | Path, options: ReadingOptions, console: Console) -> FrequencyResponse:
    """Read a response, and tell what its reader left out or took for granted."""
    from daq.formats import read_response

    response = read_response(path, options.reading())
    tell_remarks(path, response, console)
    return response


def tell_remarks(path: str | Path, response: FrequencyResponse, console: Console) -> None:
    """Tell what the reader of a file left out or took for granted."""
    from daq.formats.reading import remarks_of

    name = Path(path).name
    here = response.provenance.get("file", name) == name
    for text in remarks_of(response):
        # What was remarked of a file that this one was made of has been told.
        if here or f"of {name} " in text:
            console.note(f"{path}: {text}")


def own_profile(name: str | None) -> str | None:
    """The path of a profile of the user's own, where there is one of a name; else the name."""
    from tui.places import profiles_folder

    if name is None or "/" in name:
        return name
    path = profiles_folder() / f"{name}.toml"
    return str(path) if path.is_file() else name


def read_files(
    paths: Sequence[Path], options: ReadingOptions, console: Console
) -> list[FrequencyResponse]:
    """Read several responses, all with the same options."""
    return [read_file(path, options, console) for path in paths]
