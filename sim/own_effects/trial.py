"""A first try of the effects that a unit's own files define, before anything is simulated.

Owns what an effect must do to be of use: at the ends and in the middle of its ranges it makes a
drivetrain that can be simulated and that is not the plain one. It simulates nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from daq.errors import ConfigurationError, LashbenchError
from sim.catalogue import CATALOGUE, effects_of
from sim.drive.unit import Unit
from sim.effects import EffectSetting, drivetrain_with
from sim.engine.system import PiecewiseLinearSystem

__all__ = ["try_own_effects"]

_RATIO = 0.5


def try_own_effects(unit: Unit) -> tuple[str, ...]:
    """Identifiers of the unit's own effects, each of which was tried.

    Raises
    ------
    ConfigurationError
        If a file of its own effects is wrong, or one of these cannot be simulated or changes
        nothing.
    """
    own = CATALOGUE.own_of(unit)
    if not own:
        return ()
    effects_of(unit)
    ratio = 1.0 if unit.stages == 1 else _RATIO
    plain = drivetrain_with(unit, ratio).system()
    for identifier in own:
        changed = False
        for setting in _settings(unit, identifier):
            system = _tried(unit, ratio, setting)
            changed = changed or not _equal(plain, system)
        if not changed:
            raise ConfigurationError(
                f"unit {unit.name}: effect {identifier} changes nothing of the drive; a change "
                "must return the new drivetrain or unit"
            )
    return own


def _settings(unit: Unit, identifier: str) -> Iterator[EffectSetting]:
    """The effect with all sizes at the low end, in the middle, and at the high end."""
    ends = {p.name: p.range(unit) for p in CATALOGUE[identifier].parameters}
    for share in (0.0, 0.5, 1.0):
        # From zero a range begins at a hundredth of its end, as in every diagnosis.
        low = {name: max(low, 0.01 * high) for name, (low, high) in ends.items()}
        yield EffectSetting(
            identifier,
            {n: low[n] * math.exp(share * math.log(ends[n][1] / low[n])) for n in ends},
        )


def _tried(unit: Unit, ratio: float, setting: EffectSetting) -> PiecewiseLinearSystem:
    sizes = ", ".join(f"{name} = {value:g}" for name, value in setting.values.items())
    try:
        system = drivetrain_with(unit, ratio, [setting]).system()
    except LashbenchError:
        raise
    except Exception as error:
        told = " ".join(str(error).split())
        raise ConfigurationError(
            f"unit {unit.name}: effect {setting.id} with {sizes} makes no drive that can be "
            f"simulated ({type(error).__name__}: {told})"
        ) from error
    if not all(np.all(np.isfinite(one)) for one in (system.A, system.b, system.o)):
        raise ConfigurationError(
            f"unit {unit.name}: effect {setting.id} with {sizes} makes no drive that can be "
            "simulated (its equations are not finite); see that every coordinate has an inertia"
        )
    return system


def _equal(one: PiecewiseLinearSystem, other: PiecewiseLinearSystem) -> bool:
    """Whether two drives have the same equations and the same laws."""
    arrays = [(one.A, other.A), (one.b, other.b), (one.o, other.o), (one.f, other.f)]
    laws = [
        [(law.law, law.stiffness, law.damping, law.parameters) for law in system.nonlinearities]
        for system in (one, other)
    ]
    return all(np.array_equal(a, b) for a, b in arrays) and laws[0] == laws[1]
