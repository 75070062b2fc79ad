"""Sets of limits: from a file of limits, or from the unit's file.

Owns how ``--judge LIMITS`` becomes limits, and which text they came from. It judges nothing.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from daq.configs import config_names
from daq.errors import ConfigurationError
from daq.untrusted.toml_files import Section, load_toml, read_toml
from sim.acceptance import BACKLASH_QUANTITIES, FEATURE_QUANTITIES, Acceptance
from sim.catalogue import CATALOGUE
from sim.unit import Unit, load_unit

__all__ = ["LimitSet", "limits_of_stages", "limits_of_unit", "load_limits"]

_STAGES = ("b1_deg", "b2_deg")


class _LimitsFile(Section):
    """A file of limits; its table is that of a unit file."""

    schema_: Literal[1] = Field(alias="schema")
    name: Annotated[str, Field(min_length=1, max_length=64)]
    acceptance: Acceptance


@dataclass(frozen=True, slots=True)
class LimitSet:
    """Limits and their name.

    Parameters
    ----------
    name
        As the file has it.
    acceptance
        The limits.
    """

    name: str
    acceptance: Acceptance

    @property
    def digest(self) -> str:
        """SHA-256 of the limits, the same for the same limits."""
        text = json.dumps(self.acceptance.model_dump(mode="json"), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    @property
    def needs_estimate(self) -> bool:
        """Whether a limit is of the backlash, which an estimate tells."""
        return any(quantity in BACKLASH_QUANTITIES for quantity, _ in self.acceptance.bounds())

    @property
    def limits_total(self) -> bool:
        """Whether the total backlash is limited, which then must be estimated, too."""
        return bool(self.acceptance.b_t_deg)

    @property
    def needs_features(self) -> bool:
        """Whether a limit is of ARF, RF or damping."""
        return any(quantity in FEATURE_QUANTITIES for quantity, _ in self.acceptance.bounds())


def load_limits(name_or_path: str) -> LimitSet:
    """Read a file of limits, or take those of a unit file.

    Parameters
    ----------
    name_or_path
        Path of a file of limits or of a unit, or the name of a unit that comes with lashbench.

    Raises
    ------
    ConfigurationError
        If the file is not there, anything in it is wrong, or it sets no limit.
    """
    if name_or_path.lower() in config_names("units"):
        return limits_of_unit(load_unit(name_or_path))
    path = Path(name_or_path)
    try:
        is_file = path.is_file()
    except (OSError, ValueError):
        is_file = False
    if not is_file:
        raise ConfigurationError(
            f"limits {name_or_path!r} were not found; give the path of a file with an [acceptance] "
            f"table, or of a unit file, or one of: {', '.join(config_names('units'))}"
        )
    if "motor" in read_toml(path):
        return limits_of_unit(load_unit(str(path)), str(path))
    found = load_toml(_LimitsFile, path)
    return _checked(LimitSet(found.name, found.acceptance), str(path))


def limits_of_unit(unit: Unit, source: str = "") -> LimitSet:
    """The limits of a unit: its ``[acceptance]``, and ``b1_deg`` and ``b2_deg`` of ``[limits]``.

    Raises
    ------
    ConfigurationError
        If it sets none.
    """
    table = _table(unit)
    if not table:
        raise ConfigurationError(
            f"{source or f'unit {unit.name}'}: sets no limit to judge by; add an [acceptance] "
            "table, or give a file of limits"
        )
    found = LimitSet(unit.name, Acceptance.model_validate(table))
    return _checked(found, source or f"unit {unit.name}")


def limits_of_stages(unit: Unit) -> LimitSet | None:
    """The limits of a unit on the backlash of its stages; None if it sets none."""
    table = _table(unit)
    kept = {name: table[name] for name in _STAGES if table.get(name)}
    if not kept:
        return None
    if "coverage_factor" in table:
        kept["coverage_factor"] = table["coverage_factor"]
    return LimitSet(unit.name, Acceptance.model_validate(kept))


def _table(unit: Unit) -> dict[str, Any]:
    table = {} if unit.acceptance is None else unit.acceptance.model_dump()
    for name in _STAGES:
        limit = getattr(unit.limits, name)
        if limit is not None:
            table[name] = (*table.get(name, ()), {"upper": limit})
    return table


def _checked(limits: LimitSet, source: str) -> LimitSet:
    """Refuse an effect that the catalogue does not have."""
    for name in limits.acceptance.causes_not_tolerated:
        if name not in CATALOGUE:
            raise ConfigurationError(
                f"{source}: acceptance.causes_not_tolerated: there is no effect {name!r}; use one "
                f"of: {', '.join(sorted(CATALOGUE))}"
            )
    return limits
