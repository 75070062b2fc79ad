"""The geared servo of the paper, as an assembly of elements.

Owns the topology, equations (1) to (20). ADSS and EDSS differ in numbers only,
so does any other two-stage drive; a one-stage drive lacks the second mesh, and
a three-stage one has a third behind it. The
paper model is kept exactly, undamped; effects are added to it (`sim.effects`)
and never folded into it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from sim.drive.controller import Controller
from sim.drive.sections import Damping
from sim.drive.sensors import AnalogueSensor, Encoder, SampledTachometer
from sim.drive.unit import Unit
from sim.elements import (
    Amplifier,
    Damper,
    DryFriction,
    Element,
    Inertia,
    LoadedFriction,
    Mesh,
    Motor,
    Spring,
    Tachometer,
)
from sim.engine.system import Assembly, PiecewiseLinearSystem

__all__ = [
    "Drivetrain",
    "load_side",
    "motor_side",
    "paper_drivetrain",
    "shaft_dampers",
    "shaft_end",
]


_MOST = 2e3
"""Largest V or A of an amplifier in a loop whose unit file has no limit: no machine reaches it but
one that a cause makes unstable, whose motion then has an end."""


@dataclass(frozen=True, slots=True)
class Drivetrain:
    """Named elements; an effect returns a new one with elements added or replaced."""

    elements: Mapping[str, Element]

    def adding(self, **elements: Element) -> Drivetrain:
        """A copy with further elements; a name that exists already is an error of the caller."""
        twice = set(elements) & set(self.elements)
        if twice:
            raise ValueError(f"elements {sorted(twice)} exist already; use replacing()")
        return Drivetrain({**self.elements, **elements})

    def with_elements(self, elements: Mapping[str, Element]) -> Drivetrain:
        """A copy with elements in place of those of the same name, or besides where none is."""
        return Drivetrain({**self.elements, **elements})

    def replacing(self, name: str, **fields: object) -> Drivetrain:
        """A copy in which some fields of one element differ."""
        element = replace(self.elements[name], **fields)  # type: ignore[type-var]
        return Drivetrain({**self.elements, name: element})

    def system(self) -> PiecewiseLinearSystem:
        """The piecewise-linear system from amplifier input voltage to V_o."""
        assembly = Assembly()
        for element in self.elements.values():
            element.enter(assembly)
        return assembly.build()


def shaft_end(unit: Unit) -> str:
    """The coordinate at the output end of shaft 1: pinion 2, or the load itself."""
    return load_side(unit) if unit.stage2 is None else "th_p2"


def load_side(unit: Unit) -> str:
    """The coordinate at the end of the gears: the load, or the near side of its coupling."""
    return "th_L" if unit.load_coupling is None else "th_h"


def motor_side(unit: Unit) -> str:
    """The coordinate of pinion 1: the motor, or the far side of its coupling."""
    return "th_m" if unit.motor_coupling is None else "th_c"


def paper_drivetrain(unit: Unit, ratio: float) -> Drivetrain:
    """The paper's model of a unit at one contribution ratio, with what its file has besides.

    Angles: th_m motor, th_g1 gear 1, th_s1 middle of shaft 1, th_p2 pinion 2,
    th_L load. A drive with one gear stage is the same up to shaft 1, which
    ends at the load: no pinion 2 and no mesh 2. With three stages mesh 2 ends at
    th_g2, gear 2 with pinion 3. With couplings th_c is pinion 1 and th_h the last gear.

    Raises
    ------
    ConfigurationError
        If the ratio is outside 0 to 1, or not 1 for a drive with one stage.
    """
    motor, load, stage1 = unit.motor, unit.load, unit.stage1
    damping = unit.damping or Damping()
    plays = unit.split(ratio)
    delta_1, delta_2 = plays.half_plays_rad
    end = shaft_end(unit)
    elements: dict[str, Element] = {
        "tachometer": _sensor(unit),
        "motor": _motor(unit),
        "rotor": Inertia("th_m", motor.J_m),
        "gear1": Inertia("th_g1", stage1.J_g1),
        "shaft": Inertia("th_s1", stage1.J_s1),
    }
    if stage1.J_p2 is not None:
        elements["pinion2"] = Inertia("th_p2", stage1.J_p2)
    elements |= {
        "load": Inertia("th_L", load.J_L),
        "rotor_viscous": Damper({"th_m": 1.0}, motor.B_m),
        "shaft_gear_half": Spring({"th_g1": 1.0, "th_s1": -1.0}, 2.0 * stage1.k_s1),
        "shaft_pinion_half": Spring({"th_s1": 1.0, end: -1.0}, 2.0 * stage1.k_s1),
        "mesh1": Mesh(
            "mesh1",
            {motor_side(unit): 1.0 / stage1.N_1, "th_g1": -1.0},
            stage1.k_g1,
            delta_1,
            damping.c_g1 or 0.0,
        ),
    }
    if unit.stage2 is not None:
        gear_2 = load_side(unit) if unit.stage3 is None else "th_g2"
        twist = {"th_p2": 1.0 / unit.stage2.N, gear_2: -1.0}
        elements["mesh2"] = Mesh("mesh2", twist, unit.stage2.k_2, delta_2, damping.c_2 or 0.0)
    if (stage3 := unit.stage3) is not None:
        twist = {"th_g2": 1.0 / stage3.N_3, load_side(unit): -1.0}
        delta_3 = math.radians(plays.b3_deg) / 2.0
        elements["gear2"] = Inertia("th_g2", stage3.J_g2)
        elements["mesh3"] = Mesh("mesh3", twist, stage3.k_3, delta_3, damping.c_3 or 0.0)
    elements |= _frictions(unit)
    if damping.B_L is not None:
        elements["load_viscous"] = Damper({"th_L": 1.0}, damping.B_L)
    if damping.c_s1 is not None:
        elements |= shaft_dampers(unit, damping.c_s1)
    return Drivetrain(elements | _couplings(unit))


def _frictions(unit: Unit) -> dict[str, Element]:
    """Dry friction of motor and load, and in each mesh that loses torque, on its pinion."""
    pinion, stage1, stage2, stage3 = motor_side(unit), unit.stage1, unit.stage2, unit.stage3
    found: dict[str, Element] = {
        "motor_friction": DryFriction("motor_friction", "th_m", unit.motor.T_f_m)
    }
    if lost := _lost(stage1.eta_1, stage1.N_1):
        name, T = ("motor_friction", unit.motor.T_f_m) if pinion == "th_m" else ("mesh1_loss", 0.0)
        found[name] = LoadedFriction(name, pinion, "mesh1", lost, T)
    if stage2 is not None and (lost := _lost(stage2.eta_2, stage2.N)):
        found["mesh2_loss"] = LoadedFriction("mesh2_loss", "th_p2", "mesh2", lost)
    if stage3 is not None and (lost := _lost(stage3.eta_3, stage3.N_3)):
        found["mesh3_loss"] = LoadedFriction("mesh3_loss", "th_g2", "mesh3", lost)
    return found | {"load_friction": DryFriction("load_friction", "th_L", unit.load.T_f_L)}


def _lost(eta: float | None, N: float) -> float:
    """Friction on a pinion over the torque at its gear."""
    return 0.0 if eta is None else (1.0 / eta - 1.0) / N


def shaft_dampers(unit: Unit, c_s1: float) -> dict[str, Element]:
    """A damper 2 c_s1 beside each half of shaft 1."""
    return {
        "shaft_gear_damper": Damper({"th_g1": 1.0, "th_s1": -1.0}, 2.0 * c_s1),
        "shaft_pinion_damper": Damper({"th_s1": 1.0, shaft_end(unit): -1.0}, 2.0 * c_s1),
    }


def _motor(unit: Unit) -> Motor:
    motor, current, sampling = unit.motor, unit.amplifier, unit.sampling
    hold_hz = sampling.rate_hz if sampling is not None and sampling.holds_command else 0.0
    most = None if unit.loop is None else _MOST
    controller = _controller(unit)
    amplifier = Amplifier(unit.electronics.k_a, V_sat=most, hold_hz=hold_hz, controller=controller)
    if current is not None:
        amplifier = replace(amplifier, V_sat=current.current_limit_a or most)
        lag_s = 1.0 / (2.0 * math.pi * current.bandwidth_hz)
        return Motor("th_m", lag_s, 1.0, 0.0, motor.k_t, amplifier)
    assert motor.L_a is not None
    assert motor.R_m is not None
    assert motor.k_b is not None
    return Motor("th_m", motor.L_a, motor.R_m, motor.k_b, motor.k_t, amplifier)


def _controller(unit: Unit) -> Controller | None:
    loop, sensor, sampling = unit.loop, unit.sensor, unit.sampling
    if loop is None:
        return None
    coordinate, k_ts = _sensed(unit), unit.electronics.k_ts
    encoder = sensor is not None and sensor.kind == "encoder"
    return Controller(
        loop.K_p,
        loop.T_i_s,
        loop.K_v,
        loop.excited == "reference",
        {"V_o": 1.0} if loop.filtered else {f"{coordinate}'": k_ts},
        coordinate,
        k_ts,
        sensor.counts if encoder and sensor is not None else None,
        sampling.rate_hz if sampling is not None and sampling.holds_command else 0.0,
        loop.computing_s or 0.0,
    )


def _sensed(unit: Unit) -> str:
    """The coordinate that the sensor is on."""
    return "th_L" if unit.sensor is not None and unit.sensor.at == "load" else "th_m"


def _sensor(unit: Unit) -> Element:
    electronics, sensor, sampling = unit.electronics, unit.sensor, unit.sampling
    filtered = electronics.filter_numerator, electronics.filter_denominator
    late = 0.0 if sensor is None else sensor.delay_s or 0.0
    if sensor is not None and sensor.kind in ("accelerometer", "current"):
        return AnalogueSensor(
            "current" if sensor.kind == "current" else "acceleration",
            _sensed(unit),
            electronics.k_ts * (sensor.radius_m or 1.0),
            sensor.low_pass_hz,
            sensor.high_pass_hz,
            *filtered,
            sampling.rate_hz if sensor.sampled and sampling is not None else 0.0,
            sensor.held,
            late,
        )
    if sensor is not None and sensor.kind == "encoder":
        assert sampling is not None
        assert sensor.counts is not None
        return Encoder(
            _sensed(unit),
            electronics.k_ts,
            sampling.rate_hz,
            sensor.counts,
            sensor.reads == "speed",
            sensor.held,
            *filtered,
            late,
        )
    assert filtered[0] is not None
    assert filtered[1] is not None
    known = _sensed(unit), electronics.k_ts, filtered[0], filtered[1]
    if sensor is not None and sensor.sampled:
        assert sampling is not None
        return SampledTachometer(*known, sampling.rate_hz, sensor.held, late)
    return Tachometer(*known, delay_s=late)


def _couplings(unit: Unit) -> dict[str, Element]:
    found: dict[str, Element] = {}
    if (motor := unit.motor_coupling) is not None:
        twist = {"th_m": 1.0, "th_c": -1.0}
        found |= {
            "motor_coupling_far": Inertia("th_c", motor.J_cm),
            "motor_coupling": Spring(twist, motor.k_cm),
            "motor_coupling_damper": Damper(twist, motor.c_cm),
        }
    if (load := unit.load_coupling) is not None:
        twist = {"th_h": 1.0, "th_L": -1.0}
        found |= {
            "load_coupling_near": Inertia("th_h", load.J_cL),
            "load_coupling": Spring(twist, load.k_cL),
            "load_coupling_damper": Damper(twist, load.c_cL),
        }
    return found
