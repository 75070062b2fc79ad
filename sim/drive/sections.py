"""Sections of a unit file for what the paper's drives lack; each may be left out.

Owns their names, units and bounds, and what of a unit file they contradict. They build no
equations: `sim.drivetrain` does.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

__all__ = [
    "OPTIONAL_SECTIONS",
    "CurrentAmplifier",
    "Damping",
    "LoadCoupling",
    "Loop",
    "MotorCoupling",
    "NonNegative",
    "Positive",
    "Sampling",
    "Section",
    "Sensor",
    "find_contradiction",
]

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]

OPTIONAL_SECTIONS = (
    "stage3",
    "damping",
    "amplifier",
    "sampling",
    "sensor",
    "motor_coupling",
    "load_coupling",
    "loop",
)
"""Sections of a unit that are not there where a drive is like the paper's."""


class Section(BaseModel):
    """A section of a unit file: no key but its own, no value of another type."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)
    LATER: ClassVar[tuple[str, ...]] = ()
    """Keys that are no part of a unit's physics where they are not given: older units lack them."""

    @model_serializer(mode="wrap")
    def _without_later_keys(self, handler: SerializerFunctionWrapHandler) -> dict[str, object]:
        return {k: v for k, v in handler(self).items() if v is not None or k not in self.LATER}


class Damping(Section):
    """Damping that the datasheet knows of; the paper's units have none between motor and load."""

    LATER = ("c_3",)

    B_L: Positive | None = None
    """Viscous friction of the load, N.m.s/rad."""
    c_s1: Positive | None = None
    """Damping of shaft 1, N.m.s/rad; a damper 2 c_s1 is beside each half."""
    c_g1: Positive | None = None
    """Damping of mesh 1 while its teeth touch, N.m.s/rad."""
    c_2: Positive | None = None
    """Damping of mesh 2 while its teeth touch, N.m.s/rad."""
    c_3: Positive | None = None
    """Damping of mesh 3 while its teeth touch, N.m.s/rad."""


class CurrentAmplifier(Section):
    """An amplifier that controls the current; without it the amplifier controls the voltage.

    ``electronics.k_a`` is then in A per V. The back-EMF, the resistance and the inductance of the
    motor do not matter as long as the amplifier has voltage to spare.
    """

    kind: Literal["current"]
    bandwidth_hz: Positive
    """Of the current loop, as a lag of first order, Hz."""
    current_limit_a: Positive | None = None
    """Largest current, A; none where it is left out."""


class Sampling(Section):
    """A clock that the command, the sensor or both are sampled by."""

    rate_hz: Annotated[float, Field(gt=0, le=1e5)]
    """Samples a second."""
    holds_command: bool = True
    """Whether the amplifier's input is held from sample to sample (zero-order hold)."""


_READS = {"accelerometer": "acceleration", "current": "current"}
"""What is read by a sensor that reads one thing only."""

_GAIN_UNITS = {"position": "V/rad", "acceleration": "V.s^2/rad", "current": "V/A"}

_ANALOGUE = ("low_pass_hz", "high_pass_hz")


