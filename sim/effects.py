"""Settings of effects: read from text, checked against the catalogue, put into a drivetrain.

Owns `EffectSetting` and the order in which effects apply: first those that
change the unit's datasheet values, then those that add or alter elements. What
each effect is, `sim.catalogue` says.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from daq.errors import ConfigurationError
from sim.catalogue import CATALOGUE, not_of_unit
from sim.drivetrain import Drivetrain, paper_drivetrain
from sim.unit import Unit

__all__ = ["EffectSetting", "drivetrain_with", "parse_effect"]


@dataclass(frozen=True, slots=True)
class EffectSetting:
    """An effect with the true physical values of its parameters."""

    id: str
    values: Mapping[str, float]

    def __post_init__(self) -> None:
        if self.id not in CATALOGUE:
            raise ConfigurationError(
                f"effect {self.id!r} is not in the catalogue; use one of: {', '.join(CATALOGUE)}"
            )
        effect = CATALOGUE[self.id]
        names = [parameter.name for parameter in effect.parameters]
        if sorted(self.values) != sorted(names):
            raise ConfigurationError(
                f"effect {self.id} takes {', '.join(names)}; got "
                f"{', '.join(self.values) or 'nothing'}"
            )
        for parameter in effect.parameters:
            value, (low, high) = self.values[parameter.name], parameter.allowed
            if not (math.isfinite(value) and low <= value <= high):
                raise ConfigurationError(
                    f"effect {self.id}: {parameter.name} = {value} is outside "
                    f"{low:g} to {high:g} {parameter.unit_symbol}"
                )


def parse_effect(text: str) -> EffectSetting:
    """Read ``ID:param=value[,param=value]``.

    Raises
    ------
    ConfigurationError
        If the identifier, a parameter or a value is wrong.
    """
    identifier, _, rest = text.partition(":")
    values: dict[str, float] = {}
    for item in filter(None, rest.split(",")):
        name, equals, number = item.partition("=")
        name = name.strip()
        if name in values:
            raise ConfigurationError(f"effect {text!r}: {name} is given twice; give it once")
        try:
            values[name] = float(number) if equals else math.nan
        except ValueError:
            raise ConfigurationError(
                f"effect {text!r}: {number!r} is not a number; write {name}=NUMBER"
            ) from None
    return EffectSetting(identifier.strip(), MappingProxyType(values))


def drivetrain_with(unit: Unit, ratio: float, effects: Sequence[EffectSetting] = ()) -> Drivetrain:
    """The paper's drivetrain of a unit at one contribution ratio, extended by effects.

    Raises
    ------
    ConfigurationError
        If the ratio is outside 0 to 1, the effects contradict each other, or the unit cannot have
        one.
    """
    if len({setting.id for setting in effects}) != len(effects):
        raise ConfigurationError("an effect is given twice; give each once")
    foreign = not_of_unit(unit) if effects else {}
    for setting in effects:
        if setting.id in foreign:
            raise ConfigurationError(f"effect {setting.id}: {foreign[setting.id]}; leave it out")
        change = CATALOGUE[setting.id].on_unit
        if change is not None:
            unit = change(unit, setting.values)
    drivetrain = paper_drivetrain(unit, ratio)
    for setting in effects:
        extend = CATALOGUE[setting.id].on_drivetrain
        if extend is not None:
            drivetrain = extend(drivetrain, unit, setting.values)
    return drivetrain
