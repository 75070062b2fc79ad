"""Effects that nobody would suspect first: the end of the catalogue.

Owns entries like those of `sim.catalogue`. Each of them has been taken for a
more usual cause, with confidence, while it was in no catalogue.
"""

from __future__ import annotations

import math
from dataclasses import replace

from sim.drivetrain import Drivetrain
from sim.effect import Effect, EffectParameter, around, drive_voltage, span, table_1, times
from sim.unit import Unit

__all__ = ["RARE"]

_P = EffectParameter


def _mesh2(unit: Unit) -> float:
    """Stiffness of the last mesh, N.m/rad: that of mesh 1 where there is no other."""
    return unit.stage1.k_g1 if unit.stage2 is None else unit.stage2.k_2


def _with_amplifier(d: Drivetrain, **changed: float) -> Drivetrain:
    amplifier = replace(d.elements["motor"].amplifier, **changed)  # type: ignore[attr-defined]
    return d.replacing("motor", amplifier=amplifier)


RARE = (
    Effect(
        "motor-inertia",
        (_P("J_m", "kg.m^2", around("J_m", 0.5, 2.0), (1e-12, math.inf)),),
        "plant",
        "The inertia of the motor differs from its datasheet.",
        "another motor, or a brake, fan or encoder wheel on its shaft",
        "compare what is on the motor's shaft with the drawing; take it off and measure again",
        on_unit=table_1("J_m"),
        rare=True,
    ),
    Effect(
        "mesh1-stiffness",
        (_P("k_g1", "N.m/rad", around("k_g1", 0.01, 2.0), (1e-9, math.inf)),),
        "plant",
        "The teeth of gear 1 are softer or stiffer than the datasheet has them.",
        "a plastic or cracked gear in stage 1, or its bearing giving way",
        "hold gear 1, put a known torque on the motor and read the twist with a dial gauge",
        on_unit=table_1("k_g1"),
        rare=True,
    ),
    Effect(
        "mesh2-stiffness",
        (_P("k_2", "N.m/rad", times(_mesh2, 0.01, 2.0), (1e-9, math.inf)),),
        "plant",
        "The teeth of gear 2 are softer or stiffer than the datasheet has them.",
        "a plastic or cracked gear in stage 2, or its bearing giving way",
        "hold pinion 2, put a known torque on the load and read the twist with a dial gauge",
        on_drivetrain=lambda d, unit, v: d.replacing("mesh2", k=v["k_2"]),
        rare=True,
    ),
    Effect(
        "gear-ratio",
        (_P("N_1", "1", around("N_1", 0.5, 2.0), (1e-6, math.inf)),),
        "plant",
        "The ratio of gear stage 1 differs from its datasheet.",
        "a pair of gears with other numbers of teeth",
        "count the teeth of stage 1, or the turns of the motor for one of shaft 1",
        on_unit=table_1("N_1"),
        rare=True,
    ),
    Effect(
        "amplifier-dead-zone",
        (_P("V_d", "V", times(drive_voltage, 0.003, 0.15)),),
        "chain",
        "The amplifier gives nothing about zero.",
        "an output stage without enough bias, or a switching stage with much dead time",
        "look at the motor's voltage at a low level with an oscilloscope; it stands still at zero",
        on_drivetrain=lambda d, unit, v: _with_amplifier(d, V_d=v["V_d"]),
        rare=True,
    ),
    Effect(
        "amplifier-unevenness",
        (_P("scale", "1", span(0.5, 2.0), (1e-6, math.inf)),),
        "chain",
        "The amplifier gives another voltage one way than the other.",
        "one half of its output stage weak, or the gains of its halves trimmed apart",
        "put the same direct voltage on its input either way and read the motor's with a meter",
        on_drivetrain=lambda d, unit, v: _with_amplifier(d, uneven=v["scale"]),
        rare=True,
    ),
    Effect(
        "reading-delay",
        (_P("T_d", "s", span(1e-4, 1.5e-3), (1e-5, 0.1)),),
        "chain",
        "What is read comes late by the same time at all frequencies.",
        "a digital filter or converter between tachometer and analyser",
        "feed the analyser's source into it; the phase falls in proportion to frequency",
        on_drivetrain=lambda d, unit, v: d.replacing("tachometer", T_d=v["T_d"]),
        rare=True,
    ),
)