class Sensor(Section):
    """What the bench reads; without it a tachometer on the motor, read continuously."""

    LATER = ("radius_m", *_ANALOGUE)

    kind: Literal["tachometer", "encoder", "accelerometer", "current"]
    at: Literal["motor", "load"] = "motor"
    reads: Literal["speed", "position", "acceleration", "current"] = "speed"
    """Speed of an encoder is the difference of two samples over the time between them."""
    counts: Annotated[float, Field(ge=4, le=1e9)] | None = None
    """Counts of an encoder in a turn, after quadrature: four times its lines."""
    sampled: bool = False
    """Whether it is sampled by the clock of [sampling]; an encoder always is."""
    held: bool = False
    """Whether samples are read from an analogue output that holds them; else as recorded."""
    delay_s: Annotated[float, Field(ge=0, le=0.1)] | None = None
    """The response is late by so much beyond sampling, over command and sensor together, s."""
    radius_m: Positive | None = None
    """Of an accelerometer that is mounted tangentially, m; without it electronics.k_ts is V per
    rad/s^2, with it V per m/s^2."""
    low_pass_hz: Positive | None = None
    """Upper -3 dB corner of an accelerometer or current sensor, of first order, Hz."""
    high_pass_hz: Positive | None = None
    """Lower -3 dB corner of the same, of first order, Hz; none where it reads down to 0 Hz."""

    @model_validator(mode="before")
    @classmethod
    def _reads_what_its_kind_does(cls, given: Any) -> Any:
        if not isinstance(given, dict) or "reads" in given or given.get("kind") not in _READS:
            return given
        return {**given, "reads": _READS[given["kind"]]}

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        kind = self.kind
        if kind == "encoder" and self.counts is None:
            raise ValueError("sensor.counts is required by an encoder: counts in a turn")
        if self.counts is not None and self.counts != round(self.counts):
            raise ValueError(f"sensor.counts {self.counts:g} is no whole number of counts")
        if kind != "encoder" and self.counts is not None:
            raise ValueError(f"sensor.counts: sensor.kind {kind} has none; leave it out")
        if self.reads != _READS.get(kind, self.reads) or (
            kind not in _READS and self.reads in _READS.values()
        ):
            raise ValueError(f"sensor.reads: sensor.kind {kind} does not read {self.reads}")
        if kind == "tachometer" and self.reads == "position":
            raise ValueError("sensor.reads: a tachometer reads speed; use an encoder")
        if kind == "encoder" and self.sampled:
            raise ValueError("sensor.sampled: an encoder always is; leave it out")
        if self.held and not self.is_sampled:
            raise ValueError("sensor.held: nothing is sampled; leave it out or set sensor.sampled")
        if kind == "current" and self.at == "load":
            raise ValueError("sensor.at: the current is that of the motor; leave it out")
        if kind != "accelerometer" and self.radius_m is not None:
            raise ValueError("sensor.radius_m is that of an accelerometer; leave it out")
        for name in _ANALOGUE:
            if kind not in _READS and getattr(self, name) is not None:
                raise ValueError(
                    f"sensor.{name} is that of an accelerometer or current sensor; leave it out"
                )
        low, high = self.high_pass_hz, self.low_pass_hz
        if low is not None and high is not None and low >= high:
            raise ValueError(f"sensor.high_pass_hz {low:g} is not below low_pass_hz {high:g}")
        return self

    @property
    def is_sampled(self) -> bool:
        """Whether it is sampled by the clock."""
        return self.kind == "encoder" or self.sampled

    @property
    def gain_unit(self) -> str:
        """Unit of ``electronics.k_ts``."""
        if self.radius_m is not None:
            return "V.s^2/m"
        return _GAIN_UNITS.get(self.reads, "V.s/rad")


class MotorCoupling(Section):
    """An elastic coupling between motor and pinion 1; J_m is then that of the motor side."""

    k_cm: Positive
    """Torsional stiffness, N.m/rad."""
    c_cm: NonNegative = 0.0
    """Damping, N.m.s/rad."""
    J_cm: Positive
    """Inertia of pinion 1 with its half of the coupling, kg.m^2."""


class LoadCoupling(Section):
    """An elastic coupling between the last gear (or shaft 1 of one stage) and the load."""

    k_cL: Positive
    """Torsional stiffness, N.m/rad."""
    c_cL: NonNegative = 0.0
    """Damping, N.m.s/rad."""
    J_cL: Positive
    """Inertia of the last gear with its half of the coupling, kg.m^2."""


