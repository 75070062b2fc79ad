"""The unit that ``--unit`` names, as every verb reads it, and how far a bench lets it be driven.

Owns that what is unusual in a unit file is told once, before the work, and which time a plan for a
unit may take. It judges nothing itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from daq.errors import InputError
from tui.options import tolerance_shares

if TYPE_CHECKING:
    from daq.limits import Limits
    from sim.unit import Unit
    from tui.text.output import Console

__all__ = [
    "USUAL_MIN",
    "checked_minutes",
    "ratio_of_unit",
    "read_unit",
    "unit_title",
    "within_bench",
]

USUAL_MIN = 5.0
"""Time at the bench, where none is given."""

_LONGEST_MIN = 24.0 * 60.0
_LONGEST_TITLE = 64


def unit_title(out: Path, name: str | None) -> str:
    """The name of a unit in the file `out`: the one given, else that of the file.

    Raises
    ------
    InputError
        If a unit cannot have that name.
    """
    title = out.stem.upper() if name is None else name
    if not title.strip() or len(title) > _LONGEST_TITLE or not title.isprintable():
        raise InputError(f"unit name {title!r}: give 1 to {_LONGEST_TITLE} characters on one line")
    return title


def ratio_of_unit(unit: Unit, ratio: float | None) -> float:
    """The contribution ratio that a person gave, which a drive with one stage needs not.

    Raises
    ------
    InputError
        If a drive with two stages or three was given none.
    """
    if ratio is None and unit.stages > 1:
        count, shared = "two", "the total backlash"
        if unit.stages == 3:
            count, shared = "three", "the backlash of stages 1 and 2"
        raise InputError(
            f"--ratio is missing: unit {unit.name} has {count} stages; give the share of stage 1 "
            f"in {shared}, 0 to 1"
        )
    return 1.0 if ratio is None else ratio


def read_unit(
    name_or_path: str,
    console: Console,
    tolerance: Sequence[str] | None = None,
    settings: Mapping[str, float] | None = None,
) -> Unit:
    """Read a unit, and tell what is unusual in it.

    Parameters
    ----------
    tolerance
        Texts of ``--tolerance``.
    settings
        Parameters to change, by symbol; what these cannot be is told and not refused.

    Raises
    ------
    ConfigurationError
        If there is no such unit, a value in it is wrong or cannot be, or an effect of its own is
        wrong or not trusted.
    InputError
        If a tolerance is no share.
    """
    from sim.datasheet import find_impossible, find_unusual
    from sim.own_effects.trial import try_own_effects
    from sim.unit import load_unit

    unit = load_unit(name_or_path)
    try_own_effects(unit)
    if settings:
        unit = unit.with_parameters(**settings)
    unit = unit.with_tolerance(tolerance_shares(tolerance))
    for text in find_impossible(unit) or find_unusual(unit):
        console.note(f"warning: unit {unit.name}: {text}")
    return unit


def checked_minutes(minutes: float, named: str = "minutes") -> float:
    """A time at the bench, minutes.

    Raises
    ------
    InputError
        If it is none, or longer than a day; it begins with what `named` calls it.
    """
    if not 0.0 < minutes <= _LONGEST_MIN:
        raise InputError(f"{named} {minutes:g}: give more than 0 and at most {_LONGEST_MIN:g}")
    return minutes


def within_bench(unit: Unit, bench: Limits) -> Unit:
    """A unit that may be driven as far as both it and a bench allow."""
    own = unit.limits
    allowed = {
        "source_vpk": min(own.source_vpk, bench.source_vpk),
        "start_hz": max(own.start_hz, bench.start_hz),
        "stop_hz": min(own.stop_hz, bench.stop_hz),
    }
    return unit.model_copy(update={"limits": own.model_copy(update=allowed)})
