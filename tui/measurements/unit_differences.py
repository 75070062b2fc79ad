"""In which values two units of a name differ, and which of them one is.

Owns the comparison of unit files by what they say. It judges no difference and prints nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sim.unit import Unit

__all__ = ["differing_values", "origin_words"]

Value = float | tuple[float, ...] | None


def differing_values(
    one: Unit, other: Unit, *, limits: bool = True
) -> dict[str, tuple[Value, Value]]:
    """Values of two units where they differ, by symbol, those of `one` first.

    None stands for what a unit does not have: a limit, or a second stage.

    Parameters
    ----------
    limits
        Whether what a unit may be driven with, what it is accepted by and its tolerance are
        compared, too.
    """
    ours, theirs = _values(one, limits), _values(other, limits)
    return {
        name: (ours.get(name), theirs.get(name))
        for name in ours | theirs
        if ours.get(name) != theirs.get(name)
    }


def origin_words(unit: Unit, name: str) -> str:
    """Which unit it is that is none of those that come with lashbench, in two lines at most.

    Parameters
    ----------
    name
        Path of its file, or another name for it.
    """
    from daq.configs import config_names
    from sim.unit import load_unit

    if unit.name.lower() not in config_names("units"):
        return name
    differ = differing_values(unit, load_unit(unit.name.lower()))
    if not differ:
        return f"{name}\nas the shipped {unit.name}"
    return f"{name}\ndiffers from the shipped one: {', '.join(differ)}"


def _values(unit: Unit, limits: bool) -> dict[str, Value]:
    found: dict[str, Value] = {}
    for section, values in unit.model_dump().items():
        is_physics = section not in ("limits", "acceptance", "tolerance")
        if isinstance(values, dict) and (limits or is_physics):
            # A tolerance and a limit of acceptance bear the name of their value.
            of = f"{section} of " if section in ("acceptance", "tolerance") else ""
            found |= {f"{of}{symbol}": value for symbol, value in values.items()}
    return found
