"""The physical elements that a drivetrain is made of.

Each is a small frozen record of physical parameters that knows how to enter an
`Assembly`. Coordinates are named, so elements join wherever names meet. An
element never steps time and never looks at another element.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol

from sim.drive.controller import Controller, Feed, add_late
from sim.drive.sensors import add_filter, read_late
from sim.engine.system import Assembly, Law

__all__ = [
    "Amplifier",
    "ConstantTorque",
    "Damper",
    "DryFriction",
    "Element",
    "HardeningSpring",
    "Inertia",
    "LoadedFriction",
    "Mesh",
    "Motor",
    "Spring",
    "Tachometer",
]

Along = Mapping[str, float]

_FAR = 1e3
"""Voltage that no amplifier reaches, V: a law with one limit there acts on one side alone."""


class Element(Protocol):
    """Anything that can enter an assembly."""

    def enter(self, assembly: Assembly) -> None:
        """Add this element's states, torques and laws to the assembly."""
        ...


@dataclass(frozen=True, slots=True)
class Inertia:
    """A rotating mass: J w' = sum of torques."""

    coordinate: str
    J: float

    def enter(self, assembly: Assembly) -> None:
        """Add the coordinate."""
        assembly.add_inertia(self.coordinate, self.J)


@dataclass(frozen=True, slots=True)
class Spring:
    """A linear torsion spring, N.m/rad; one coordinate alone means to ground."""

    along: Along
    k: float

    def enter(self, assembly: Assembly) -> None:
        """Add the spring."""
        assembly.add_torque(self.along, stiffness=self.k)


@dataclass(frozen=True, slots=True)
class Damper:
    """A viscous damper, N.m.s/rad; one coordinate alone means to ground."""

    along: Along
    c: float

    def enter(self, assembly: Assembly) -> None:
        """Add the damper."""
        assembly.add_torque(self.along, damping=self.c)


@dataclass(frozen=True, slots=True)
class HardeningSpring:
    """The cubic part k h x^3 of a spring k x (1 + h x^2); add a `Spring` for the linear part."""

    name: str
    along: Along
    k: float
    h: float

    def enter(self, assembly: Assembly) -> None:
        """Add the cubic torque."""
        assembly.add_law(
            self.name, Law.CUBIC, self.along, self.along, parameters=(self.k * self.h,)
        )


@dataclass(frozen=True, slots=True)
class Mesh:
    """A gear mesh: spring k behind a play of +-half_play, equations (6) and (11).

    A damper c on the rate of the same deflection acts while the mesh is in contact.
    """

    name: str
    along: Along
    k: float
    half_play: float
    c: float = 0.0

    def enter(self, assembly: Assembly) -> None:
        """Add the closed mesh, and the bounded force that takes the play back out."""
        assembly.add_law(
            self.name,
            Law.PLAY,
            self.along,
            self.along,
            stiffness=self.k,
            damping=self.c,
            parameters=(self.half_play,),
        )


@dataclass(frozen=True, slots=True)
class DryFriction:
    """Dry friction T sign(w) that truly sticks; T_s adds a peak at rest (Stribeck)."""

    name: str
    coordinate: str
    T: float
    T_s: float = 0.0
    omega_s: float = 1.0

    def enter(self, assembly: Assembly) -> None:
        """Add the friction torque."""
        assembly.add_law(
            self.name,
            Law.FRICTION,
            {self.coordinate: 1.0},
            {f"{self.coordinate}'": 1.0},
            parameters=(self.T, self.T_s, self.omega_s),
        )


@dataclass(frozen=True, slots=True)
class LoadedFriction:
    """Dry friction (T + m |F|) sign(w), F the torque that the mesh named `mesh` transmits.

    It holds at rest what it can. The mesh must enter before it. With m = (1/eta - 1)/N on the
    pinion of a stage of ratio N the stage has the efficiency eta while the pinion drives, and
    2 - 1/eta while the gear does: up to 0.5 the gear cannot drive. Friction in proportion to the
    tooth force, with sticking: C. Pelchen, C. Schweiger and M. Otter, "Modeling and Simulating the
    Efficiency of Gearboxes and of Planetary Gearboxes", Modelica Conference 2002.
    """

    name: str
    coordinate: str
    mesh: str
    m: float
    T: float = 0.0

    def enter(self, assembly: Assembly) -> None:
        """Add the friction torque."""
        assembly.add_law(
            self.name,
            Law.LOADED,
            {self.coordinate: 1.0},
            {f"{self.coordinate}'": 1.0},
            parameters=(self.T, self.m),
            loaded_by=self.mesh,
        )


@dataclass(frozen=True, slots=True)
class ConstantTorque:
    """A constant torque in N.m, as of an imbalance or a hanging cable."""

    coordinate: str
    torque: float

    def enter(self, assembly: Assembly) -> None:
        """Add the torque."""
        assembly.add_constant_torque(self.coordinate, self.torque)


