"""What a reader is told that a file does not say: unit, level, procedure, which function, columns.

Owns those options, the check that each means something for the file at hand, and how they are
filled in. What a file states itself is never overwritten by another value, but for the name of
the unit, of which that is said.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from daq.errors import FileFormatError, InputError
from daq.formats.believable import disbelief
from daq.frf import FrequencyResponse
from daq.plan import Direction

__all__ = ["NOTHING_TOLD", "REMARKS", "Reading", "remarked", "remarks_of", "without_dc"]

REMARKS = "reading_remarks"
"""Provenance key: what a reader left out or took for granted, one sentence each."""

_UNNAMED = ("", "unknown")
_OPTIONS = {
    "function": "--function",
    "averages": "--averages",
    "profile": "--profile",
    "columns": "--column",
    "as_guessed": "--as-guessed",
}
"""Options that only some formats have a use for, as the command line calls them."""


@dataclass(frozen=True, slots=True)
class Reading:
    """What a file does not say; None or empty where nothing is to be added.

    Parameters
    ----------
    unit_name
        Name of the unit under test.
    level_vpk
        Source level, V peak, of a file that states none.
    direction, settle_cycles, integrate_cycles
        The procedure, of a file that states none.
    averages
        Averages behind a coherence; with them it becomes error bars.
    function
        Which function of a file that holds several: number, name or degrees of freedom.
    profile
        How a text of another program is laid out: a name of `configs/profiles`, or a path.
    columns
        Pairs (quantity, column) that say which column of a foreign file holds what, see
        `daq.formats.foreign.quantities`; they come before what profile and header say.
    as_guessed
        Take the layout of a text as it is guessed where neither header nor profile says it.
    """

    unit_name: str | None = None
    level_vpk: float | None = None
    direction: Direction | None = None
    settle_cycles: int | None = None
    integrate_cycles: int | None = None
    averages: int | None = None
    function: str | None = None
    profile: str | None = None
    columns: tuple[tuple[str, str], ...] = ()
    as_guessed: bool = False

    def to_json(self) -> str:
        """All of it as one line, for a process that reads the file."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Reading:
        """The same again."""
        held = json.loads(text)
        return cls(**held | {"columns": tuple((name, where) for name, where in held["columns"])})

    def refuse_unused(self, path: Path, used: Iterable[str], why: str) -> None:
        """Refuse options that mean nothing for a file.

        Parameters
        ----------
        used
            Fields that the file's format has a use for, of those that only some have.
        why
            What the file is, such as ``"a file that lashbench wrote"``.

        Raises
        ------
        InputError
            Names the first such option.
        """
        for name, option in _OPTIONS.items():
            if name not in used and getattr(self, name):
                raise InputError(f"{path}: is {why}, which {option} says nothing of; leave it out")

    def completed(self, response: FrequencyResponse, path: Path) -> FrequencyResponse:
        """A response with unit, level and procedure filled in where they are unknown.

        Raises
        ------
        InputError
            If the file states another value.
        """
        added: dict[str, Any] = {}
        for name in ("direction", "settle_cycles", "integrate_cycles"):
            told, stated = getattr(self, name), getattr(response, name)
            if told is None or told == stated:
                continue
            if stated is not None:
                option = "--sweep" if name == "direction" else f"--{name.replace('_', '-')}"
                raise InputError(
                    f"{path}: states {name} {stated}, and {option} says {told}; leave {option} out"
                )
            added[name] = told
        if self.level_vpk is not None:
            added["source_vpk"] = self._levels(response, path)
        if self.unit_name:
            added["unit"] = self.unit_name
            if response.unit not in (*_UNNAMED, self.unit_name):
                response = remarked(
                    response, f"the unit is {self.unit_name!r} as told, not {response.unit!r}"
                )
        return replace(response, **added) if added else response

    def _levels(self, response: FrequencyResponse, path: Path) -> Any:
        told, stated = self.level_vpk, response.source_vpk
        if told is None or not math.isfinite(told) or told <= 0:
            raise InputError(f"--level {told!r} is no source level; give it in V peak, above 0")
        found = disbelief("source_vpk", [told])
        if found is not None:
            raise InputError(f"--level: {found[1]}")
        other = stated[np.isfinite(stated) & ~np.isclose(stated, told, rtol=1e-6, atol=0.0)]
        if other.size:
            raise InputError(
                f"{path}: states a source level of {other[0]:g} V peak, and --level says {told:g}; "
                "leave --level out"
            )
        return np.where(np.isnan(stated), told, stated)


NOTHING_TOLD = Reading()
"""A file speaks for itself."""


def remarked(response: FrequencyResponse, *remarks: str) -> FrequencyResponse:
    """A response whose provenance holds further remarks of its reader."""
    told = [*remarks_of(response), *remarks]
    return replace(response, provenance={**response.provenance, REMARKS: told})


def remarks_of(response: FrequencyResponse) -> list[str]:
    """What readers remarked on a response; empty where nothing was, or it is no list of text."""
    held: Any = response.provenance.get(REMARKS, [])
    return [str(text) for text in held] if isinstance(held, list | tuple) else []


def without_dc(response: FrequencyResponse, path: Path) -> FrequencyResponse:
    """A response without its rows at 0 Hz, which no swept sine has; says how many there were.

    Raises
    ------
    FileFormatError
        If nothing else is in it.
    """
    dc = response.frequency_hz == 0.0
    if not np.any(dc):
        return response
    if np.all(dc):
        raise FileFormatError(f"{path}: holds nothing but 0 Hz; give a response over frequency")
    count = int(np.count_nonzero(dc))
    rows = "the row" if count == 1 else f"{count} rows"
    return remarked(response.take(~dc), f"{rows} at 0 Hz of {path.name} left out")
