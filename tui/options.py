"""Options that several verbs share, and the strict reading of their values.

Owns how text on a command line becomes a number, a setting or a folder to fill. It
loads no unit, reads no file and decides nothing about physical limits.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import Annotated

from cyclopts import Parameter, Token

from daq.errors import InputError
from daq.servers.place import HistoryPlace, parse_place

__all__ = [
    "Cluster",
    "HistoryOption",
    "Json",
    "JudgeBy",
    "Plots",
    "Real",
    "Tolerance",
    "UnitName",
    "Whole",
    "directory_to_fill",
    "parameter_settings",
    "prepare_directory",
    "tolerance_shares",
]

_WHOLE = re.compile(r"[+-]?[0-9]+\Z")
_DIGITS = 15
"""Of a count: no bench has more of anything, and a history could not look it up."""


def _whole(_type: object, tokens: Sequence[Token]) -> int:
    # The framework would round 1.5 to 2 and read 0x10; a count is meant as it is typed.
    text = tokens[0].value
    if not _WHOLE.match(text):
        raise ValueError(f"{text!r} is not a whole number")
    if len(text) > _DIGITS:
        raise ValueError(f"{text!r} is too large a number")
    return int(text)


def _real(_type: object, tokens: Sequence[Token]) -> float:
    return real_number(tokens[0].value)


def real_number(text: str) -> float:
    """A finite decimal number.

    Raises
    ------
    ValueError
        If the text is anything else; "nan", "inf" and "1_000" are.
    """
    try:
        value = float(text) if text.isascii() and "_" not in text else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{text!r} is not a finite number")
    return value


Whole = Annotated[int, Parameter(converter=_whole, n_tokens=1)]
"""A count, as digits."""

Real = Annotated[float, Parameter(converter=_real, n_tokens=1)]
"""A finite number."""


def _place(_type: object, tokens: Sequence[Token]) -> HistoryPlace:
    try:
        return parse_place(tokens[0].value)
    except InputError as error:
        raise ValueError(str(error)) from error


HistoryOption = Annotated[HistoryPlace | None, Parameter(name="--db", converter=_place, n_tokens=1)]
"""The history: a file, or a database on a server."""

UnitName = Annotated[str, Parameter(name="--unit", help="adss, edss or the path of a unit file.")]
"""The unit under test."""

Json = Annotated[bool, Parameter(name="--json", help="Print one JSON document on stdout.")]
"""Whether the result is for a program."""

Cluster = Annotated[
    str | None,
    Parameter(name="--cluster", help="Address of a Dask scheduler whose workers simulate."),
]
"""Where ensembles are simulated, in place of this machine."""

Tolerance = Annotated[
    list[str] | None,
    Parameter(
        name="--tolerance",
        negative=(),
        help="Of the datasheet, one standard deviation as a share or per cent: 0.05 or 5% of all "
        "values, R_m=8% of one; repeat it for several. In place of what the unit file says.",
    ),
]
"""What is believed of the datasheet, see `tolerance_shares`."""

JudgeBy = Annotated[
    str | None,
    Parameter(
        name="--judge",
        help="Decide PASS, FAIL or UNDECIDED by a file with an [acceptance] table: a file of "
        "limits or a unit file. Exit code 0, 6 or 7.",
    ),
]
"""Limits by which a unit is accepted, see `analysis.acceptance`."""

Plots = Annotated[Path | None, Parameter(name="--plots", help="Directory for figures (PNG).")]
"""Where figures go, made if it is not there."""


def parameter_settings(settings: Sequence[str]) -> dict[str, float]:
    """Read ``SYMBOL=VALUE`` settings of a unit's parameters.

    Raises
    ------
    InputError
        If one has another form, or a symbol comes twice.
    """
    values: dict[str, float] = {}
    for setting in settings:
        symbol, equals, number = (part.strip() for part in setting.partition("="))
        if not symbol or not equals:
            raise InputError(f"--set {setting!r} is not PARAM=VALUE; give for instance J_L=0.003")
        if symbol in values:
            raise InputError(f"--set {symbol} is given twice; give it once")
        try:
            values[symbol] = real_number(number)
        except ValueError as error:
            raise InputError(f"--set {symbol}: {error}") from error
    return values


def tolerance_shares(settings: Sequence[str] | None) -> dict[str, float]:
    """Read ``SHARE`` and ``NAME=SHARE``; what stands alone is that of ``default``.

    Raises
    ------
    InputError
        If one is no share, or a name comes twice.
    """
    shares: dict[str, float] = {}
    for setting in settings or ():
        name, equals, text = (part.strip() for part in setting.partition("="))
        if not equals:
            name, text = "default", name
        number, per_cent = text.removesuffix("%").strip(), text.endswith("%")
        try:
            share = real_number(number) / (100.0 if per_cent else 1.0)
        except ValueError:
            raise InputError(
                f"--tolerance {setting!r} is not SHARE or NAME=SHARE; give for instance 0.05, 5% "
                "or R_m=8%"
            ) from None
        if name in shares:
            of = "for all values" if name == "default" else f"for {name}"
            raise InputError(f"--tolerance is given twice {of}; give it once")
        shares[name] = share
    return shares


@contextmanager
def directory_to_fill(path: Path | None) -> Iterator[None]:
    """Make a directory for the results of the block; what was made and stays empty is removed.

    Raises
    ------
    InputError
        As `prepare_directory`.
    """
    if path is None:
        yield
        return
    made = [one for one in (path, *path.parents) if not one.exists()]
    try:
        prepare_directory(path)
        yield
    finally:
        with suppress(OSError):
            for one in made:
                one.rmdir()


def prepare_directory(path: Path) -> Path:
    """Make a directory for results, before the work that fills it.

    Raises
    ------
    InputError
        If there is a file of that name, or it cannot be made or filled.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        # Whether it may be filled shows only where something is put there.
        with TemporaryFile(dir=path):
            pass
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be used as a directory ({reason})") from error
    return path
