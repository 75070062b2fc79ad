"""What an effect is: something that a real drive may have and the paper model lacks.

Owns the form of an entry of the catalogue, and the ways in which entries state
their ranges and change a unit. The entries are in `sim.catalogue` and
`sim.rare_effects`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from sim.drivetrain import Drivetrain
from sim.unit import Unit

__all__ = [
    "Effect",
    "EffectParameter",
    "around",
    "drive_voltage",
    "load_critical",
    "load_frequency",
    "shaft_at_load",
    "shaft_critical",
    "span",
    "stall_torque",
    "table_1",
    "times",
]

_HEALTHY = 3.0
"""Standard deviations of a datasheet value within which a unit is as its datasheet says."""

_BEYOND = 6.0
"""Standard deviations of a datasheet value that its plausible range holds at least."""

SOURCE_MOST_VPK = 5.0
"""What the source of a 35670A gives at most, V peak."""


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """One physical parameter of an effect.

    `range` gives the plausible span for a unit, in `unit_symbol`; values
    outside `allowed` have no physical meaning and are refused. `tolerance`: the share by
    which what the datasheet knows may be off in a healthy unit at least, three standard
    deviations. `of`: the datasheet values that a factor is on.
    """

    name: str
    unit_symbol: str
    range: Callable[[Unit], tuple[float, float]]
    allowed: tuple[float, float] = (0.0, math.inf)
    tolerance: float = 0.015
    of: tuple[str, ...] = ()

    def nominal(self, unit: Unit) -> float | None:
        """What a unit without the effect has: its datasheet's value, or 1 of a factor on some.

        None where the effect adds what the datasheet does not know, or has as 0.
        """
        return 1.0 if self.name == "scale" else unit.parameters.get(self.name) or None

    def symbol_of(self, unit: Unit) -> str:
        """Unit of its value: `unit_symbol`, but for the gain of a sensor that is no tachometer."""
        if self.name == "k_ts" and unit.sensor is not None:
            return unit.sensor.gain_unit
        return self.unit_symbol

    def spread(self, unit: Unit) -> float:
        """One standard deviation of it that is believed of the datasheet, as a share; 0 if none."""
        shares = unit.tolerances
        return max((shares.get(symbol, 0.0) for symbol in (self.name, *self.of)), default=0.0)

    def within(self, unit: Unit) -> float:
        """The share by which it may be off in a healthy unit: three standard deviations."""
        return max(self.tolerance, _HEALTHY * self.spread(unit))


@dataclass(frozen=True, slots=True)
class Effect:
    """One entry of the catalogue.

    `site` says whether the fault sits in the mechanics ("plant") or in the
    measuring chain ("chain"), `check` how to make sure of it by other means.
    Exactly one of `on_unit` and `on_drivetrain` is given. `added_inertia`, of
    what is linear and acts on the load alone: the inertia that it adds at an
    angular frequency (rad/s), kg.m^2, complex where it brakes or swings.
    `resonance`: the parameter that is the frequency in Hz at which it swings,
    empty where there is none. `rare`: a less likely cause than the others.
    """

    id: str
    parameters: tuple[EffectParameter, ...]
    site: Literal["plant", "chain"]
    meaning: str
    bench_cause: str
    check: str
    on_unit: Callable[[Unit, Mapping[str, float]], Unit] | None = None
    on_drivetrain: Callable[[Drivetrain, Unit, Mapping[str, float]], Drivetrain] | None = None
    added_inertia: Callable[[Unit, Mapping[str, Any], Any], Any] | None = None
    resonance: str = ""
    rare: bool = False


def table_1(symbol: str) -> Callable[[Unit, Mapping[str, float]], Unit]:
    """A change of one datasheet value."""
    return lambda unit, values: unit.with_parameters(**{symbol: values[symbol]})


def around(symbol: str, low: float, high: float) -> Callable[[Unit], tuple[float, float]]:
    """A range as multiples of the datasheet's value, wider where that is hardly known.

    Of a value that the datasheet has as 0, a range from there to what a drive may have.
    """

    def ends(unit: Unit) -> tuple[float, float]:
        if unit.parameters[symbol] == 0.0:
            return 0.0, _much(unit, symbol)
        known, wide = unit.parameters[symbol], math.exp(_BEYOND * unit.tolerances.get(symbol, 0.0))
        return min(low, 1.0 / wide) * known, max(high, wide) * known

    return ends


def _much(unit: Unit, symbol: str) -> float:
    """A friction or a play that would be much for a drive whose datasheet has none."""
    motor = unit.motor
    volts = unit.electronics.k_a * unit.limits.source_vpk * _command_gain(unit)
    torque = 0.3 * motor.k_t * volts / (motor.R_m or 1.0)
    return {
        "T_f_m": torque,
        "T_f_L": torque * unit.stage1.N_1 * unit.output_ratio,
        "B_m": motor.J_m * 2.0 * math.pi * unit.limits.start_hz,
        "b_t_deg": 0.2,
    }[symbol]


def span(low: float, high: float) -> Callable[[Unit], tuple[float, float]]:
    """A range that is the same for every unit."""
    return lambda unit: (low, high)


def times(scale: Callable[[Unit], float], low: float, high: float) -> Callable[[Unit], Any]:
    """A range as multiples of a natural scale of the unit."""
    return lambda unit: (low * scale(unit), high * scale(unit))


def drive_voltage(unit: Unit) -> float:
    """The largest voltage that the analyser's source puts on the motor, V."""
    return unit.electronics.k_a * SOURCE_MOST_VPK * _command_gain(unit)


