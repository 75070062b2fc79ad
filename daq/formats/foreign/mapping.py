"""Which column of a table holds what, and how that is known.

Owns the order: what a person tells, then a profile, then what the headers state, then a guess. A
guess is marked, and whoever reads decides whether to take it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from daq.errors import FileFormatError, InputError
from daq.formats.foreign.headers import (
    guessed_by_place,
    meaning_of,
    names_another_unit,
    settled_unit,
)
from daq.formats.foreign.profiles import Profile, matches
from daq.formats.foreign.quantities import QUANTITIES, checked_quantity
from daq.formats.foreign.table import Table

__all__ = ["Assigned", "assigned_columns"]

_KINDS = {
    "frequency": ("frequency_",),
    "phase": ("phase_deg", "phase_rad"),
    "coherence": ("coherence",),
    "source": ("source_",),
    "response": ("gain_db", "gain_real", "gain_imag", "gain_complex", "output_", "input_"),
}


@dataclass(frozen=True, slots=True)
class Assigned:
    """A column that holds a quantity; `how` is told, profile, stated or guessed."""

    quantity: str
    column: int
    how: str


def assigned_columns(
    table: Table, told: Sequence[tuple[str, str]], profile: Profile | None, path: Path
) -> list[Assigned]:
    """What the columns of a table hold, in the order of the columns.

    Raises
    ------
    FileFormatError
        If frequency or response cannot even be guessed, or several columns may be one of them;
        says which there are.
    InputError
        If `told` names no quantity, or a column that is not there.
    """
    found = {
        checked_quantity(name): Assigned(name, _column_of(where, table, path), "told")
        for name, where in told
    }
    if profile is not None:
        said = {_kind(name) for name in found}
        for name, wheres in profile.columns.items():
            several = wheres if isinstance(wheres, tuple) else (wheres,)
            column = _first_of(several, table)
            if column is not None and _kind(name) not in said:
                found[name] = Assigned(name, column, "profile")
        missing = [kind for kind in ("frequency", "response") if not _has(found, kind)]
        if missing:
            raise FileFormatError(
                f"{path}: has no {missing[0]} where the profile says ({profile.title}); "
                f"{_listed(table)}"
            )
    else:
        _by_headers(found, table, path)
    return sorted(found.values(), key=lambda one: one.column)


def _by_headers(found: dict[str, Assigned], table: Table, path: Path) -> None:
    """Add what headers state, and guess what they leave open."""
    taken = {one.column for one in found.values()}
    if not found and not any(table.names):
        if len(table.columns) > 3:
            raise FileFormatError(
                f"{path}: has {len(table.columns)} columns without names; say what they hold: "
                "--column frequency_hz=1 --column gain_db=2 --column phase_deg=3"
            )
        for name, column in guessed_by_place(table.columns).items():
            found[name] = Assigned(name, column, "guessed")
        return
    said = {_kind(name) for name in found}
    for k, header in enumerate(table.names):
        # The names of the quantities themselves.
        name = header.lower()
        if name in QUANTITIES and "_" in name and k not in taken and _kind(name) not in said:
            found[name] = Assigned(name, k, "stated")
            taken.add(k)
    kinds: dict[str, list[int]] = {}
    for k, header in enumerate(table.names):
        if k not in taken:
            kinds.setdefault(meaning_of(header).kind, []).append(k)
    if not _has(found, "frequency"):
        _add(found, table, "frequency", kinds.get("frequency") or [0], path)
    if not _has(found, "response"):
        gains, parts = kinds.get("gain", []), (kinds.get("real", []), kinds.get("imag", []))
        others = [k for k in gains if names_another_unit(table.names[k])]
        gains = [k for k in gains if k not in others] or gains
        complexes = [k for k in gains if table.columns[k].dtype.kind == "c"]
        # Parts tell the phase, too, where no column does.
        alone = len(gains) != 1 or not (kinds.get("phase") or _has(found, "phase"))
        if len(parts[0]) == len(parts[1]) == 1 and alone and not _has(found, "phase"):
            _add(found, table, "real", parts[0], path)
            _add(found, table, "imag", parts[1], path)
            return
        if not gains:
            raise FileFormatError(
                f"{path}: no column is named as a response; say which is: --column "
                f"gain_db=NUMBER or gain=NUMBER; {_listed(table)}"
            )
        _add(found, table, "gain", complexes or gains, path)
    elif any(name in found for name in ("gain_real", "gain_imag", "gain_complex")):
        return
    if not _has(found, "phase") and kinds.get("phase") and "gain_complex" not in found:
        _add(found, table, "phase", kinds["phase"], path)
    if not _has(found, "coherence") and len(kinds.get("coherence", [])) == 1:
        _add(found, table, "coherence", kinds["coherence"], path)


def _add(
    found: dict[str, Assigned], table: Table, kind: str, candidates: Sequence[int], path: Path
) -> None:
    """Assign the one column of a kind, by its header or by guess."""
    if len(candidates) > 1:
        stated = [k for k in candidates if meaning_of(table.names[k]).quantity]
        if kind != "frequency" or len(stated) != 1:
            raise FileFormatError(
                f"{path}: several columns may be the {kind}; say which is, by --column "
                f"QUANTITY=NUMBER; {_listed(table)}"
            )
        candidates = stated
    column = candidates[0]
    name = meaning_of(table.names[column]).quantity
    if kind == "gain" and table.columns[column].dtype.kind == "c":
        name = "gain_complex"
    if name is not None:
        found[name] = Assigned(name, column, "stated")
        return
    guess = settled_unit(kind, table.names[column], table.columns[column])
    if guess is None:
        raise FileFormatError(
            f"{path}: column {column + 1}, {table.names[column][:40]!r}, is in no known unit; say "
            f"what it holds: --column QUANTITY={column + 1}"
        )
    found[guess] = Assigned(guess, column, "guessed")


def _has(found: dict[str, Assigned], kind: str) -> bool:
    return any(_kind(name) == kind for name in found)


def _kind(name: str) -> str:
    for kind, starts in _KINDS.items():
        if name.startswith(starts) or (kind == "response" and name == "gain"):
            return kind
    return name


def _column_of(where: str, table: Table, path: Path) -> int:
    column = _first_of([int(where) if where.isdecimal() and len(where) < 6 else where], table)
    if column is None:
        raise InputError(f"{path}: has no column {where[:40]!r}; {_listed(table)}")
    return column


def _first_of(wheres: Sequence[int | str], table: Table) -> int | None:
    """The column that the first of several names or numbers means that is there alone."""
    for where in wheres:
        if isinstance(where, int):
            if 1 <= where <= len(table.columns):
                return where - 1
            continue
        named = [k for k, header in enumerate(table.names) if matches(where, header)]
        if len(named) == 1:
            return named[0]
    return None


def _listed(table: Table) -> str:
    told = [f"{k}: {name[:30]!r}" for k, name in enumerate(table.names[:12], start=1)]
    rest = len(table.names) - len(told)
    return f"it has {'; '.join(told)}" + (f"; and {rest} more" if rest else "")