@dataclass(frozen=True, slots=True)
class Amplifier:
    """Input voltage to motor voltage, equation (1), with optional lag, dead zone and clip.

    In that order: the output stage is what is dead about zero and saturates, and what may
    give `uneven` times as much where it is positive.
    """

    k_a: float
    tau_a: float = 0.0
    V_sat: float | None = None
    V_d: float = 0.0
    uneven: float = 1.0
    hold_hz: float = 0.0
    """Rate at which its input is sampled and held, Hz; 0 where it is continuous."""
    controller: Controller | None = None
    """What commands it; the source does where there is none."""

    def _feed(self, assembly: Assembly) -> Feed:
        """What its input is, once all that makes it has entered."""
        if self.controller is not None:
            return self.controller.feed(assembly)
        if self.hold_hz == 0.0:
            return Feed(source=1.0)
        clock = (self.hold_hz,)
        assembly.add_law("command", Law.HOLD, {}, {}, feedthrough=1.0, parameters=clock)
        return Feed(laws={"command": 1.0})

    def kinks(self) -> Iterator[tuple[str, float, float, float]]:
        """Name, weight, limit and centre of the `Law.EXCESS` that bend its characteristic."""
        clip = math.inf if self.V_sat is None else self.V_sat
        far = max(_FAR, 4.0 * clip) if clip < math.inf else _FAR
        if self.V_d > 0.0:
            # What exceeds the dead zone comes through, and nothing else does.
            yield "amplifier_dead_zone", -1.0, self.V_d, 0.0
        if self.uneven != 1.0:
            yield "amplifier_uneven", 1.0 - self.uneven, far, self.V_d - far
            if clip < math.inf:
                above, below = self.V_d + clip / self.uneven, self.V_d + clip
                yield "amplifier_above", self.uneven, far, above - far
                yield "amplifier_below", 1.0, far, far - below
        elif clip < math.inf:
            yield "amplifier", 1.0, self.V_d + clip, 0.0


@dataclass(frozen=True, slots=True)
class Motor:
    """A DC motor on its amplifier, equations (2) and (5) without the friction.

    With a current-controlled amplifier the voltage stands for the commanded current: R_m is then
    1 ohm, k_b 0, and L_a the time constant of the current loop.
    """

    coordinate: str
    L_a: float
    R_m: float
    k_b: float
    k_t: float
    amplifier: Amplifier

    def enter(self, assembly: Assembly) -> None:
        """Add the armature current, the torque, and the amplifier's own state and laws."""
        amplifier, linear = self.amplifier, self.amplifier.V_d == 0.0
        assembly.add_signal("i_a")
        assembly.add_coupling("i_a", "i_a", -self.R_m / self.L_a)
        assembly.add_coupling("i_a", f"{self.coordinate}'", -self.k_b / self.L_a)
        assembly.add_coupling(self.coordinate, "i_a", self.k_t)
        feed = amplifier._feed(assembly)
        if amplifier.tau_a > 0.0:
            assembly.add_signal("V_m")
            assembly.add_coupling("V_m", "V_m", -1.0 / amplifier.tau_a)
            feed.into(assembly, "V_m", amplifier.k_a / amplifier.tau_a)
            assembly.add_coupling("i_a", "V_m", linear / self.L_a)
            felt = Feed({"V_m": 1.0})
        else:
            feed.into(assembly, "i_a", linear * amplifier.k_a / self.L_a)
            felt = feed.times(amplifier.k_a)
        for name, weight, limit, centre in amplifier.kinks():
            assembly.add_law(
                name,
                Law.EXCESS,
                {"i_a": weight / self.L_a},
                felt.states,
                feedthrough=felt.source,
                parameters=(limit, centre),
                hears=felt.laws,
            )


@dataclass(frozen=True, slots=True)
class Tachometer:
    """Tachometer and its second-order filter, equations (3) and (4), read with a delay `T_d`.

    The delay is Pade's approximation of second order: half a degree off at 1.5 rad, 2 at 2.
    """

    coordinate: str
    k_ts: float
    numerator: float
    denominator: tuple[float, float, float]
    T_d: float = 0.0
    delay_s: float = 0.0
    """A delay that the datasheet states; it is exact."""

    def enter(self, assembly: Assembly) -> None:
        """Add the filter's output `V_o` and its rate."""
        source = {f"{self.coordinate}'": self.k_ts}
        add_filter(assembly, self.numerator, self.denominator, source)
        if self.delay_s > 0.0:
            read_late(assembly, self.delay_s)
        if self.T_d > 0.0:
            assembly.output |= add_late(assembly, Feed({"V_o": 1.0}), self.T_d, "V_T")