def load_frequency(unit: Unit) -> float:
    """A fourteenth of the frequency of the load on shaft 1, as 1, 2 or 5 times a power of ten, Hz.

    A natural scale of what swings on the load. Rounded, so that a small change of the unit
    leaves ranges, and the runs that depend on them, as they are.
    """
    scale = math.sqrt(shaft_at_load(unit) / unit.load.J_L) / (2.0 * math.pi * 14.0)
    decade = 10.0 ** math.floor(math.log10(scale))
    steps = (decade, 2.0 * decade, 5.0 * decade, 10.0 * decade)
    return min(steps, key=lambda step: abs(math.log(step / scale)))


def load_critical(unit: Unit) -> float:
    """Damping that would be critical for the load on shaft 1, N.m.s/rad: a natural scale."""
    return 2.0 * math.sqrt(shaft_at_load(unit) * unit.load.J_L)


def shaft_critical(unit: Unit) -> float:
    """The same of shaft 1 alone, N.m.s/rad."""
    stiffness = unit.stage1.k_s1 * unit.output_ratio**2
    return 2.0 * math.sqrt(stiffness * unit.load.J_L) / unit.output_ratio**2


def stall_torque(unit: Unit) -> float:
    """Torque at the load for 1 V at the amplifier, a natural scale of load torques, N.m."""
    motor = unit.motor
    ratio = unit.stage1.N_1 * unit.output_ratio
    # A current-controlled amplifier makes a current of the command, without a resistance.
    volts = unit.electronics.k_a * _command_gain(unit)
    return volts * motor.k_t / (motor.R_m or 1.0) * ratio


def _command_gain(unit: Unit) -> float:
    """V at the amplifier's input per V of the source, as long as nothing moves."""
    return 1.0 if unit.loop is None else unit.loop.gain_at(unit.limits.stop_hz)


def shaft_at_load(unit: Unit) -> float:
    """Stiffness that the load works against, N.m/rad: of shaft 1 and couplings in series."""
    shaft, compliance = unit.stage1.k_s1 * unit.output_ratio**2, 0.0
    if unit.load_coupling is not None:
        compliance += 1.0 / unit.load_coupling.k_cL
    if unit.motor_coupling is not None:
        ratio = unit.stage1.N_1 * unit.output_ratio
        compliance += 1.0 / (unit.motor_coupling.k_cm * ratio**2)
    return shaft / (1.0 + shaft * compliance)