class Loop(Section):
    """A controller that is closed around the drive while it is measured.

    It acts on the volts that `Sensor` gives before a filter. With a command that a clock holds it
    runs at the clock; without one it is continuous. Its integral goes on while the amplifier clips.
    """

    controls: Literal["speed", "position"]
    """A position controller is around a speed controller; both act on the same sensor."""
    K_p: Positive
    """Of the speed controller, V of command per V of speed; per V/s where positions are read."""
    T_i_s: Positive | None = None
    """Integral time of the speed controller, s; left out by one that is proportional alone."""
    K_v: Positive | None = None
    """Of the position controller, which is proportional, 1/s."""
    excited: Literal["reference", "command"] = "reference"
    """Where the source is added: as the reference, or to the command, behind the controller."""
    filtered: bool = False
    """Of a tachometer: whether the controller gets what is behind the filter of [electronics]."""
    computing_s: Annotated[float, Field(ge=0, le=0.1)] | None = None
    """Time from reading to command, beyond sampling, s."""

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        if self.controls == "position" and self.K_v is None:
            raise ValueError("loop.K_v is required by a position loop: its gain in 1/s")
        if self.controls == "speed" and self.K_v is not None:
            raise ValueError("loop.K_v is that of a position loop; leave it out, or set controls")
        return self

    def gain_at(self, hertz: float) -> float:
        """V of command per V of source at a frequency, as long as nothing moves."""
        if self.excited == "command":
            return 1.0
        integral = 0.0 if self.T_i_s is None else 1.0 / (2.0 * math.pi * hertz * self.T_i_s)
        return self.K_p * (self.K_v or 1.0) * math.hypot(1.0, integral)


_OF_VOLTAGE = ("L_a", "R_m", "k_b")


def find_contradiction(unit: Any) -> str:
    """What sections of a unit contradict each other in, in words; empty where nothing is."""
    motor, electronics, sensor = unit.motor, unit.electronics, unit.sensor
    given = [name for name in _OF_VOLTAGE if getattr(motor, name) is not None]
    if unit.amplifier is None and len(given) < len(_OF_VOLTAGE):
        missing = next(name for name in _OF_VOLTAGE if name not in given)
        return (
            f"motor.{missing} is required, as the amplifier controls the voltage; one that "
            "controls the current has a section [amplifier]"
        )
    if unit.amplifier is not None and given:
        return (
            f"motor.{given[0]} has no influence beside [amplifier], which controls the current; "
            f"leave out {', '.join(given)}"
        )
    if unit.damping is not None and unit.damping.c_2 is not None and unit.stage2 is None:
        return "damping.c_2 is that of stage 2, and there is none; leave it out"
    if unit.damping is not None and unit.damping.c_3 is not None and unit.stage3 is None:
        return "damping.c_3 is that of stage 3, and there is none; leave it out"
    filtered = (electronics.filter_numerator, electronics.filter_denominator)
    tachometer = sensor is None or sensor.kind == "tachometer"
    if None in filtered and (tachometer or filtered != (None, None)):
        return (
            "electronics.filter_numerator and filter_denominator are required; a drive with "
            "another sensor than a tachometer that has no filter has neither"
        )
    endless = sensor is not None and sensor.kind == "accelerometer" and sensor.low_pass_hz is None
    if endless and None in filtered:
        return (
            "sensor.low_pass_hz is required by an accelerometer without a filter: the upper "
            "corner of its datasheet"
        )
    if sensor is not None and sensor.kind == "current" and unit.amplifier is not None:
        return (
            "sensor.kind current tells nothing beside [amplifier], which controls the current "
            "whatever the drive does; read a speed, position or acceleration"
        )
    if sensor is not None and sensor.is_sampled and unit.sampling is None:
        return "sensor is sampled, and there is no section [sampling] with rate_hz"
    clocked = sensor is not None and sensor.is_sampled
    if unit.sampling is not None and not (unit.sampling.holds_command or clocked):
        return "sampling.holds_command is false and no sensor is sampled; leave out [sampling]"
    return "" if unit.loop is None else _against_loop(unit)


def _against_loop(unit: Any) -> str:
    """What contradicts [loop], in words; empty where nothing does."""
    loop, encoder = unit.loop, unit.sensor is not None and unit.sensor.kind == "encoder"
    reads = "speed" if unit.sensor is None else unit.sensor.reads
    if loop.controls != reads:
        told = "; a tachometer reads speed" if loop.controls == "position" and not encoder else ""
        return (
            f"loop.controls is {loop.controls!r}, and sensor.reads is {reads!r}; a loop controls "
            f"what its sensor reads{told}"
        )
    if encoder and not unit.sampling.holds_command:
        return (
            "sampling.holds_command is false, and [loop] acts on an encoder: its controller runs "
            "at the clock and holds the command; set it to true"
        )
    if encoder and loop.filtered:
        return "loop.filtered: a controller acts on an encoder itself; leave it out"
    return ""
