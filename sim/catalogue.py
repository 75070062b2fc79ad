"""The catalogue of effects: what a real drive may have that the paper model lacks.

Owns, for each effect, its identifier, its parameters with their physical range,
how it changes the unit or the drivetrain, and what it means to the person at
the bench. An effect only adds or alters elements; it never touches the engine,
and none is ever part of the paper model itself. How settings of effects are
read and applied is `sim.effects`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from sim.drivetrain import Drivetrain, shaft_dampers, shaft_end
from sim.effect import (
    Effect,
    EffectParameter,
    around,
    drive_voltage,
    load_critical,
    load_frequency,
    shaft_at_load,
    shaft_critical,
    span,
    stall_torque,
    table_1,
    times,
)
from sim.elements import (
    ConstantTorque,
    Damper,
    HardeningSpring,
    Inertia,
    Spring,
)
from sim.own_effects.registry import Catalogue
from sim.rare_effects import RARE
from sim.unit import Unit

__all__ = [
    "BUILT_IN",
    "CATALOGUE",
    "COMMON",
    "Effect",
    "EffectParameter",
    "effects_of",
    "not_of_unit",
]


def _add_load_damper(d: Drivetrain, unit: Unit, v: Mapping[str, float]) -> Drivetrain:
    return d.with_elements({"load_viscous": Damper({"th_L": 1.0}, v["B_L"])})


def _add_shaft_dampers(d: Drivetrain, unit: Unit, v: Mapping[str, float]) -> Drivetrain:
    return d.with_elements(shaft_dampers(unit, v["c_s1"]))


def _harden_shaft(d: Drivetrain, unit: Unit, v: Mapping[str, float]) -> Drivetrain:
    k, halves = (
        2.0 * unit.stage1.k_s1,
        ({"th_g1": 1.0, "th_s1": -1.0}, {"th_s1": 1.0, shaft_end(unit): -1.0}),
    )
    return d.adding(
        gear_half_hardening=HardeningSpring("harden1", halves[0], k, v["h"]),
        pinion_half_hardening=HardeningSpring("harden2", halves[1], k, v["h"]),
    )


def _add_payload(d: Drivetrain, unit: Unit, v: Mapping[str, float]) -> Drivetrain:
    omega = 2.0 * math.pi * v["f_p"]
    twist = {"th_L": 1.0, "th_p": -1.0}
    return d.adding(
        payload=Inertia("th_p", v["J_p"]),
        payload_spring=Spring(twist, v["J_p"] * omega**2),
        payload_damper=Damper(twist, 2.0 * v["zeta_p"] * v["J_p"] * omega),
    )


def _payload_felt(unit: Unit, v: Mapping[str, Any], omega: Any) -> Any:
    resonance = 2.0 * math.pi * v["f_p"]
    force = resonance**2 + 2j * v["zeta_p"] * resonance * omega
    return v["J_p"] * force / (force - omega**2)


def _amplifier(**fields: str) -> Callable[[Drivetrain, Unit, Mapping[str, float]], Drivetrain]:
    def change(d: Drivetrain, unit: Unit, v: Mapping[str, float]) -> Drivetrain:
        values = {name: v[parameter] for name, parameter in fields.items()}
        amplifier = replace(d.elements["motor"].amplifier, **values)  # type: ignore[attr-defined]
        return d.replacing("motor", amplifier=amplifier)

    return change


def _scaled(*symbols: str) -> Callable[[Unit, Mapping[str, float]], Unit]:
    return lambda unit, v: unit.with_parameters(
        **{symbol: v["scale"] * unit.parameters[symbol] for symbol in symbols}
    )


def _move_corner(d: Drivetrain, unit: Unit, v: Mapping[str, float]) -> Drivetrain:
    numerator, denominator = unit.electronics.filter_numerator, unit.electronics.filter_denominator
    if numerator is None or denominator is None:
        return d
    d2, d1, d0 = denominator
    scale = v["scale"]
    return d.replacing(
        "tachometer",
        numerator=numerator * scale**2,
        denominator=(d2, d1 * scale, d0 * scale**2),
    )


_P = EffectParameter
_TORQUE, _DAMPING, _STIFFNESS = "N.m", "N.m.s/rad", "N.m/rad"

_ALL = (
    Effect(
        "load-viscous-damping",
        (_P("B_L", _DAMPING, times(load_critical, 3e-4, 0.1)),),
        "plant",
        "The load is braked in proportion to its speed.",
        "grease or a seal dragging on the load, or eddy currents",
        "motor off, pull the load at two speeds with a spring scale; the pull grows with speed",
        on_drivetrain=_add_load_damper,
        added_inertia=lambda unit, v, omega: (
            (v["B_L"] - unit.parameters.get("B_L", 0.0)) / (1j * omega)
        ),
    ),
    Effect(
        "shaft-damping",
        (_P("c_s1", _DAMPING, times(shaft_critical, 1e-3, 0.3)),),
        "plant",
        "Shaft 1 loses energy as it twists.",
        "a press fit or coupling that works on shaft 1",
        "hold the motor, strike the load and time how it rings out; compare another shaft 1",
        on_drivetrain=_add_shaft_dampers,
    ),
    Effect(
        "mesh1-damping",
        (_P("c_g1", _DAMPING, span(1e-3, 10.0)),),
        "plant",
        "Gear 1 loses energy while its teeth touch.",
        "thick or fresh grease in gear stage 1",
        "warm gear stage 1 by ten kelvin and measure again; the answer goes with the grease",
        on_drivetrain=lambda d, unit, v: d.replacing("mesh1", c=v["c_g1"]),
    ),
    Effect(
        "mesh2-damping",
        (_P("c_2", _DAMPING, span(1e-2, 100.0)),),
        "plant",
        "Gear 2 loses energy while its teeth touch.",
        "thick or fresh grease in gear stage 2",
        "warm gear stage 2 by ten kelvin and measure again; the answer goes with the grease",
        on_drivetrain=lambda d, unit, v: d.replacing("mesh2", c=v["c_2"]),
    ),
    Effect(
        "load-coulomb-friction",
        (_P("T_f_L", _TORQUE, around("T_f_L", 0.0, 40.0)),),
        "plant",
        "The dry friction of the load differs from its datasheet.",
        "a preloaded or dirty bearing of the load",
        "take the load off its gear and pull it with a spring scale; as much at any speed",
        on_unit=table_1("T_f_L"),
    ),
    Effect(
        "load-stribeck-friction",
        (
            _P("T_s_L", _TORQUE, around("T_f_L", 0.3, 40.0)),
            _P("omega_s", "rad/s", span(0.003, 3.0), (1e-6, math.inf)),
        ),
        "plant",
        "The friction of the load peaks near standstill and falls as it moves.",
        "a lubricated bearing that runs dry at low speed",
        "take the load off its gear and pull it with a spring scale; more to start than to go on",
        on_drivetrain=lambda d, unit, v: d.replacing(
            "load_friction", T_s=v["T_s_L"], omega_s=v["omega_s"]
        ),
    ),
    Effect(
        "motor-coulomb-friction",
        (_P("T_f_m", _TORQUE, around("T_f_m", 0.0, 6.0)),),
        "plant",
        "The dry friction of the motor differs from its datasheet.",
        "worn brushes, or a preloaded motor bearing",
        "take the motor off its gear and read the current at which it just turns; times k_t",
        on_unit=table_1("T_f_m"),
    ),
    Effect(
        "motor-viscous-friction",
        (_P("B_m", _DAMPING, around("B_m", 0.0, 30.0)),),
        "plant",
        "The viscous friction of the motor differs from its datasheet.",
        "stiff grease in the motor bearings, cold running",
        "take the motor off its gear and read its current at two speeds; the difference grows",
        on_unit=table_1("B_m"),
    ),
    Effect(
        "load-inertia",
        (_P("J_L", "kg.m^2", around("J_L", 0.5, 2.0), (1e-12, math.inf)),),
        "plant",
        "The inertia of the load differs from its datasheet.",
        "another payload, or a counterweight moved or missing",
        "compare what is mounted with the drawing; add a known inertia and measure again",
        on_unit=table_1("J_L"),
        added_inertia=lambda unit, v, omega: v["J_L"] - unit.load.J_L + 0j * omega,
    ),
    Effect(
        "shaft-stiffness",
        (_P("k_s1", _STIFFNESS, around("k_s1", 0.5, 2.0), (1e-9, math.inf)),),
        "plant",
        "Shaft 1 is softer or stiffer than its datasheet.",
        "a loose clamp, a crack, or another shaft",
        "hold the motor, load the output with a known torque, read the twist with a dial gauge",
        on_unit=table_1("k_s1"),
    ),
    Effect(
        "shaft-hardening",
        (_P("h", "1/rad^2", span(10.0, 1e6)),),
        "plant",
        "Shaft 1 gets stiffer the more it twists.",
        "a spline or coupling that closes up under torque",
        "hold the motor and read the load's twist at two known torques; not in proportion",
        on_drivetrain=_harden_shaft,
    ),
    Effect(
        "total-backlash",
        (_P("b_t_deg", "deg", around("b_t_deg", 0.2, 4.0)),),
        "plant",
        "The total backlash differs from the value it was given.",
        "wear, or a centre distance that was changed since it was measured",
        "hold the motor, rock the load and read its play with a dial gauge",
        on_unit=table_1("b_t_deg"),
    ),
    Effect(
        "cable-stiffness",
        (_P("K_c", _STIFFNESS, times(shaft_at_load, 0.005, 2.0)),),
        "plant",
        "A spring ties the load to ground.",
        "a stiff cable bundle or hose across the joint",
        "undo cables and hoses across the joint and measure again",
        on_drivetrain=lambda d, unit, v: d.adding(cable=Spring({"th_L": 1.0}, v["K_c"])),
        added_inertia=lambda unit, v, omega: -v["K_c"] / omega**2,
    ),
    Effect(
        "load-torque-bias",
        (_P("T_b", _TORQUE, times(stall_torque, 0.02, 2.0), (-math.inf, math.inf)),),
        "plant",
        "A constant torque pulls on the load.",
        "an imbalance, a hanging cable or a tilted base",
        "see whether the load, off its gear, stays where it is put; tilt the base, measure again",
        on_drivetrain=lambda d, unit, v: d.adding(bias=ConstantTorque("th_L", v["T_b"])),
    ),
    Effect(
        "payload-flexibility",
        (
            _P("J_p", "kg.m^2", around("J_L", 0.02, 0.5), (1e-12, math.inf)),
            _P("f_p", "Hz", times(load_frequency, 2.0, 30.0), (1e-3, 1e5)),
            _P("zeta_p", "1", span(0.005, 0.1)),
        ),
        "plant",
        "Something on the load swings on a spring of its own.",
        "a loose bracket, lens or cable clamp on the load",
        "tap what is mounted, with an accelerometer on it; take it off and measure again",
        on_drivetrain=_add_payload,
        added_inertia=_payload_felt,
        resonance="f_p",
    ),
    Effect(
        "amplifier-gain",
        (_P("k_a", "1", around("k_a", 0.5, 2.0), (1e-9, math.inf)),),
        "chain",
        "The gain of the amplifier differs from its datasheet.",
        "a trimmer that was turned, or a changed supply",
        "compare the voltages at the motor and at the source with a meter",
        on_unit=table_1("k_a"),
    ),
    Effect(
        "amplifier-saturation",
        (_P("V_sat", "V", times(drive_voltage, 0.1, 1.0), (1e-6, math.inf)),),
        "chain",
        "The amplifier clips.",
        "a low supply voltage or a current limit that is set too low",
        "look at the motor's voltage at the highest level with an oscilloscope; it is cut off flat",
        on_drivetrain=_amplifier(V_sat="V_sat"),
    ),
    Effect(
        "amplifier-lag",
        (_P("tau_a", "s", span(2e-5, 5e-3)),),
        "chain",
        "The amplifier answers late.",
        "a noise filter or an ageing output stage in the amplifier",
        "measure from the source to the motor's voltage alone; its phase falls with frequency",
        on_drivetrain=_amplifier(tau_a="tau_a"),
    ),
    Effect(
        "motor-resistance",
        (_P("R_m", "ohm", around("R_m", 0.5, 2.0), (1e-9, math.inf)),),
        "plant",
        "The resistance of the motor differs from its datasheet.",
        "a hot winding, worn brushes or a bad contact in the motor lead",
        "measure the winding with a meter, cold, and again at once after a sweep",
        on_unit=table_1("R_m"),
    ),
    Effect(
        "motor-constant",
        (_P("scale", "1", span(0.5, 2.0), (1e-9, math.inf), of=("k_t", "k_b")),),
        "plant",
        "Torque constant and back-EMF constant are both off by one factor.",
        "magnets that lost or differ in strength",
        "turn the motor at a known speed and read its open-circuit voltage",
        on_unit=_scaled("k_t", "k_b"),
    ),
    Effect(
        "tachometer-gain",
        (_P("k_ts", "V.s/rad", around("k_ts", 0.5, 2.0), (1e-9, math.inf)),),
        "chain",
        "The gain of the tachometer, or other sensor, differs from its datasheet.",
        "a loaded output of it, or a changed sensor",
        "turn the tachometer at a known speed and read its voltage, connected as in the sweep",
        on_unit=table_1("k_ts"),
    ),
    Effect(
        "filter-corner",
        # A corner is as good as the capacitors that make it.
        (_P("scale", "1", span(0.5, 2.0), (1e-6, math.inf), 0.05),),
        "chain",
        "The corner frequency of the tachometer's filter is off.",
        "a filter part of another value, or drift of it",
        "measure the response of the filter alone, fed from the source",
        on_drivetrain=_move_corner,
    ),
    *RARE,
)

BUILT_IN: Mapping[str, Effect] = MappingProxyType({effect.id: effect for effect in _ALL})
"""Every effect that comes with lashbench, by identifier."""

CATALOGUE = Catalogue(BUILT_IN)
"""Every effect by identifier, with those that files of units define (`sim.own_effects`)."""


def effects_of(unit: Unit) -> tuple[str, ...]:
    """Effects that a unit can have, in the order of the catalogue, its own last.

    Raises
    ------
    ConfigurationError
        If it names files of its own effects that were not read, or that are wrong.
    """
    foreign = not_of_unit(unit)
    return (*(name for name in BUILT_IN if name not in foreign), *CATALOGUE.own_of(unit))


def not_of_unit(unit: Unit) -> dict[str, str]:
    """Effects that a unit cannot have or show, by identifier, and why.

    Raises
    ------
    ConfigurationError
        As `effects_of`.
    """
    own = CATALOGUE.own_of(unit)
    found = {
        name: f"it is an effect of another unit's own, not of {unit.name}"
        for name in CATALOGUE
        if name not in BUILT_IN and name not in own
    }
    if unit.stages == 1:
        why = f"unit {unit.name} has one gear stage"
        found |= dict.fromkeys((name for name in BUILT_IN if name.startswith("mesh2-")), why)
    if unit.amplifier is not None:
        why = f"the amplifier of unit {unit.name} controls the current"
        found |= dict.fromkeys(("motor-resistance", "amplifier-saturation"), why)
        # Torque is the product of both constants, and nothing else shows either.
        found["motor-constant"] = f"{why}: amplifier-gain says the same"
    if unit.sensor is not None and unit.sensor.kind == "encoder":
        found["tachometer-gain"] = f"unit {unit.name} has an encoder"
    if unit.electronics.filter_numerator is None:
        found["filter-corner"] = f"unit {unit.name} has no filter"
    return found


COMMON = tuple(effect.id for effect in _ALL if not effect.rare)
"""Identifiers of those that are suspected first."""
