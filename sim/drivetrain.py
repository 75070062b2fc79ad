"""The geared servo of the paper, as an assembly of elements.

Owns the topology, equations (1) to (20). ADSS and EDSS differ in numbers only,
so does any other two-stage drive; a one-stage drive lacks the second mesh. The
paper model is kept exactly, undamped; effects are added to it (`sim.effects`)
and never folded into it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from sim.elements import (
    Amplifier,
    Damper,
    DryFriction,
    Element,
    Inertia,
    Mesh,
    Motor,
    Spring,
    Tachometer,
)
from sim.engine.system import Assembly, PiecewiseLinearSystem
from sim.unit import Unit

__all__ = ["Drivetrain", "paper_drivetrain", "shaft_end"]


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
    return "th_L" if unit.stage2 is None else "th_p2"


def paper_drivetrain(unit: Unit, ratio: float) -> Drivetrain:
    """The paper's model of a unit at one contribution ratio.

    Angles: th_m motor, th_g1 gear 1, th_s1 middle of shaft 1, th_p2 pinion 2,
    th_L load. A drive with one gear stage is the same up to shaft 1, which
    ends at the load: no pinion 2 and no mesh 2.

    Raises
    ------
    ConfigurationError
        If the ratio is outside 0 to 1, or not 1 for a drive with one stage.
    """
    motor, electronics, load, stage1 = unit.motor, unit.electronics, unit.load, unit.stage1
    delta_1, delta_2 = unit.split(ratio).half_plays_rad
    end = shaft_end(unit)
    elements: dict[str, Element] = {
        "tachometer": Tachometer(
            "th_m",
            electronics.k_ts,
            electronics.filter_numerator,
            electronics.filter_denominator,
        ),
        "motor": Motor(
            "th_m", motor.L_a, motor.R_m, motor.k_b, motor.k_t, Amplifier(electronics.k_a)
        ),
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
        "mesh1": Mesh("mesh1", {"th_m": 1.0 / stage1.N_1, "th_g1": -1.0}, stage1.k_g1, delta_1),
    }
    if unit.stage2 is not None:
        twist = {"th_p2": 1.0 / unit.stage2.N, "th_L": -1.0}
        elements["mesh2"] = Mesh("mesh2", twist, unit.stage2.k_2, delta_2)
    elements |= {
        "motor_friction": DryFriction("motor_friction", "th_m", motor.T_f_m),
        "load_friction": DryFriction("load_friction", "th_L", load.T_f_L),
    }
    return Drivetrain(elements)
